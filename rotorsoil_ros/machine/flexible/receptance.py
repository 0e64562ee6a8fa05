"""A foundation and its ground, known only by how the seats of the bearings answer forces."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self, TYPE_CHECKING

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, inside
from rotorsoil_ros.channel import ACROSS, Channel
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.continuation import Laws, OTHER_RANGE, typical_size
from rotorsoil_ros.ground.rational import interpolants, RationalMatrix, States
from rotorsoil_ros.units import rad_s_to_hz

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

# A table follows one law if a rational function misses no row, of its row's size, by more than
# this, the rows being so many times more numbers than the function has: those of a computation
# do, those of a test do not.
LAWFUL = 1e-4
_OVERDETERMINED = 3
# A law that misses more, as of a table of few digits, tells the response but no vibration.
TELLS_MODES = 1e-6
_MOST_NODES = 120
_ROUNDING = 1e-12
# What rounding of a printed table leaves need not be followed: so many times the least error.
_NEAR_LEAST = 3.0

# Vibrations that move the seats by less than so many times what is missed are made by rounding; a
# second shape at one frequency, where a simple pole has one, by less than the second.
_FIRST_SHAPE, _SECOND_SHAPE = 100.0, 3e3

# What one entry may differ from its mirror image, and how much energy a row may give, of its size:
# 2 % of noise make 4 and 0.8 %. Beyond is a slip of a sign, a column or a unit.
LARGEST_SKEW, MOST_GIVEN = 0.2, 0.05
# Below, it is round-off and not worth a word.
NOT_WORTH_A_WORD = 1e-9

# Rows that a peak needs over its width at half its power for a curve through them to show it.
ROWS_OF_A_PEAK = 4
# A peak is one if it stands out of both sides by half its power.
_HALF = 0.5**0.5
# What such a peak changes from one such row to the next, of its height, and a little.
_SMOOTH = 0.6

# Places between two rows at which the law must take energy.
_BETWEEN = 8


@dataclass(frozen=True, eq=False)
class SeatReceptance:
    """
    Motion of seats per force on them over frequency, of whatever they stand on.

    Attributes
    ----------
    seats : tuple of Channel
        The motions, x and z of each bearing.
    omega : (n,) float array
        Frequencies, rising [rad/s].
    values : (n, d, d) complex array
        Receptance, symmetric, that gives no energy [m/N].
    law : RationalMatrix or None
        What all rows follow; None of measured ones, through which a curve leads.
    poles : Laws or None
        The same by vibrations that decay; None where the rows are too rough to tell these.
    missed : float
        What the law misses of a row, or the noise of a measured one, of its size.
    skew, given : float
        Largest difference of mirror images, and energy that a row gave, before they were taken
        out, of its size.
    apart : int
        Pairs of seats of which nobody said whether they move each other.

    """

    seats: tuple[Channel, ...]
    omega: FloatArray
    values: ComplexArray
    law: RationalMatrix | None
    poles: Laws | None
    missed: float
    skew: float
    given: float
    apart: int

    @classmethod
    def of(
        cls, seats: Sequence[Channel], omega: FloatArray, values: ComplexArray, *, apart: int = 0,
    ) -> Self:
        """
        Return what a table says.

        Parameters
        ----------
        seats, omega, values, apart
            As the attributes; values need not be symmetric.

        Raises
        ------
        RotorSoilError
            If it is no receptance of anything passive, or changes faster than its rows tell.

        """
        size = typical_size(values)
        unit = size[:, None] * size
        level = np.abs(values / unit).max(axis=(1, 2))
        if not np.all(level > 0.0):
            raise RotorSoilError('some seat must move at every frequency, got zeros at '
                                 f'{_hertz(float(omega[level.argmin()]))}')
        skew = np.abs(values - values.swapaxes(1, 2)) / unit / level[:, None, None]
        if not skew.max() <= LARGEST_SKEW:
            row, i, j = np.unravel_index(skew.argmax(), skew.shape)
            one, other = (f'{seats[a]}__{seats[b]}' for a, b in ((i, j), (j, i)))
            raise RotorSoilError(
                f'{one} and {other} must be alike, got {values[row, i, j]:.4g} and '
                f'{values[row, j, i]:.4g} m/N at {_hertz(float(omega[row]))}, '
                f'{skew.max():.0%} of the row apart, more than {LARGEST_SKEW:.0%}: has a column '
                'been swapped, or a sign been lost?')
        values = 0.5 * (values + values.swapaxes(1, 2))
        given = _given(values, unit, level)
        if not given.max() <= MOST_GIVEN:
            row = int(given.argmax())
            raise RotorSoilError(
                f'the foundation must not give energy (-Im H positive semidefinite), got '
                f'{given[row]:.0%} of the row at {_hertz(omega[row])}, more than '
                f'{MOST_GIVEN:.0%}: has a sign been lost, or is it of exp(-i omega t)?')
        law, missed = _law(omega, values / unit, level)
        found = cls(tuple(seats), omega, values, law.over(1.0 / size), None, missed,
                    float(skew.max()), float(given.max()), apart)
        return found._lawful(law, size, level) or found._measured(unit, level)

    def _lawful(self, law: RationalMatrix, size: FloatArray, level: FloatArray) -> Self | None:
        """Return the table by its vibrations; None where its rows follow no law over its size."""
        if self.missed > LAWFUL:
            return None
        unit = size[:, None] * size
        found = replace(self, poles=self._laws(law, size, level)
                        if self.missed <= TELLS_MODES else None)
        share = np.arange(_BETWEEN) / _BETWEEN
        between = (self.omega[:-1, None] + np.diff(self.omega)[:, None] * share).ravel()
        levels = np.interp(between, self.omega, level)
        given = _given(found.compliance(between), unit, levels)
        return found if given.max() <= max(LAWFUL, 2.0 * self.given) else None

    def _laws(self, law: RationalMatrix, size: FloatArray, level: FloatArray) -> Laws:
        """Return what the rows follow, and what some of them do."""
        count, missed = len(self.omega), max(self.missed, _ROUNDING)
        rows, part = np.arange(count), OTHER_RANGE * (self.omega[-1] - self.omega[0])
        fits = [_law(self.omega[own], self.values[own] / (size[:, None] * size), level[own])[0]
                for own in (rows[rows % 4 != 2], rows[self.omega <= self.omega[-1] - part],
                            rows[self.omega >= self.omega[0] + part])]
        found = [_poles(fit, missed).over(1.0 / size) for fit in (law, *fits)]
        return Laws(*found)

    def _measured(self, unit: FloatArray, level: FloatArray) -> Self:
        """
        Return the table for a curve through its rows.

        Raises
        ------
        RotorSoilError
            If a peak is too narrow for it.

        """
        total = np.linalg.norm(self.values / unit, axis=(1, 2))
        for row, left, right in _peaks(self.omega, total):
            step = float(np.diff(self.omega)[max(row - 1, 0):row + 1].max())
            if not step <= (right - left) / ROWS_OF_A_PEAK:
                raise RotorSoilError(
                    f'must be a computed one, which follows one law (this one is off by up to '
                    f'{self.missed:.2g} of a row), or have rows at most a quarter of '
                    f'the width of a peak apart: that at {_hertz(self.omega[row])} is at most '
                    f'{_hertz(right - left)} wide at half its power, and its rows are '
                    f'{_hertz(step)} apart: measure it in steps of '
                    f'{_hertz((right - left) / ROWS_OF_A_PEAK)} or finer, or fit modes to it and '
                    'give these (foundations, flexible, modes)')
        jump = np.linalg.norm(np.diff(self.values / unit, axis=0), axis=(1, 2)) / np.maximum(
            total[1:], total[:-1])
        if not jump.max() <= _SMOOTH:
            row = int(jump.argmax())
            raise RotorSoilError(
                f'must have more rows: from {_hertz(self.omega[row])} to the next at '
                f'{_hertz(self.omega[row + 1])} it changes by {jump[row]:.0%} of itself, more '
                f'than {_SMOOTH:.0%}, and no law that all rows follow leads over that')
        values, vectors = np.linalg.eigh(self.values.imag / unit)
        passive = (vectors * np.minimum(values, 0.0)[:, None]) @ vectors.swapaxes(1, 2) * unit
        passive = 0.5 * (passive + passive.swapaxes(1, 2))
        return replace(self, values=self.values.real + 1j * passive, law=None,
                       missed=_noise(self.values / unit, level))

    @cached_property
    def _curve(self) -> 'CubicSpline':
        from scipy.interpolate import CubicSpline  # as slow to import as half of a start

        return CubicSpline(self.omega, self.values)

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """
        Return the receptance at real frequencies (n,) [rad/s], (n, d, d) [m/N].

        Raises
        ------
        OutOfTableError
            If a frequency lies outside the table.

        """
        omega = inside(omega, (float(self.omega[0]), float(self.omega[-1])), name='frequency',
                       unit='rad/s', where='the range of the receptances of the seats')
        if self.law is None:
            found: ComplexArray = self._curve(omega)
            return found
        return self.law(omega.astype(complex))

    def rows_of(self, seat: str) -> list[int]:
        """
        Return which motions are x and z of a seat.

        Raises
        ------
        RotorSoilError
            If it has none.

        """
        wanted = [Channel(seat, '', axis) for axis in ACROSS]
        for one in wanted:
            if one not in self.seats:
                raise RotorSoilError(f'receptances of seats must hold {one}, got '
                                     f'{", ".join(map(str, self.seats))}')
        return [self.seats.index(one) for one in wanted]


def _law(
    omega: FloatArray, values: ComplexArray, level: FloatArray,
) -> tuple[RationalMatrix, float]:
    """Return what of few nodes meets rows (n, d, d) of a level (n,) best, and its error."""
    upper = np.triu_indices(values.shape[-1])
    entries = values[:, upper[0], upper[1]]
    entries = entries[:, entries.any(axis=0)]
    rows, count = entries.shape
    # Weights of m nodes against the numbers of the other rows.
    most = min(_MOST_NODES, count * rows // (count + _OVERDETERMINED), rows - 2)
    fits = interpolants(omega, entries, scale=np.repeat(level[:, None], count, axis=1),
                        most=max(most, 1), tolerance=_ROUNDING)
    enough = max(_ROUNDING, _NEAR_LEAST * min(missed for missed, _ in fits))
    missed, fit = next(pair for pair in fits if pair[0] <= enough)
    return replace(fit, values=values[np.searchsorted(omega, fit.nodes)]), missed


def _poles(fit: RationalMatrix, missed: float) -> States:
    """Return a rational function that misses so much by its poles."""
    found = fit.states(_FIRST_SHAPE * missed)
    is_first = np.diff(found.poles, prepend=np.nan) != 0.0
    return found.of(is_first | (
        found.height > _SECOND_SHAPE * missed * np.abs(found.poles.imag)))


def _given(values: ComplexArray, unit: FloatArray, level: FloatArray) -> FloatArray:
    """Return how much energy symmetric receptances (n, d, d) give, of their size, (n,)."""
    return np.asarray(np.maximum(np.linalg.eigvalsh(values.imag / unit)[:, -1], 0.0) / level)


def _peaks(omega: FloatArray, level: FloatArray) -> list[tuple[int, float, float]]:
    """Return rows of peaks, and where each has fallen to half its power on both sides."""
    found = []
    for row in range(1, len(level) - 1):
        if not level[row] >= max(level[row - 1], level[row + 1]):
            continue
        ends = []
        for side in (-1, 1):
            place = row
            while 0 <= place + side < len(level) and level[row] >= level[place] > (
                    _HALF * level[row]):
                place += side
            if level[place] > _HALF * level[row]:
                break  # a higher one comes first, or the table ends
            inner = place - side
            share = (level[inner] - _HALF * level[row]) / (level[inner] - level[place])
            ends.append(float(omega[inner] + share * (omega[place] - omega[inner])))
        if len(ends) == 2:
            found.append((row, ends[0], ends[1]))
    return found


def _noise(values: ComplexArray, level: FloatArray) -> float:
    """Return the noise of rows (n, d, d), of their size: what fourth differences leave."""
    if len(values) < 5:
        return 0.0
    left = values[:-4] - 4.0 * values[1:-3] + 6.0 * values[2:-2] - 4.0 * values[3:-1] + values[4:]
    # Of independent errors the squares of the coefficients are 70 together.
    return float(np.median(np.abs(left).max(axis=(1, 2)) / level[2:-2]) / 70.0**0.5)


def _hertz(omega: float) -> str:
    return f'{rad_s_to_hz(omega):.4g} Hz'
