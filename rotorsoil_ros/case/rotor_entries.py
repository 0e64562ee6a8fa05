"""Which rotor the entries of a case file describe."""

from dataclasses import dataclass
import math
from typing import Any

import numpy as np

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case import schema
from rotorsoil_ros.case.authoring import library
from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.entries.bearing import BearingEntry, MassPerAxis, PedestalEntry
from rotorsoil_ros.case.entries.coefficients import coefficients, constant
from rotorsoil_ros.case.entries.entry import Place
from rotorsoil_ros.case.entries.shaft import MaterialEntry, Section
from rotorsoil_ros.errors import require
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing, Pedestal
from rotorsoil_ros.rotor.disc import Disc, permissible_unbalance
from rotorsoil_ros.rotor.shaft import Material, Probe, ShaftDamping, ShaftSection
from rotorsoil_ros.units import rpm_to_rad_s

_INERTIAS, _DIMENSIONS = schema.DiscEntry.ways

# Which attribute of a ShaftDamping each key is, and its unit.
_DAMPINGS = {
    'internal_damping': {'viscous': ('viscous', 's'), 'loss_factor': ('loss_factor', '-')},
    'external_damping': {'mass': ('fixed_mass', '1/s'), 'stiffness': ('fixed_stiffness', 's')}}

# More than anybody could solve.
_MOST_SHAFT_NODES = 2000


