"""Where the journal floats between fixed pads."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.rotor.journal.film import Film, FilmForces
from rotorsoil_ros.rotor.journal.geometry import JournalBearing

# Rest of the balance of forces over the load.
_BALANCED = 1e-9

# Steps to balance, and how often each is halved: some four are needed.
_STEPS, _HALVINGS = 60, 30

# A step may not take more than this of the least film.
_TAKEN = 0.95

# Load from which a journal is pushed further down step by step, in mu Omega R^3 L / c^2, and by
# which factor each time.
_LIGHT, _RISE = 5.0, 3.0

# Where the search begins: eccentricity, and attitude in the sense of spin [rad].
_FIRST = 0.4, math.radians(50.0)

# Without pads at its sides a bearing has no stiffness there: such a direction is left alone.
NO_STIFFNESS = 1e-7


@dataclass(slots=True)
class FixedPads:
    """
    Finds where the film carries a load; each answer is where the next search begins.

    Attributes
    ----------
    bearing : JournalBearing
        Not one of tilting pads.

    """

    bearing: JournalBearing
    film: Film
    place: FloatArray | None = None
    wet: BoolArray | None = None
    moved: FloatArray | None = None

    @classmethod
    def of(cls, bearing: JournalBearing) -> 'FixedPads':
        """Return the search in a bearing."""
        return cls(bearing, Film(bearing.bore, bearing.slenderness, np.eye(2), bearing.cells))

    def settle(self, load: FloatArray) -> tuple[FloatArray, FilmForces]:
        """
        Return the displacement of the journal and its film under a load.

        Parameters
        ----------
        load : (2,) float array
            Force on the journal over (x, z) in mu Omega R^3 L / c^2.

        Raises
        ------
        NotSolvedError
            If no place is found at which the film carries it.

        """
        size = float(np.hypot(*load))
        if self.place is None:
            # A heavy load from nowhere would begin outside of the bore.
            begin = min(size, _LIGHT)
            self.place, self.wet = self._first(load), None
            count = math.ceil(math.log(size / begin, _RISE)) if size > begin else 0
            for share in np.geomspace(begin / size, 1.0, count + 1)[:-1]:
                self._balanced(share * load)
            return self._balanced(load)
        before, ahead = self.place, self.place + (0.0 if self.moved is None else self.moved)
        # Speeds of a table are alike apart: the journal moves on as it did.
        if self.film.least(ahead) > 0.5 * self.film.least(before):
            self.place = ahead
        found = self._balanced(load)
        self.moved = found[0] - before
        return found

    def _first(self, load: FloatArray) -> FloatArray:
        eccentricity, attitude = _FIRST
        angle = math.atan2(load[0], load[1]) + attitude
        place = eccentricity * np.array([math.sin(angle), math.cos(angle)])
        while self.film.least(place) < 0.2:
            place *= 0.5
        return place

    def _balanced(self, load: FloatArray) -> tuple[FloatArray, FilmForces]:
        assert self.place is not None
        found, self.wet = self.film.forces(self.place, self.wet)
        for _ in range(_STEPS):
            rest = found.force + load
            if np.hypot(*rest) <= _BALANCED * np.hypot(*load):
                return self.place, found
            step = np.asarray(np.linalg.lstsq(found.stiffness, rest, rcond=NO_STIFFNESS)[0])
            self.place, found, self.wet = self._better(self.place, step, found, load)
        raise NotSolvedError('no place of the journal balances its load')

    def _better(
        self, place: FloatArray, step: FloatArray, found: FilmForces, load: FloatArray,
    ) -> tuple[FloatArray, FilmForces, BoolArray]:
        """Return as much of a step as leaves the film open and brings the balance nearer."""
        rest = np.hypot(*(found.force + load))
        for halving in range(_HALVINGS):
            moved = place + 0.5**halving * step
            if self.film.least(moved) > (1.0 - _TAKEN) * found.least:
                answer, wet = self.film.forces(moved, self.wet)
                if np.hypot(*(answer.force + load)) < rest:
                    return moved, answer, wet
        raise NotSolvedError('no place of the journal balances its load')
