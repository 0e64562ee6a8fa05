"""Which parameters does the node have, and what may they be."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from functools import partial
from importlib.util import find_spec
import math
from pathlib import Path
import re
from typing import Any, TypeAlias

import numpy as np
from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.parameter import Parameter

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.document import located
from rotorsoil_ros.case.loading import cases_of
from rotorsoil_ros.case.plant.together import sources_of
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.monitor.rules import Judging, Matching
from rotorsoil_ros.units import rpm_to_rad_s, SPEED_UNITS
from rotorsoil_ros.wire.speeds import ROTOR_JOINT, SpeedSource, USUAL

Rule: TypeAlias = Callable[[Any], str]

LARGEST_MOMENT = 1e3  # [kg m]
OF_ROS = ('use_sim_time', 'start_type_description_service', 'qos_overrides')


def number(*, unit: str, lowest: float = -math.inf, highest: float = math.inf) -> Rule:
    """Return a rule that says what is wrong with a number; nothing where it holds."""
    def fault(value: Any) -> str:
        if isinstance(value, bool) or not isinstance(value, int | float):
            return f'must be a number in {unit}, got {value!r}'
        if not (math.isfinite(value) and lowest <= value <= highest):
            return f'must be finite and {lowest:g} to {highest:g} {unit}, got {value:g}'
        return ''
    return fault


def choice(*allowed: str) -> Rule:
    """Return a rule that holds for a few words."""
    return lambda value: '' if value in allowed else (
        f'must be one of {", ".join(allowed)}, got {value!r}')


def pattern(expression: str, meaning: str) -> Rule:
    """Return a rule that holds for strings of a form, or for lists of different ones."""
    def fault(value: Any) -> str:
        words = [value] if isinstance(value, str) else list(value)
        bad = [word for word in words if not re.fullmatch(expression, word)]
        if bad or len(set(words)) < len(words):
            return f'must be {meaning}, got {bad[0] if bad else words!r}'
        return ''
    return fault


def anything(value: Any) -> str:
    """Hold for every value of the declared type."""
    del value
    return ''


@dataclass(frozen=True, slots=True)
class Setting:
    """One parameter: default, what it is (with its unit), its rule, and when it acts."""

    default: Any
    meaning: str
    fault: Rule = anything
    span: tuple[float, float] | None = None
    acts_at_once: bool = False

    def declare(self, node: Node, name: str) -> None:
        """Declare the parameter; a value from the command line or a file wins."""
        descriptor = ParameterDescriptor(description=self.meaning)
        if isinstance(self.default, float):
            # Statically typed, a double would refuse `-p stale_after_s:=3`.
            descriptor.dynamic_typing = True
        if self.span and isinstance(self.default, float):
            descriptor.floating_point_range = [FloatingPointRange(
                from_value=self.span[0], to_value=self.span[1])]
        elif self.span:
            descriptor.integer_range = [IntegerRange(
                from_value=int(self.span[0]), to_value=int(self.span[1]), step=1)]
        default = self.default
        if default == []:
            default = Parameter.Type.STRING_ARRAY
        try:
            node.declare_parameter(name, default, descriptor)
        except ParameterException as error:
            raise InputError(f'parameter {name}: {error}') from error


def quantity(
    default: float, meaning: str, unit: str, *, span: tuple[float, float],
    acts_at_once: bool = False,
) -> Setting:
    """Return a parameter that is a number with a unit and a range."""
    return Setting(
        default, f'{meaning} [{unit}].', number(unit=unit, lowest=span[0], highest=span[1]), span,
        acts_at_once)


OWN = {
    'machines': Setting(
        [], 'Names of the machines, each the first part of its topics.',
        pattern('[a-z][a-z0-9_]*', 'different names of a-z, 0-9 and _ that begin with a letter')),
    'speed_reliability': Setting(
        'best_effort', 'Reliability asked of speed topics: best_effort or reliable.',
        choice('best_effort', 'reliable')),
    'speed_depth': Setting(
        10, 'Speeds kept while the node is busy [messages].',
        number(unit='messages', lowest=1, highest=100_000), (1, 100_000)),
    'stale_after_s': quantity(
        3.0, 'Silence of a speed topic after which a machine counts as stale', 's',
        span=(0.1, 86400.0), acts_at_once=True),
    'executor': Setting(
        'events', 'What runs the callbacks: events or single. Read at the start only.',
        choice('events', 'single')),
    'autostart': Setting(
        True, 'Whether to configure and activate without being asked. Read at the start only.'),
    'cache': Setting(
        '', 'Directory of computed tables; empty: $ROTORSOIL_CACHE or the cache of the user.'),
    'match_tolerance_s': quantity(
        Matching().tolerance, 'Largest distance between the stamps of a measurement and of the '
        'speed that it belongs to', 's', span=(0.0, 60.0)),
    'vector_turns': quantity(
        Judging().turns, 'Turns of the rotor that make one vector of raw samples', 'turns',
        span=(2.0, 1000.0)),
    'band_period_s': quantity(
        Judging().band_period_s, 'Message time between two bands while the speed changes (else '
        'a second), zero: one with every speed', 's', span=(0.0, 3600.0)),
    'log.directory': Setting('', 'Directory for logs; empty: no logs.'),
    'log.name': Setting(
        'run', 'Name of the log; where it is taken, name_2, name_3...',
        pattern('[A-Za-z0-9][A-Za-z0-9_.-]*', 'a name of letters, digits and _ . -')),
    'log.mcap': Setting(True, 'Whether to record messages as a rosbag2 bag of MCAP files.'),
    'log.rerun': Setting(
        find_spec('rerun') is not None, 'Whether to record what the rerun viewer shows.'),
    'log.rerun_url': Setting(
        '', 'Address of a rerun viewer to show the run live, such as '
        'rerun+http://127.0.0.1:9876/proxy; empty: none.'),
    'log.split_mib': quantity(
        0.0, 'Size at which a new MCAP file begins, zero: when its index takes 4 MiB of memory',
        'MiB', span=(0.0, 1e6)),
    'log.split_s': quantity(
        0.0, 'Message time after which a new MCAP file begins, zero: as log.split_mib', 's',
        span=(0.0, 1e7)),
    'log.budget_mib': quantity(
        0.0, 'Disk space for all logs of this name in the directory; the oldest make room for '
        'new ones, zero: they never do', 'MiB', span=(0.0, 1e9)),
}
OF_MACHINE = {
    'case': Setting('', 'Case file of the machine (YAML), or the name of a shipped case.'),
    'rotor_joint': Setting(
        ROTOR_JOINT, 'Joint of joint_states whose velocity is the rotor speed.'),
    'speed.topic': Setting(
        USUAL.topic, 'Topic of the speed; empty: joint_states and rotor/speed of the machine.'),
    'speed.type': Setting(
        USUAL.type, 'Type of its messages, as in std_msgs/msg/Int32; empty: whatever is '
        'published there.'),
    'speed.field': Setting(
        USUAL.field, 'Number in the message that is the speed, as in twist.angular.z or '
        'velocity[2]; empty: the velocity of the joint, or the only number.'),
    'speed.unit': Setting(
        USUAL.unit, f'Unit of the number: {", ".join(SPEED_UNITS)}.', choice(*SPEED_UNITS)),
    'speed.ratio': Setting(
        USUAL.ratio, 'Turns of the rotor for one turn of what is told; negative where it counts '
        'backwards.', number(unit='turns per turn')),
    'slow_roll_rpm': quantity(
        0.0, 'Speed whose measured vector is runout and is subtracted, zero: none', 'rpm',
        span=(0.0, 1e6)),
}


def of_unbalance(value: complex) -> dict[str, Setting]:
    """Return the parameters of the unbalance of one disc, as its case has it."""
    return {
        'moment': quantity(
            abs(value), 'Unbalance moment; the next message uses it', 'kg m',
            span=(0.0, LARGEST_MOMENT), acts_at_once=True),
        'phase': Setting(
            math.atan2(value.imag, value.real),
            'Phase of the unbalance; the next message uses it [rad].', number(unit='rad'),
            acts_at_once=True),
    }


def described() -> str:
    """Return every parameter with its default and what it is, for a terminal."""
    lines = []
    for prefix, settings in (('', OWN), ('<machine>.', OF_MACHINE), (
            '<machine>.unbalance.<disc>.', of_unbalance(0j))):
        for name, setting in settings.items():
            default = 'as in the case' if 'unbalance' in prefix else repr(setting.default)
            lines.append(f'  {prefix}{name} ({default})\n      {setting.meaning}')
    return '\n'.join(lines)


class Settings:
    """The parameters of one node: declared, read, and guarded against nonsense."""

    def __init__(self, node: Node) -> None:
        self.is_locked = self.is_changing = False
        self._node = node
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

        def told(read: Callable[[], Any]) -> Any:
            try:
                return read()
            except InputError as error:
                found.append(str(error))
                return None

        for name in self._known:
            told(partial(self.value, name))
        names = told(lambda: self.machines) or []
        files = [told(partial(self.case_file, name)) for name in names]
        for name in names:
            if not any(fault.startswith(f'parameter {name}.speed') for fault in found):
                told(partial(self.speed, name))
        if found:
            told(lambda: cases_of(filter(None, files), cache_directory=self.cache))
            raise InputError('\n'.join(dict.fromkeys(found)))

    @property
    def machines(self) -> list[str]:
        """Names of the machines, at least one."""
        names = list(self.value('machines'))
        if not names:
            raise InputError('parameter machines: must name at least one machine, got none')
        return names

    def case_file(self, machine: str) -> Path:
        """Return the case file of a machine; of several in it that of its name, or `FILE#NAME`."""
        path, mark, source = self.value(f'{machine}.case').partition('#')
        if not path:
            raise InputError(f'parameter {machine}.case: must be the path of a case file')
        file = located(Path(path))
        if not mark and file.is_file() and machine in sources_of(file):
            mark, source = '#', machine
        return Path(f'{file}{mark}{source}')

    @property
    def cache(self) -> Path | None:
        """Directory of the cache, None for the usual one."""
        return Path(self.value('cache')).expanduser() if self.value('cache') else None

    def speed(self, machine: str) -> SpeedSource:
        """Return what tells the speed of a machine."""
        said = {name: self.value(f'{machine}.speed.{name}')
                for name in ('topic', 'type', 'field', 'unit')}
        try:
            return SpeedSource(
                ratio=float(self.value(f'{machine}.speed.ratio')),
                joint=self.value(f'{machine}.rotor_joint'), **said)
        except InputError as error:
            raise InputError(f'parameter {machine}.speed: {error}') from error

    def judging(self, machine: str, case: Case) -> Judging:
        """Return how measurements of a machine are held against its predictions."""
        slow_roll = float(self.value(f'{machine}.slow_roll_rpm'))
        return Judging.of(
            case, turns=float(self.value('vector_turns')),
            band_period_s=float(self.value('band_period_s')),
            matching=Matching(
                tolerance=float(self.value('match_tolerance_s')),
                slow_roll_speed=rpm_to_rad_s(slow_roll) if slow_roll else math.nan))

    def declare_unbalance(
        self, machine: str, discs: Sequence[str], unbalance: ComplexArray,
    ) -> None:
        """Declare the unbalance of every disc, as its case has it."""
        for disc, value in zip(discs, unbalance.tolist(), strict=True):
            own = f'{machine}.unbalance.{disc}'
            self._of_case[own] = value
            self._declare({f'{own}.{name}': setting
                           for name, setting in of_unbalance(value).items()})

    def forget_unbalance(self, machine: str) -> None:
        """Remove what was declared of the unbalance of a machine."""
        for name in [name for name in self._known if name.startswith(f'{machine}.unbalance.')]:
            del self._known[name]
            if self._node.has_parameter(name):  # one that was refused never came into being
                self._node.undeclare_parameter(name)

    def renew_unbalance(
        self, machine: str, discs: Sequence[str], unbalance: ComplexArray,
    ) -> None:
        """Take the unbalance of another case; what somebody has set stays set."""
        own = f'{machine}.unbalance.'
        kept = [Parameter(name, value=self.value(name)) for name, setting in self._known.items()
                if name.startswith(own) and self.value(name) != setting.default]
        self.is_changing = True
        try:
            self.forget_unbalance(machine)
            self.declare_unbalance(machine, discs, unbalance)
            self._node.set_parameters(
                [parameter for parameter in kept if parameter.name in self._known])
        finally:
            self.is_changing = False

    def unbalance(self, machine: str, discs: Sequence[str]) -> ComplexArray:
        """Return moment * exp(i phase) of every disc, (discs,) [kg m]."""
        return np.array([self._unbalance(f'{machine}.unbalance.{disc}') for disc in discs])

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
        for machine in self._node.get_parameter_or('machines').value or []:
            self._declare({f'{machine}.{name}': setting for name, setting in OF_MACHINE.items()})

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
        """Declare the parameters of machines that were just named."""
        if any(parameter.name == 'machines' for parameter in parameters):
            self._declare_machines()
