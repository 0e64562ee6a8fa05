"""Which journal bearings the entries of a case file describe, and what each carries."""

from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
import math
from pathlib import Path
from typing import Any

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.cache import Cache, content_key
from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.entries.bearing import JournalEntry, ViscosityTable
from rotorsoil_ros.case.entries.coefficients import require_speeds
from rotorsoil_ros.case.entries.entry import Place
from rotorsoil_ros.errors import require, RotorSoilError, solved
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.journal.geometry import JournalBearing
from rotorsoil_ros.rotor.journal.loads import sinking, static_loads
from rotorsoil_ros.rotor.journal.oil import Oil, Viscosity
from rotorsoil_ros.rotor.journal.states import (
    FILM_ALGORITHM,
    JournalStates,
    tabulated,
    THINNEST_FILM,
)
from rotorsoil_ros.units import rad_s_to_rpm, rpm_to_rad_s

# Share of the speed range that tables reach beyond it: margins and thresholds lie there.
BEYOND = 1.5

# Film below which surfaces touch, unless the case says which [m].
THINNEST = 10e-6

# Share of the mean weight on a bearing below which it carries none.
_UNLOADED = 1e-3

# Each is a table of its own: this many are a minute of computing.
_MOST_OILS = 16

# Which keys belong to which types only, and which of them have no default.
_OWN = {
    'groove_deg': ('plain',), 'arc_deg': ('axial_groove', 'elliptic', 'tilting_pad'),
    'preload': ('elliptic', 'tilting_pad'), 'pads': ('tilting_pad',),
    'pivot': ('tilting_pad',), 'load_on': ('tilting_pad',),
}
_NEEDED = {'elliptic': ('preload',), 'tilting_pad': ('pads', 'arc_deg')}


@dataclass(frozen=True)
class Journal:
    """
    A journal bearing of a case.

    Attributes
    ----------
    name : str
        Of the bearing.
    viscosity : Viscosity
        Of its oil.
    oil : Oil or None
        By grade and temperature, where the case says so.
    least_film : float
        Below which surfaces touch [m].
    states : JournalStates
        At the speeds of its tables.

    """

    name: str
    viscosity: Viscosity
    oil: Oil | None
    least_film: float
    states: JournalStates

    def at(self, speed: FloatArray) -> JournalStates:
        """
        Solve for its film at speeds (n,) [rad/s], exactly.

        Raises
        ------
        RotorSoilError
            If at some speed it is thinner than its mesh can tell.

        """
        with solved(f'the film of {self.name}'):
            found = JournalStates.at(self.states.bearing, self.viscosity, self.states.load, speed)
        thinnest = THINNEST_FILM * self.states.bearing.radial_clearance
        thin = np.flatnonzero(~(found.least >= thinnest))
        if len(thin):
            raise RotorSoilError(
                f'film of {self.name} must be at least {1e6 * thinnest:.3g} um thick, got '
                f'{1e6 * found.least[thin[0]]:.3g} um at '
                f'{rad_s_to_rpm(float(speed[thin[0]])):g} rpm')
        return found


@dataclass(frozen=True)
class BearingStates:
    """
    What a bearing is to the rotor at speeds (n,).

    Attributes
    ----------
    name : str
        Of the bearing.
    stiffness, damping, inertia : (n, 2, 2) float arrays
        To vibration of the speed's own frequency, over (x, z), force first [N/m], [N s/m], [kg].
    film : JournalStates or None
        Of a journal.

    """

    name: str
    stiffness: FloatArray
    damping: FloatArray
    inertia: FloatArray
    film: JournalStates | None


def bearing_states(
    rotor: Rotor, journals: tuple[Journal, ...], speed: FloatArray,
) -> tuple[BearingStates, ...]:
    """Return every bearing at speeds (n,) [rad/s]: films are solved, tables are looked up."""
    films = {journal.name: journal.at(speed) for journal in journals}
    return tuple(BearingStates(
        bearing.name, *(bearing.coefficients(speed, speed) if film is None else (
            film.stiffness, film.damping, np.zeros_like(film.damping))), film)
        for bearing in rotor.bearings for film in [films.get(bearing.name)])


