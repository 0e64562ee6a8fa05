"""Where the journal floats between pads that tilt, each until its film has no moment."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, cached_property
import math
from typing import TYPE_CHECKING

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.rotor.journal.film import Film, FilmForces
from rotorsoil_ros.rotor.journal.fixed import NO_STIFFNESS
from rotorsoil_ros.rotor.journal.geometry import JournalBearing

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# Displacement towards its pivot at which every pad carries, from there on down the stride in
# which the place is sought where it ceases to, and down to where it matters [clearances].
_SURE, _REACH, _FAR = 0.6, 0.25, -1.5

# Film at the pivot down to which a pad is known, and the share of the film beyond its onset [-].
_THINNEST, _NEAR = 0.01, 1e-3

# Distance of the places at which a pad is solved, in the logarithm of both of these.
_STRIDE = 0.2

# Tilts among which the first is sought, up to this share of closing the film.
_TILTS, _CLOSING = 24, 0.97

# Rest of the moment over force times radius, and steps until then: some three are needed.
_STILL, _STEPS = 1e-9, 30

_BALANCED, _HALVINGS = 1e-10, 40


@dataclass(frozen=True)
class TiltingPad:
    """
    One pad over the displacement of the journal towards its pivot, in clearances.

    Attributes
    ----------
    film : Film
        Of the pad, its pivot at the angle zero; directions are towards the pivot, and across.

    Notes
    -----
    Of a round journal a displacement across the line of the pivot is a tilt: the pad depends on
    one number. Its tilt is where the film has no moment about the pivot, followed from a place
    at which it carries for certain to where there is none any more: beyond it carries nothing.

    References
    ----------
    Lund (1964), ASLE Transactions 7: the pad assembly method.

    """

    film: Film

    @cached_property
    def _states(self) -> list[tuple[float, FilmForces]]:
        """Displacement towards the pivot and what acts there, rising."""
        ways = np.append(np.arange(self._way(_SURE), self._way(1.0 - _THINNEST), _STRIDE),
                         self._way(1.0 - _THINNEST))
        first = self._first_tilt(_SURE)
        near = self._followed(map(self._place, ways.tolist()), first)
        ways = np.arange(self._way(_SURE), math.log(_NEAR), -_STRIDE)[1:]
        return [*self._followed(map(self._place, ways.tolist()), first)[::-1], *near]

    @cached_property
    def _onset(self) -> float:
        """Displacement from which on the pad carries, within a share of the first stride."""
        carries, tilt, gone = _SURE, self._first_tilt(_SURE), _FAR
        wet: BoolArray | None = None
        place = carries
        while carries - gone > _NEAR:
            place = max(0.5 * (carries + gone), carries - _REACH) if gone > _FAR else (
                max(carries - _REACH, gone))
            try:
                tilt, _, wet = self._untilted(place, tilt, wet)
            except NotSolvedError:
                gone = place
            else:
                if place == _FAR:
                    break
                carries = place
        return gone

    def _way(self, place: float) -> float:
        """Return a measure of displacements in which the force is smooth to both of its ends."""
        return math.log((place - self._onset) / (1.0 - place))

    def _place(self, way: float) -> float:
        return self._onset + (1.0 - self._onset) / (1.0 + math.exp(-way))

    def _followed(
        self, places: Iterable[float], tilt: float,
    ) -> list[tuple[float, FilmForces]]:
        """Return the states at places in turn, as far as a tilt has no moment."""
        found: list[tuple[float, FilmForces]] = []
        wet: BoolArray | None = None
        for place in places:
            try:
                tilt, state, wet = self._untilted(place, tilt, wet)
            except NotSolvedError:
                break
            found.append((place, state))
        return found

    def _untilted(
        self, place: float, tilt: float, wet: BoolArray | None,
    ) -> tuple[float, FilmForces, BoolArray]:
        """Return the tilt without a moment near a given one, by Newton's method."""
        while self.film.least(np.array([place, tilt])) <= 0.0:
            tilt *= 0.9
        for _ in range(_STEPS):
            state, wet = self.film.forces(np.array([place, tilt]), wet)
            if not (state.force[0] < 0.0 < state.stiffness[1, 1]):
                break
            if abs(state.force[1]) <= -_STILL * state.force[0]:
                return tilt, state, wet
            step = state.force[1] / state.stiffness[1, 1]
            while self.film.least(np.array([place, tilt + step])) <= 0.2 * state.least:
                step *= 0.5
            tilt += float(step)
        raise NotSolvedError('no tilt of the pad is without a moment')

    def _first_tilt(self, place: float) -> float:
        """Return a tilt near which the film has no moment: the largest that there is."""
        closed = self._closing(place)
        tilts = np.linspace(0.0, _CLOSING * closed, _TILTS)
        moments = np.array([self.film.forces(np.array([place, tilt]))[0].force[1]
                            for tilt in tilts])
        turns = np.flatnonzero((moments[:-1] > 0.0) & (moments[1:] <= 0.0))
        if not len(turns):
            raise NotSolvedError('no tilt of the pad is without a moment')
        left = int(turns[-1])
        share = moments[left] / (moments[left] - moments[left + 1])
        return float(tilts[left] + share * (tilts[left + 1] - tilts[left]))

    def _closing(self, place: float) -> float:
        """Return the tilt that closes the film [clearances]."""
        low, high = 0.0, 1.0
        while self.film.least(np.array([place, high])) > 0.0:
            high *= 2.0
        while high - low > 1e-6 * high:
            middle = 0.5 * (low + high)
            is_open = self.film.least(np.array([place, middle])) > 0.0
            low, high = (middle, high) if is_open else (low, middle)
        return low

    @cached_property
    def reach(self) -> tuple[float, float]:
        """Displacements towards the pivot from which on, and up to which, it is known."""
        return self._states[0][0], self._states[-1][0]

    @cached_property
    def _curves(self) -> 'CubicSpline':
        """Of the way: ln force, coefficients with the film over it, least film over that."""
        from scipy.interpolate import CubicSpline

        films = np.array([1.0 - place for place, _ in self._states])
        columns = [np.log([-state.force[0] for _, state in self._states])]
        columns += [films * np.array([getattr(state, name)[row, column]
                                      for _, state in self._states]) / np.exp(columns[0])
                    for name in ('stiffness', 'damping') for row in (0, 1) for column in (0, 1)]
        columns.append(np.array([state.least for _, state in self._states]) / films)
        ways = [self._way(place) for place, _ in self._states]
        return CubicSpline(ways, np.stack(columns, axis=1))

    def at(self, place: float, whirl: float) -> tuple[float, complex, float]:
        """
        Return what the pad does to the journal.

        Parameters
        ----------
        place : float
            Displacement towards the pivot [clearances].
        whirl : float
            Frequency of the vibration over the speed; 0 is static [-].

        Returns
        -------
        force : float
            Away from the pivot [mu Omega R^3 L / c^2].
        stiffness : complex
            Dynamic, along the line of the pivot, the pad following without inertia.
        least : float
            Smallest film [clearances]; infinite where it carries nothing.

        """
        low, high = self.reach
        if place < low:
            return 0.0, 0.0, math.inf
        if place > high:
            raise NotSolvedError(f'the film at a pivot is thinner than {_THINNEST:g} clearances')
        film = 1.0 - place
        logarithm, *shares, least = self._curves(self._way(place)).tolist()
        force = math.exp(logarithm)
        k, c = (np.array(part) * force / film for part in (shares[:4], shares[4:]))
        along, across, back, tilt = (k + 1j * whirl * c).tolist()
        return force, along - across * back / tilt, film * least


