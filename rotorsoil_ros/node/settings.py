"""What do the parameters of a node say: declared, read, and guarded against nonsense."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from difflib import get_close_matches
from functools import partial
import math
from pathlib import Path
from typing import Any

import numpy as np
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.document import located
from rotorsoil_ros.case.loading import cases_of
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.together import sources_of
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.monitor.rules import Judging, Matching
from rotorsoil_ros.node.parameters import (
    OF_MACHINE,
    OF_PLANT_MACHINE,
    of_unbalance,
    OWN,
    Setting,
)
from rotorsoil_ros.units import rpm_to_rad_s
from rotorsoil_ros.wire.speeds import ROTOR_JOINT, SpeedSource

OF_ROS = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


class Settings:
    """The parameters of one node: declared, read, and guarded against nonsense."""

    def __init__(self, node: Node) -> None:
        self.is_locked = self.is_changing = False
        self._node = node
        self.files: dict[str, dict[str, Path]] = {}  # by entry and machine, once checked
        self._known: dict[str, Setting] = {}
        self._of_case: dict[str, complex] = {}
        self._declare(OWN)
        self._declare_machines()
        node.add_on_set_parameters_callback(self._judge)
        node.add_post_set_parameters_callback(self._follow)

    @property
    def known(self) -> tuple[str, ...]:
        """Names of all parameters that are declared."""
        return tuple(self._known)

    def value(self, name: str) -> Any:
        """Return a value that obeys its rule."""
        value = self._node.get_parameter_or(name, Parameter(name, value=None)).value
        if value is None:
            value = self._known[name].default
        if fault := self._known[name].fault(value):
            raise InputError(f'parameter {name}: {fault}')
        return value

    def unknown(self) -> list[str]:
        """Return what was set under a name that no parameter has, with the near one."""
        told = []
        for name in self._node._parameter_overrides:
            if name not in self._known and name.split('.')[0] not in OF_ROS:
                near = get_close_matches(name, self._known, n=1)
                told.append(f'parameter {name} is not known'
                            + (f'; did you mean {near[0]}?' if near else ''))
        return told

    def check(self) -> None:
        """Raise InputError with all that is wrong: values, and the cases that they name."""
        found: list[str] = []
        self.files = {}
        self._declare_machines()

        def told(read: Callable[[], Any]) -> Any:
            try:
                return read()
            except InputError as error:
                found.append(str(error))
                return None

        for name in self._known:
            told(partial(self.value, name))
        for entry in told(lambda: self.machines) or []:
            self.files[entry] = told(partial(self.case_files, entry)) or {}
        files = [file for each in self.files.values() for file in each.values()]
        for name in (name for each in self.files.values() for name in each):
            if not any(fault.startswith(f'parameter {key(name)}.speed') for fault in found):
                told(partial(self.speed, name))
        if found:
            told(lambda: cases_of(files, cache_directory=self.cache))
            raise InputError('\n'.join(dict.fromkeys(found)))

    @property
    def machines(self) -> list[str]:
        """Names of the machines and plants, at least one."""
        names = list(self.value('machines'))
        if not names:
            raise InputError('parameter machines: must name at least one machine, got none')
        return names

    def case_files(self, entry: str) -> dict[str, Path]:
        """
        Return the case file of every machine that an entry of `machines` means, by its name.

        A plant has several, each called `<plant>/<machine>`. One of them alone, under a name of
        its own, is `FILE#NAME`, or FILE where it has the name of the entry.
        """
        path, mark, source = self.value(f'{entry}.case').partition('#')
        if not path:
            raise InputError(f'parameter {entry}.case: must be the path of a case file')
        file = located(Path(path))
        sources = sources_of(file) if not mark and file.is_file() else ()
        if entry in sources:
            return {entry: Path(f'{file}#{entry}')}
        # What is wrong with a plant is told where its file is read.
        return {f'{entry}/{one}': Path(f'{file}#{one}') for one in sources if one} or {
            entry: Path(f'{file}{mark}{source}')}

    @property
    def cache(self) -> Path | None:
        """Directory of the cache, None for the usual one."""
        return Path(self.value('cache')).expanduser() if self.value('cache') else None

    def speed(self, machine: str) -> SpeedSource:
        """Return what tells the speed of a machine."""
        own = key(machine)
        said = {name: self.value(f'{own}.speed.{name}')
                for name in ('topic', 'type', 'field', 'unit')}
        try:
            return SpeedSource(
                ratio=float(self.value(f'{own}.speed.ratio')),
                joint=self.value(f'{own}.rotor_joint') or ROTOR_JOINT, **said)
        except InputError as error:
            raise InputError(f'parameter {own}.speed: {error}') from error

    def joint_in_plant(self, machine: str) -> str:
        """Return the joint of a machine among those of its plant."""
        return self.value(f'{key(machine)}.rotor_joint') or machine.rpartition('/')[2]

    def judging(self, machine: str, case: Case) -> Judging:
        """Return how measurements of a machine are held against its predictions."""
        slow_roll = float(self.value(f'{key(machine)}.slow_roll_rpm'))
        return Judging.of(
            case, turns=float(self.value('vector_turns')),
            band_period_s=float(self.value('band_period_s')),
            matching=Matching(
                tolerance=float(self.value('match_tolerance_s')),
                slow_roll_speed=rpm_to_rad_s(slow_roll) if slow_roll else math.nan))

    def declare_unbalance(self, name: str, machine: Machine) -> None:
        """Declare the unbalance of every disc, as its case has it."""
        for own, value in zip(_planes(name, machine), machine.case.unbalance.tolist(),
                              strict=True):
            self._of_case[own] = value
            self._declare({f'{own}.{name}': setting
                           for name, setting in of_unbalance(value).items()})

    def forget_unbalance(self, name: str) -> None:
        """Remove what was declared of the unbalance of a machine."""
        for known in [known for known in self._known if known.startswith(of_discs(name))]:
            del self._known[known]
            if self._node.has_parameter(known):  # one that was refused never came into being
                self._node.undeclare_parameter(known)

    def renew_unbalance(self, name: str, machine: Machine) -> None:
        """Take the unbalance of another case; what somebody has set stays set."""
        kept = [Parameter(known, value=self.value(known))
                for known, setting in self._known.items()
                if known.startswith(of_discs(name)) and self.value(known) != setting.default]
        self.is_changing = True
        try:
            self.forget_unbalance(name)
            self.declare_unbalance(name, machine)
            self._node.set_parameters(
                [parameter for parameter in kept if parameter.name in self._known])
        finally:
            self.is_changing = False

    def unbalance(self, name: str, machine: Machine) -> ComplexArray:
        """Return moment * exp(i phase) of every disc, (discs,) [kg m]."""
        return np.array([self._unbalance(own) for own in _planes(name, machine)])

    def _unbalance(self, own: str) -> complex:
        names = f'{own}.moment', f'{own}.phase'
        moment, phase = (float(self.value(name)) for name in names)
        if (moment, phase) == tuple(self._known[name].default for name in names):
            # Through moment and phase it would differ in its last bit, live from offline.
            return self._of_case[own]
        return complex(moment * math.cos(phase), moment * math.sin(phase))

    def _declare(self, settings: Mapping[str, Setting]) -> None:
        for name, setting in settings.items():
            if name not in self._known:
                self._known[name] = setting
                setting.declare(self._node, name)

    def _declare_machines(self) -> None:
        for entry in self._node.get_parameter_or('machines').value or []:
            self._declare({f'{entry}.case': OF_MACHINE['case']})
            names = [entry]
            with suppress(InputError):  # what is wrong with a file is told when it is loaded
                names = [*self.case_files(entry)]
            for name in names:
                of_one = OF_MACHINE if name == entry else OF_PLANT_MACHINE
                self._declare({f'{key(name)}.{each}': setting for each, setting in of_one.items()})

    def _judge(self, parameters: list[Parameter]) -> SetParametersResult:
        """Refuse nonsense with the reason; what was set before stays."""
        for parameter in parameters:
            setting = self._known.get(parameter.name)
            if setting is None:
                continue
            fault = setting.fault(parameter.value)
            if not fault and self.is_locked and not setting.acts_at_once:
                fault = 'is read when the node is configured: clean it up first'
            if fault:
                return SetParametersResult(successful=False, reason=f'{parameter.name} {fault}')
        return SetParametersResult(successful=True)

    def _follow(self, parameters: list[Parameter]) -> None:
        """Declare the parameters of machines that were just named, or whose case was."""
        if any(parameter.name == 'machines' or parameter.name.endswith('.case')
               for parameter in parameters):
            self._declare_machines()


def key(name: str) -> str:
    """Return what the parameters of a machine begin with."""
    return name.replace('/', '.')


def of_discs(name: str) -> str:
    """Return what the parameters of the unbalance of a machine begin with."""
    return f'{key(name)}.unbalance.'


def _planes(name: str, machine: Machine) -> list[str]:
    """Return what the parameters of each disc begin with, by its name in its own rotor."""
    among = '' if machine.case.berth is None else f'{machine.case.name}_'
    return [of_discs(name) + plane.removeprefix(among) for plane in machine.table.planes]