@dataclass(frozen=True)
class JournalEntries:
    """
    Solves for the films of a rotor and says at which key one was refused.

    Attributes
    ----------
    faults : Faults
        Of the case.
    directory : Path
        Of the cache.
    solves : bool
        Whether films are solved; else only what is said of them is looked at.

    """

    faults: Faults
    directory: Path
    solves: bool = True

    def journals(
        self, rotor: Rotor, speed_range: tuple[float, float],
    ) -> tuple[Journal, ...] | None:
        """Return every journal with its tables, or None where one is at fault."""
        entries = self.faults.entries.rotor.bearings
        places = [index for index, entry in enumerate(entries) if entry.journal is not None]
        if not places:
            for index, entry in enumerate(entries):
                if entry.alignment:
                    self.faults.attempt(partial(self._refuse_alignment, index))
            return ()
        loads = self.faults.attempt(lambda: self._loads(rotor))
        if loads is None:
            return None
        before = len(self.faults.found)
        found = [self.faults.attempt(partial(self._journal, index, loads[index], speed_range))
                 for index in places]
        return None if len(self.faults.found) > before else tuple(filter(None, found))

    def oil_temperatures(self) -> tuple[float, ...]:
        """Return for which temperatures of the oil tables are wanted besides, rising."""
        rotor, place = self.faults.entries.rotor, ('rotor', 'oil_temperatures')
        wanted = rotor.oil_temperatures
        if wanted and not any(entry.journal is not None and entry.journal.oil is not None
                              for entry in rotor.bearings):
            raise self.faults.error(*place, problem='belongs to a rotor with a journal whose oil '
                                                    'is given by grade and temperature')
        if len(wanted) > _MOST_OILS:
            raise self.faults.error(*place, problem=f'must be at most {_MOST_OILS} temperatures '
                                                    f'in deg C, got {len(wanted)}')
        if any(not left < right for left, right in pairwise(wanted)):
            raise self.faults.error(*place, problem='must be rising temperatures in deg C, got '
                                                    f'{shown(wanted)}')
        return tuple(wanted)

    def _refuse_alignment(self, index: int) -> None:
        raise self.faults.error('rotor', 'bearings', index, 'alignment', problem=(
            'belongs to a rotor with a journal, of which there is none'))

    def _journal(
        self, index: int, load: FloatArray, speed_range: tuple[float, float],
    ) -> Journal | None:
        entry = self.faults.entries.rotor.bearings[index]
        assert entry.journal is not None
        place = ('rotor', 'bearings', index, 'journal')
        bearing = self._geometry(place, entry.journal)
        oil, viscosity = self._oil(place, entry.journal)
        least = THINNEST if entry.journal.least_film is None else entry.journal.least_film
        with self.faults.at(*place, entry=entry.journal):
            require(0.0 < least < math.inf, 'least_film', '> 0 m and finite', least)
            if not self.solves:
                return None
            with solved(f'the film of {entry.name}'):
                states = self._states(bearing, viscosity, load, speed_range)
        return Journal(entry.name, viscosity, oil, least, states)

    def _states(
        self, bearing: JournalBearing, viscosity: Viscosity, load: FloatArray,
        speed_range: tuple[float, float],
    ) -> JournalStates:
        """Return the film at the speeds of a table, out of the cache if it holds it."""
        span = speed_range[0], BEYOND * speed_range[1]
        key = content_key('journal', FILM_ALGORITHM, bearing, viscosity, load, span)
        stored = Cache(self.directory).load('journal', key)
        if stored is not None:
            return JournalStates(bearing, load, **stored)
        states = tabulated(bearing, viscosity, load, span)
        Cache(self.directory).store('journal', key, states.arrays)
        return states

    def _geometry(self, place: Place, entry: JournalEntry) -> JournalBearing:
        for key, owners in _OWN.items():
            if getattr(entry, key) is not None and entry.type not in owners:
                raise self.faults.error(*place, key, problem=(
                    f'belongs to the type {" or ".join(owners)}, got {entry.type}'))
        for key in _NEEDED.get(entry.type, ()):
            if getattr(entry, key) is None:
                raise self.faults.error(*place, key, problem='is missing; the type '
                                                             f'{entry.type} needs it')
        given: dict[str, Any] = {
            'preload': entry.preload, 'pads': entry.pads, 'pivot': entry.pivot,
            'arc': None if entry.arc_deg is None else math.radians(entry.arc_deg),
            'groove': None if entry.groove_deg is None else math.radians(entry.groove_deg),
            'on_pad': None if entry.load_on is None else entry.load_on == 'pad'}
        with self.faults.at(*place, entry=entry):
            return JournalBearing(
                kind=entry.type, diameter=entry.diameter, length=entry.length,
                radial_clearance=entry.radial_clearance,
                **{key: value for key, value in given.items() if value is not None})

    def _oil(
        self, place: Place, entry: JournalEntry,
    ) -> tuple[Oil | None, Viscosity]:
        if (entry.viscosity is None) is (entry.oil is None):
            both = 'neither is there' if entry.oil is None else 'got both'
            raise self.faults.error(*place, 'viscosity', problem='needs a value in Pa s, or oil '
                                                                 f'its grade; {both}')
        if entry.oil is not None:
            with self.faults.at(*place, 'oil', entry=entry.oil):
                oil = Oil(entry.oil.grade, entry.oil.temperature)
                return oil, Viscosity.of(oil)
        with self.faults.at(*place, entry=entry):
            if not isinstance(entry.viscosity, ViscosityTable):
                assert entry.viscosity is not None
                return None, Viscosity.constant(entry.viscosity)
            return None, self._over_speed((*place, 'viscosity'), entry.viscosity)

    def _over_speed(self, place: Place, entry: ViscosityTable) -> Viscosity:
        if len(entry.speed_rpm) != len(entry.viscosity):
            raise self.faults.error(*place, 'viscosity', problem=(
                f'must have as many entries as speed_rpm, {len(entry.speed_rpm)}, '
                f'got {len(entry.viscosity)}'))
        require_speeds(self.faults, (*place, 'speed_rpm'), entry.speed_rpm)
        with self.faults.at(*place, entry=entry):
            return Viscosity(rpm_to_rad_s(np.array(entry.speed_rpm)), np.array(entry.viscosity))

    def _loads(self, rotor: Rotor) -> list[FloatArray]:
        """Return the force on every journal over (x, z): given, or the weight it carries."""
        entries = self.faults.entries.rotor.bearings
        if all(entry.load is not None for entry in entries if entry.journal is not None):
            return [np.array(entry.load or (0.0, 0.0)) for entry in entries]
        for index, entry in enumerate(entries):
            if rotor.is_upright and entry.journal is not None and entry.load is None:
                raise self.faults.error('rotor', 'bearings', index, 'load', problem=(
                    'is missing, in N: a shaft that stands upright lays no weight on '
                    f'{entry.name}'))
        compliance = np.diag([
            sinking(bearing, on_film=entry.journal is not None)
            for bearing, entry in zip(rotor.bearings, entries, strict=True)])
        with self.faults.at('rotor'), solved('what each bearing carries'):
            reactions = static_loads(
                rotor, compliance=compliance,
                alignment=np.array([entry.alignment for entry in entries]))
        self._refuse_unloaded(reactions)
        return [np.array([0.0, -reaction] if entry.load is None else entry.load)
                for entry, reaction in zip(entries, reactions.tolist(), strict=True)]

    def _refuse_unloaded(self, reactions: FloatArray) -> None:
        """Raise an InputError for journals that the shaft pulls up or leaves alone."""
        least = _UNLOADED * float(reactions.sum()) / len(reactions)
        told = ', '.join(f'{entry.name} {reaction:.4g} N' for entry, reaction in zip(
            self.faults.entries.rotor.bearings, reactions.tolist(), strict=True))
        for index, (entry, reaction) in enumerate(zip(
                self.faults.entries.rotor.bearings, reactions.tolist(), strict=True)):
            if entry.journal is not None and entry.load is None and not reaction > least:
                raise self.faults.error('rotor', 'bearings', index, problem=(
                    f'bearing unloaded: {entry.name} must carry more than {least:.3g} N, got '
                    f'{reaction:.4g} N (upwards; {told}); alignment in m moves weight between '
                    'bearings, and load in N replaces it'))


def floated(rotor: Rotor, journals: tuple[Journal, ...]) -> Rotor:
    """Return the rotor on its films."""
    films = {journal.name: journal.states.tables for journal in journals}

    def on_film(bearing: Bearing) -> Bearing:
        stiffness, damping = films[bearing.name]
        return replace(bearing, stiffness=stiffness, damping=damping)

    return replace(rotor, bearings=tuple(
        on_film(bearing) if bearing.name in films else bearing for bearing in rotor.bearings))
