"""Which machine a case file describes."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
import re
from typing import TypeAlias

import numpy as np
from pydantic import ValidationError

from rotorsoil_ros.case import document, schema
from rotorsoil_ros.physics.arrays import ComplexArray, FloatArray
from rotorsoil_ros.physics.coupled import CoupledModel
from rotorsoil_ros.physics.errors import InputError, RotorSoilError
from rotorsoil_ros.physics.foundation import Foundation
from rotorsoil_ros.physics.infinite import a0_range
from rotorsoil_ros.physics.infinite_table import require_kind
from rotorsoil_ros.physics.rotor import Bearing, Disc, Material, Probe, Rotor, ShaftSection
from rotorsoil_ros.physics.soil import Circle, Contact, Rectangle, RigidSoil, Soil
from rotorsoil_ros.physics.units import rpm_to_rad_s

_Place: TypeAlias = tuple[int | str, ...]


@dataclass(frozen=True)
class Case:
    """
    One machine on its soil, as its file describes it.

    Attributes
    ----------
    name : str
        Becomes the topic namespace.
    path : Path
        The file it came from.
    soil : Soil or None
        Half-space; None is allowed on a rigid support only.
    support : schema.Support
        Which model of the soil, and its geometry.
    foundations : tuple of Foundation
        The blocks.
    rotor : Rotor
        What turns.
    unbalance : (p,) complex array
        moment * exp(i phase) of every disc of the rotor, in their order [kg m].
    speed_range : tuple of two floats
        Lowest and highest rotor speed [rad/s].

    """

    name: str
    path: Path
    soil: Soil | None
    support: schema.Support
    foundations: tuple[Foundation, ...]
    rotor: Rotor
    unbalance: ComplexArray
    speed_range: tuple[float, float]


# Natural modes above the running speed and excitation at twice the speed need the soil too.
_HIGHEST_ORDER = 2.0


def infinite_range(
    soil: Soil, contact: Contact, geometry: str, speed_range: tuple[float, float],
) -> tuple[float, float]:
    """Return the frequencies [rad/s] that infinite elements have to cover for some speeds."""
    low, high = speed_range
    # A disc is known down to rest; a strip has no static stiffness.
    omega = 0.0 if geometry == 'disc' else low, _HIGHEST_ORDER * high
    a0_range(soil, contact, geometry, omega_min=omega[0], omega_max=omega[1])
    return omega


def load(path: Path, overrides: Sequence[str] = ()) -> Case:
    """
    Read and check a case file.

    Parameters
    ----------
    path : Path
        The YAML file.
    overrides : sequence of str
        Settings `key.path=value` that replace or add to what the file says, in order.

    Returns
    -------
    Case
        The machine, fit for `models.coupled_model`.

    Raises
    ------
    InputError
        One line: file, key path, what is wrong, in which unit, and the value.

    """
    content = document.read(path)
    document.override(content, overrides)
    try:
        entries = schema.Document.model_validate(content)
    except ValidationError as error:
        place, problem = schema.first_fault(error)
        raise InputError(_message(path, place, problem)) from error
    return _Builder(path, entries).case()


def _message(path: Path, place: _Place, problem: str) -> str:
    steps = (str(step) for step in place)
    words = (step if step.isidentifier() or step.isdigit() else document.shown(step)
             for step in steps)
    return ': '.join(filter(None, (str(path), '.'.join(words), problem)))


@dataclass(frozen=True)
class _Builder:
    """Builds the physics of a document and says at which key it was refused."""

    path: Path
    entries: schema.Document

    def case(self) -> Case:
        entries = self.entries
        with self._at('soil', entry=entries.soil):
            soil = None if entries.soil is None else Soil(**dict(entries.soil))
        self._refuse_repeated_names()
        self._refuse_unfit_support()
        rotor = self._rotor()
        case = Case(
            name=entries.name, path=self.path, soil=soil, support=entries.support,
            foundations=self._foundations(rotor), rotor=rotor,
            unbalance=self._unbalance(rotor), speed_range=self._speed_range())
        with self._at('rotor', entry=entries.rotor):
            CoupledModel(rotor, case.foundations, [RigidSoil() for _ in case.foundations])
        self._refuse_unreachable_soil(case)
        return case

    @contextmanager
    def _at(self, *place: int | str, entry: schema.Entry | None = None) -> Iterator[None]:
        """Turn a refusal of the physics into an error at a key of the file."""
        try:
            yield
        except InputError:
            raise
        except RotorSoilError as error:
            # The physics says `mass must be ...` or `position of disc_1 must be ...`.
            problem = str(error)
            found = re.match(r'(\w+)(?: of (\w+)| about \w+)? must ', problem)
            if found and found[2]:
                place = (*self._station(found[2]), found[1])
            elif found and entry is not None and found[1] in type(entry).model_fields:
                place = (*place, found[1])
                problem = problem.removeprefix(f'{found[1]} ')
            raise self._error(*place, problem=problem) from error

    def _error(self, *place: int | str, problem: str) -> InputError:
        return InputError(_message(self.path, place, problem))

    def _stations(self) -> list[tuple[_Place, str]]:
        rotor = self.entries.rotor
        groups: list[tuple[_Place, Sequence[schema.Foundation | schema.Disc | schema.Bearing
                                           | schema.Probe]]] = [
            (('foundations',), self.entries.foundations), (('rotor', 'discs'), rotor.discs),
            (('rotor', 'bearings'), rotor.bearings), (('rotor', 'probes'), rotor.probes)]
        return [((*group, index), entry.name) for group, entries in groups
                for index, entry in enumerate(entries)]

    def _station(self, name: str) -> _Place:
        return next((place for place, own in self._stations() if own == name), ('rotor',))

    def _refuse_repeated_names(self) -> None:
        seen: dict[str, _Place] = {}
        for place, name in self._stations():
            if name in seen:
                first = '.'.join(map(str, seen[name]))
                raise self._error(*place, 'name', problem=f'must differ from that of {first}, '
                                                          f'got {name} twice')
            seen[name] = place

    def _refuse_unfit_support(self) -> None:
        support = self.entries.support
        if support.model == 'rigid':
            return
        if self.entries.soil is None:
            raise self._error('soil', problem=f'is missing; the support model {support.model} '
                                              'needs it')
        if support.model == 'cone' and support.geometry != 'disc':
            raise self._error('support', 'geometry', problem='must be disc for the model cone, '
                                                             f'got {support.geometry}')
        if not self.entries.foundations:
            raise self._error('foundations', problem='is missing; the support model '
                                                     f'{support.model} needs a block')

    def _refuse_unreachable_soil(self, case: Case) -> None:
        if case.support.model != 'infinite_elements' or case.soil is None:
            return
        geometry = case.support.geometry
        with self._at('soil', entry=self.entries.soil):
            require_kind(geometry, case.soil.poisson_ratio, case.soil.loss_factor)
        for index, foundation in enumerate(case.foundations):
            with self._at('foundations', index):
                infinite_range(case.soil, foundation.contact, geometry, case.speed_range)

    def _rotor(self) -> Rotor:
        entries = self.entries.rotor
        shaft = tuple(self._section(i, entry) for i, entry in enumerate(entries.shaft))
        discs = []
        for index, entry in enumerate(entries.discs):
            with self._at('rotor', 'discs', index, entry=entry):
                discs.append(Disc(**dict(entry)))
        bearings = tuple(self._bearing(i, entry) for i, entry in enumerate(entries.bearings))
        probes = tuple(Probe(entry.name, entry.position) for entry in entries.probes)
        with self._at('rotor', entry=entries):
            return Rotor(shaft_height=entries.shaft_height, shaft=shaft, discs=tuple(discs),
                         bearings=bearings, probes=probes)

    def _section(self, index: int, entry: schema.Section) -> ShaftSection:
        place = ('rotor', 'shaft', index)
        material = self._material(place, entry)
        with self._at(*place, entry=entry):
            return ShaftSection(
                length=entry.length, elements=entry.elements, material=material,
                outer_diameter=_ends(entry.outer_diameter, entry.outer_diameter_end),
                inner_diameter=_ends(entry.inner_diameter, entry.inner_diameter_end),
                **({} if entry.added_mass is None else {'added_mass': entry.added_mass}))

    def _material(self, section: _Place, entry: schema.Section) -> Material:
        own, common = entry.material, self.entries.rotor.material
        place = ('rotor', 'material') if own is None else (*section, 'material')
        chosen = common if own is None else own
        if chosen is None:
            raise self._error(*place, problem='is missing, and so is that of '
                                              + '.'.join(map(str, section)))
        with self._at(*place, entry=chosen):
            return Material(**dict(chosen))

    def _bearing(self, index: int, entry: schema.Bearing) -> Bearing:
        foundation = entry.foundation
        blocks = self.entries.foundations
        if foundation is None and blocks:
            if len(blocks) > 1:
                names = ', '.join(block.name for block in blocks)
                raise self._error('rotor', 'bearings', index, 'foundation',
                                  problem=f'is missing; there are several: {names}')
            foundation = blocks[0].name
        with self._at('rotor', 'bearings', index, entry=entry):
            return Bearing(name=entry.name, position=entry.position, foundation=foundation,
                           stiffness=_matrix(entry.stiffness), damping=_matrix(entry.damping))

    def _foundations(self, rotor: Rotor) -> tuple[Foundation, ...]:
        foundations = []
        for index, entry in enumerate(self.entries.foundations):
            seats = [bearing.position for bearing in rotor.bearings
                     if bearing.foundation == entry.name]
            if not seats:
                raise self._error('foundations', index, problem=f'no bearing stands on '
                                                                f'{entry.name}')
            with self._at('foundations', index, entry=entry):
                centre_y = entry.centre_y
                foundations.append(Foundation(
                    name=entry.name, contact=self._contact(index, entry), mass=entry.mass,
                    centre_y=0.5 * (min(seats) + max(seats)) if centre_y is None else centre_y,
                    centre_of_gravity_height=entry.centre_of_gravity_height,
                    inertia=entry.inertia, height=entry.height))
        return tuple(foundations)

    def _contact(self, index: int, entry: schema.Foundation) -> Contact:
        width, length, radius = entry.half_width, entry.half_length, entry.radius
        if radius is not None and width is None and length is None:
            return Circle(radius)
        if radius is None and width is not None and length is not None:
            return Rectangle(width, length)
        raise self._error('foundations', index, problem='needs either half_width and half_length '
                                                        'or radius, in m')

    def _unbalance(self, rotor: Rotor) -> ComplexArray:
        names = [disc.name for disc in rotor.discs]
        total = np.zeros(len(names), dtype=complex)
        for index, entry in enumerate(self.entries.unbalances):
            if entry.disc not in names:
                raise self._error('unbalances', index, 'disc',
                                  problem=f'must be one of {", ".join(names)}, got {entry.disc}')
            total[names.index(entry.disc)] += entry.moment * np.exp(1j * entry.phase)
        return total

    def _speed_range(self) -> tuple[float, float]:
        low, high = self.entries.speed_range_rpm
        if not 0.0 <= low < high:
            raise self._error('speed_range_rpm', problem='must be two rising speeds >= 0 rpm, '
                                                         f'got [{low:g}, {high:g}]')
        return rpm_to_rad_s(low), rpm_to_rad_s(high)


def _ends(left: float, right: float | None) -> tuple[float, float]:
    return left, left if right is None else right


def _matrix(entry: schema.Stiffness | schema.Damping) -> FloatArray:
    return np.array([[entry.xx, entry.xz], [entry.zx, entry.zz]])