@dataclass(frozen=True)
class RotorEntries:
    """Builds a rotor and says at which key it was refused."""

    faults: Faults

    def mesh(self) -> int:
        """Return the number of nodes, or raise an InputError if nobody could solve so many."""
        rotor = self.faults.entries.rotor
        nodes = 1 + sum(section.elements for section in rotor.shaft) + len(rotor.discs) + len(
            rotor.bearings) + len(rotor.probes)
        if nodes > _MOST_SHAFT_NODES:
            raise self.faults.error('rotor', 'shaft', problem=(
                f'must have at most {_MOST_SHAFT_NODES} nodes with all stations, got {nodes}'))
        return nodes

    def rotor(self) -> Rotor | None:
        """Return shaft, discs, bearings and probes, or None where one is at fault."""
        entries, faults = self.faults.entries.rotor, self.faults
        shaft = faults.attempt_each(self._section, entries.shaft)
        discs = faults.attempt_each(self._disc, entries.discs)
        bearings = faults.attempt_each(self._bearing, entries.bearings)
        probes = faults.attempt_each(self._probe, entries.probes)
        if shaft is None or discs is None or bearings is None or probes is None:
            return None
        return faults.attempt(lambda: self._assembled(shaft, discs, bearings, probes))

    def _assembled(
        self, shaft: tuple[ShaftSection, ...], discs: tuple[Disc, ...],
        bearings: tuple[Bearing, ...], probes: tuple[Probe, ...],
    ) -> Rotor:
        entries = self.faults.entries.rotor
        external = entries.external_damping
        with self.faults.at('rotor', entry=entries):
            return Rotor(shaft_height=entries.shaft_height, shaft=shaft, discs=discs,
                         bearings=bearings, probes=probes,
                         drag=0.0 if external is None else external.mass,
                         is_upright=entries.orientation == 'vertical')

    def _probe(self, index: int, entry: schema.ProbeEntry) -> Probe:
        angle = None if entry.angle_deg is None else math.radians(
            self._degrees(('rotor', 'probes', index, 'angle_deg'), entry.angle_deg))
        return Probe(entry.name, entry.position, angle, entry.relative_to or '')

    def _degrees(self, place: Place, given: float | str) -> float:
        """Return an angle from z towards x, which may be told as it is seen from the driver."""
        if not isinstance(given, str):
            if not -180.0 <= given <= 360.0:
                raise self.faults.error(*place, problem='must be between -180 and 360 deg, from z '
                                                        f'towards x, got {given:g}')
            return given
        driver, size = self.faults.entries.rotor.driver, float(given[:-1])
        if driver is None:
            raise self.faults.error('rotor', 'driver', problem=(
                f'is missing, left or right: {given} of {".".join(map(str, place))} is as seen '
                'from there'))
        if size > 180.0:
            raise self.faults.error(*place, problem=f'must be at most 180 deg to one side, '
                                                    f'got {given}')
        # Who looks along y, from the left end, has x at the right hand.
        return size if (given[-1] == 'R') == (driver == 'left') else -size

    def _section(self, index: int, entry: Section) -> ShaftSection:
        place = ('rotor', 'shaft', index)
        material, damping = self._material(place, entry), self._damping(place, entry)
        common = self.faults.entries.rotor
        loads = {key: own if own is not None else getattr(common, key) or 0.0
                 for key in ('axial_force', 'torque') for own in [getattr(entry, key)]}
        with self.faults.at(*place, entry=entry):
            return ShaftSection(
                length=entry.length, elements=entry.elements, material=material,
                outer_diameter=_ends(entry.outer_diameter, entry.outer_diameter_end),
                inner_diameter=_ends(entry.inner_diameter, entry.inner_diameter_end),
                added_mass=entry.added_mass or 0.0, damping=damping, **loads)

    def _material(self, section: Place, entry: Section) -> Material:
        own, common = entry.material, self.faults.entries.rotor.material
        place = ('rotor', 'material') if own is None else (*section, 'material')
        chosen = common if own is None else own
        if chosen is None:
            raise self.faults.error(*place, problem='is missing, and so is that of '
                                                    + '.'.join(map(str, section)))
        if not isinstance(chosen, MaterialEntry):
            return library.material(chosen)
        with self.faults.at(*place, entry=chosen):
            return Material(**dict(chosen))

    def _damping(self, section: Place, entry: Section) -> ShaftDamping:
        """Return what a section loses: as it says itself, else as the rotor does."""
        common: schema.RotorEntry = self.faults.entries.rotor
        given: dict[str, float] = {}
        for key, names in _DAMPINGS.items():
            own = getattr(entry, key)
            chosen = getattr(common, key) if own is None else own
            if chosen is None:
                continue
            place = ('rotor', key) if own is None else (*section, key)
            with self.faults.at(*place, entry=chosen):
                for part, (name, unit) in names.items():
                    given[name] = getattr(chosen, part)
                    require(given[name] >= 0.0, part, f'>= 0 {unit}', given[name])
                ShaftDamping(**given)  # says what else is wrong at its own key
        return ShaftDamping(**given)

    def _disc(self, index: int, entry: schema.DiscEntry) -> Disc:
        place = ('rotor', 'discs', index)
        said = {key for key in entry.model_fields_set if getattr(entry, key) is not None}
        by_size = not said.isdisjoint(_DIMENSIONS)
        if by_size and not said.isdisjoint(_INERTIAS):
            raise self.faults.error(
                *place, problem='needs either mass, diametral_inertia and polar_inertia or '
                                'outer_diameter, width and density, got '
                                + ', '.join(sorted(said.intersection(_INERTIAS + _DIMENSIONS))))
        keys = _DIMENSIONS if by_size else _INERTIAS
        values = {key: getattr(entry, key) for key in keys}
        for key, value in values.items():
            if value is None:
                raise self.faults.error(*place, key, problem='is missing')
        with self.faults.at(*place, entry=entry):
            if by_size:
                return Disc.cylinder(entry.name, entry.position, **values)
            return Disc(entry.name, entry.position, **values)

    def _bearing(self, index: int, entry: BearingEntry) -> Bearing:
        place = ('rotor', 'bearings', index)
        foundation = self._foundation_of(place, entry)
        matrices = self._coefficients(place, entry)
        pedestal = None
        if entry.pedestal is not None:
            pedestal = self._pedestal((*place, 'pedestal'), entry.pedestal)
        with self.faults.at(*place, entry=entry):
            return Bearing(name=entry.name, position=entry.position, foundation=foundation,
                           pedestal=pedestal, seat=entry.seat, **matrices)

    def _coefficients(self, place: Place, entry: BearingEntry) -> dict[str, Any]:
        given = {key: value for key in ('stiffness', 'damping', 'inertia')
                 if (value := getattr(entry, key)) is not None}
        if entry.journal is not None:
            if given:
                raise self.faults.error(*place, problem='needs either journal or stiffness and '
                                                        f'damping, got journal and {min(given)}')
            # What a film is follows from what it carries, and that from the rotor.
            return {'stiffness': np.eye(2), 'damping': np.zeros((2, 2))}
        if entry.load is not None:
            raise self.faults.error(*place, 'load', problem='belongs to a journal, which is '
                                                            'missing')
        for missing in ('stiffness', 'damping'):
            if missing not in given:
                raise self.faults.error(*place, missing, problem='is missing')
        return {key: coefficients(self.faults, (*place, key), value)
                for key, value in given.items()}

    def _foundation_of(self, place: Place, entry: BearingEntry) -> str | None:
        blocks = self.faults.entries.foundations
        names = [block.name for block in blocks]
        if entry.foundation is not None and entry.foundation not in names:
            raise self.faults.error(*place, 'foundation', problem=(
                f'must be one of {", ".join(names)}, got {entry.foundation}' if names else
                f'names a block, of which there is none, got {entry.foundation}'))
        if entry.foundation is not None or not blocks:
            return entry.foundation
        if len(blocks) > 1:
            raise self.faults.error(*place, 'foundation', problem=(
                f'is missing; there are several: {", ".join(names)}'))
        return blocks[0].name

    def _pedestal(self, place: Place, entry: PedestalEntry) -> Pedestal:
        mass = entry.mass
        masses = (mass.xx, mass.zz) if isinstance(mass, MassPerAxis) else (mass, mass)
        with self.faults.at(*place, entry=entry):
            for value in masses:
                require(0.0 <= value < math.inf, 'mass', '>= 0 kg and finite', value)
            return Pedestal(mass=np.diag(masses), stiffness=constant(entry.stiffness),
                            damping=constant(entry.damping))