@cache
def tilting_pad(bearing: JournalBearing) -> TiltingPad:
    """Return the pad of a bearing, which all bearings of its shape share."""
    directions = np.array([[0.0, 1.0], [1.0, 0.0]])
    return TiltingPad(Film((bearing.tilting,), bearing.slenderness, directions, bearing.cells))


@dataclass(slots=True)
class TiltingPads:
    """
    Finds where the pads carry a load; each answer is where the next search begins.

    Attributes
    ----------
    bearing : JournalBearing
        One of tilting pads.
    whirl : float
        Frequency of the vibration over the speed, for which the pads are reduced [-].

    """

    bearing: JournalBearing
    whirl: float = 1.0
    place: FloatArray | None = None

    def settle(self, load: FloatArray) -> tuple[FloatArray, FilmForces]:
        """Return the displacement of the journal and its film, as `FixedPads.settle`."""
        place = 0.3 * load / np.hypot(*load) if self.place is None else self.place
        for _ in range(_STEPS):
            found = self._assembled(place, 0.0)
            rest = found.force + load
            if np.hypot(*rest) <= _BALANCED * np.hypot(*load):
                self.place = place
                return place, self._assembled(place, self.whirl)
            step = np.asarray(np.linalg.lstsq(found.stiffness, rest, rcond=NO_STIFFNESS)[0])
            place = self._better(place, step, load)
        raise NotSolvedError('no place of the journal balances its load')

    def _better(self, place: FloatArray, step: FloatArray, load: FloatArray) -> FloatArray:
        rest = np.hypot(*(self._assembled(place, 0.0).force + load))
        thinnest = 1.0 - tilting_pad(self.bearing).reach[1]
        film = 1.0 - self._towards(place).max()
        for halving in range(_HALVINGS):
            moved = place + 0.5**halving * step
            if 1.0 - self._towards(moved).max() < max(0.1 * film, thinnest):
                continue
            if np.hypot(*(self._assembled(moved, 0.0).force + load)) < rest:
                return np.asarray(moved)
        raise NotSolvedError('no place of the journal balances its load')

    def _towards(self, place: FloatArray) -> FloatArray:
        """Return the displacement towards every pivot, (n,)."""
        return np.array([place[0] * math.sin(angle) + place[1] * math.cos(angle)
                         for angle in self.bearing.pivots])

    def _assembled(self, place: FloatArray, whirl: float) -> FilmForces:
        """Return what all pads do together."""
        pad, force, dynamic = tilting_pad(self.bearing), np.zeros(2), np.zeros((2, 2), complex)
        least = math.inf
        for angle, towards in zip(self.bearing.pivots, self._towards(place), strict=True):
            own, stiffness, film = pad.at(float(towards), whirl)
            normal = np.array([math.sin(angle), math.cos(angle)])
            force -= own * normal
            dynamic += stiffness * np.outer(normal, normal)
            least = min(least, film)
        damping = dynamic.imag / whirl if whirl else np.zeros((2, 2))
        return FilmForces(force, dynamic.real, damping, least)