def _ends(left: float, right: float | None) -> tuple[float, float]:
    return left, left if right is None else right


@dataclass(frozen=True)
class Unbalances:
    """Adds up the unbalance of each disc and says at which key it was refused."""

    faults: Faults
    mass: float | None

    def couples(self) -> tuple[str, ...]:
        """Return the discs that have a couple, in the order of the rotor."""
        named = {entry.disc for entry in self.faults.entries.unbalances
                 if entry.couple is not None}
        return tuple(disc.name for disc in self.faults.entries.rotor.discs if disc.name in named)

    def total(self) -> ComplexArray | None:
        """Return moments of all discs [kg m], then of the couples [kg m^2], with their phase."""
        entries = self.faults.entries
        parts = self.faults.attempt_each(self._vector, entries.unbalances)
        if parts is None:
            return None
        discs, couples = [disc.name for disc in entries.rotor.discs], self.couples()
        total = np.zeros(len(discs) + len(couples), dtype=complex)
        for vector, entry in zip(parts, entries.unbalances, strict=True):
            total[discs.index(entry.disc)] += vector
            if entry.couple is not None:
                plane = len(discs) + couples.index(entry.disc)
                total[plane] += entry.couple * np.exp(1j * entry.couple_phase)
        return total

    def _vector(self, index: int, entry: schema.UnbalanceEntry) -> complex:
        discs = [disc.name for disc in self.faults.entries.rotor.discs]
        if entry.disc not in discs:
            raise self.faults.error('unbalances', index, 'disc', problem=(
                f'must be one of {", ".join(discs)}, got {entry.disc}' if discs else
                f'names a disc, of which there is none, got {entry.disc}'))
        return complex(self._moment(index, entry) * np.exp(1j * entry.phase))

    def _moment(self, index: int, entry: schema.UnbalanceEntry) -> float:
        place = ('unbalances', index)
        if entry.moment is not None and entry.grade is not None:
            raise self.faults.error(*place, problem='needs either moment or grade, got both')
        if entry.grade is None:
            for key in ('rated_speed_rpm', 'share'):
                if key in entry.model_fields_set:
                    raise self.faults.error(*place, key, problem='belongs to a grade, which is '
                                                                 'missing')
        if entry.grade is not None:
            return self._permissible(index, entry, entry.grade)
        if entry.moment is None and entry.couple is None:
            raise self.faults.error(*place, 'moment', problem='is missing, and so are grade and '
                                                              'couple')
        return 0.0 if entry.moment is None else entry.moment

    def _permissible(self, index: int, entry: schema.UnbalanceEntry, grade: float) -> float:
        """Return the disc's share of what the grade permits the whole rotor."""
        place = ('unbalances', index)
        rated = entry.rated_speed_rpm
        if rated is None:
            raise self.faults.error(*place, 'rated_speed_rpm', problem='is missing; a grade '
                                                                       'needs it')
        if not rated > 0.0:
            raise self.faults.error(*place, 'rated_speed_rpm',
                                    problem=f'must be > 0 rpm, got {rated:g}')
        if not 0.0 < entry.share <= 1.0:
            raise self.faults.error(*place, 'share', problem=f'must be in (0, 1], '
                                                             f'got {entry.share:g}')
        if self.mass is None:
            return 0.0  # never used: what is wrong with the rotor has been kept
        with self.faults.at(*place, entry=entry):
            return entry.share * permissible_unbalance(
                grade=grade, mass=self.mass, speed=rpm_to_rad_s(rated))
