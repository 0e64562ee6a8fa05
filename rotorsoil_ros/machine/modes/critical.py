"""Which speeds are critical, and which distance from them a standard asks for."""

from dataclasses import dataclass
import itertools
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import NotSolvedError, RotorSoilError, solved
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.campbell import follow, unit_shapes
from rotorsoil_ros.machine.modes.spectrum import Spectrum, SpectrumSolver
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm

# Speeds at which the search for criticals begins, and up to how many it looks closer.
_FIRST_SPEEDS = 41
_MOST_SPEEDS = 400

# Modes that cross omega = Omega in the range lie below this many times its end.
_ABOVE = 1.1
_ALL = 10**6

# Modes of a rotor at rest in one plane; a train of five machines has fifteen.
_MOST_SLOW = 24

# A rotor that moves so much less than its blocks stays still.
_STILL = 1e-9

# Cosine from which a vibration is surely the one that was followed, as no two of them can be.
_SURELY = 0.9

# A critical speed is found to this share of itself, or what round-off leaves after so many steps.
_FOUND = 1e-12
_STEPS = 40

# Separation margins that API 617 asks at most of criticals below and above a running speed.
MARGIN_BELOW, MARGIN_ABOVE = 0.16, 0.26

# Beyond the largest margin by so much: a critical speed just at it is still found.
_MARGIN_ROUND_OFF = 1e-6


@dataclass(frozen=True)
class CriticalSpeed:
    """
    Speed that excites a mode with its own frequency.

    Attributes
    ----------
    speed : float
        omega = Omega [rad/s].
    whirl : int
        +1 where its own rotor whirls forward, which unbalance excites; -1 backward.
    damping_ratio : float
        Of the mode [-].
    deflection : (k, 2) complex array
        Its shape over (x, z) of the rotor's nodes, the largest amplitude of any rotor being one;
        where all stay still, that of the support is.
    slope : (k, 2) complex array
        Of the shaft in the same shape, in the planes of x and z.
    support : (s,) complex array
        Motion of the support in the same shape, over (x, y, z, rx, ry, rz) of each block, then
        the deflections of pedestals.
    beside : tuple of two (k, 2) complex arrays
        Deflection and slope of each neighbour's rotor in the same shape.
    owner : int
        Number of the neighbour, from 1 in the order of all machines, whose rotor has most of the
        kinetic energy; 0 where none has.

    """

    speed: float
    whirl: int
    damping_ratio: float
    deflection: ComplexArray
    slope: ComplexArray
    support: ComplexArray
    beside: tuple[tuple[ComplexArray, ComplexArray], ...] = ()
    owner: int = 0

    @property
    def speed_rpm(self) -> float:
        """Where omega = Omega [rpm]."""
        return rad_s_to_rpm(self.speed)

    @property
    def amplification_factor(self) -> float:
        """Return 1 / (2 zeta) [-]; infinite without damping, or with less."""
        return 0.5 / self.damping_ratio if self.damping_ratio > 0.0 else math.inf

    def separation_margin(self, running: float) -> float:
        """Return the distance from a running speed [rad/s], as a share of that speed."""
        return abs(self.speed - running) / running

    def required_margin(self, running: float, *, half_power: float = math.nan) -> float:
        """
        Return the separation margin that a running speed needs.

        Parameters
        ----------
        running : float
            Speed [rad/s].
        half_power : float
            Amplification factor by the response, as `half_power_factors` has it; of it and
            that by the damping ratio the larger counts.

        References
        ----------
        The rule of API 617 (7th ed.), as API RP 684 (2nd ed.), SP6.8.2.10, explains it: none
        below an amplification factor AF of 2.5; for a critical speed below the running speed
        17 (1 - 1 / (AF - 1.5)) or 16 percent, for one above 10 + 17 (1 - 1 / (AF - 1.5)) or 26
        percent, whichever is less.

        """
        factor = float(np.fmax(self.amplification_factor, half_power))
        if factor < 2.5:
            return 0.0
        margin = min(0.17 * (1.0 - 1.0 / (factor - 1.5)), MARGIN_BELOW)
        return margin + (MARGIN_ABOVE - MARGIN_BELOW if self.speed > running else 0.0)


def asked(running: float) -> tuple[float, float]:
    """Return between which speeds [rad/s] a margin from a running speed can be missed."""
    return ((1.0 - MARGIN_BELOW - _MARGIN_ROUND_OFF) * running,
            (1.0 + MARGIN_ABOVE + _MARGIN_ROUND_OFF) * running)


@solved('the modes of this machine')
def critical_speeds(
    model: CoupledModel, speed_range: tuple[float, float],
) -> tuple[CriticalSpeed, ...]:
    """
    Find the speeds at which a mode's damped frequency is the speed itself.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    speed_range : tuple of two floats
        Lowest and highest speed [rad/s].

    Returns
    -------
    tuple of CriticalSpeed
        Rising; roots of omega(Omega) - Omega on every followed mode, not points of a grid.

    Raises
    ------
    NotSolvedError
        If modes cannot be told apart, or a light one is not determined by what is known of the
        support: a critical speed would be missing.

    """
    low, high = speed_range
    if not 0.0 <= low < high < math.inf:
        raise RotorSoilError(f'speed range must be 0 <= low < high in rad/s, got {low:g} to '
                             f'{high:g}')
    solver = SpectrumSolver.up_to(model, _ABOVE * high, following=True)
    # What there is to be solved for grows with the cube of them.
    if solver.shafts.own.slow(high) > _MOST_SLOW:
        raise NotSolvedError(
            f'the rotor bends in more than {_MOST_SLOW} ways below {rad_s_to_rpm(high):g} rpm, '
            'more than can be told apart: is it so soft?')
    speed = np.linspace(low, high, _FIRST_SPEEDS)
    while True:
        solver, found = solver.refined(speed, _ALL)
        branch = follow(found)
        closer = np.setdiff1d(np.concatenate([
            _touching(speed, found, branch), _torn(speed, found, branch)]), speed)
        if not len(closer) or len(speed) > _MOST_SPEEDS:
            break
        speed = np.union1d(speed, closer)
    lost = float(found.untold.min())
    if lost <= high:
        raise NotSolvedError(
            f'the compliance of the support changes too abruptly about {rad_s_to_hz(lost):.4g} '
            'Hz to tell a lightly damped mode there')
    criticals = _close(solver, *_crossings(speed, found, branch))
    return tuple(sorted(criticals, key=lambda critical: critical.speed))


def _touching(speed: FloatArray, found: Spectrum, branch: IntArray) -> FloatArray:
    """Return speeds where a curve that seems to miss omega = Omega may still touch it."""
    closer = []
    for name in range(branch.max(initial=-1) + 1):
        row, mode = np.nonzero(branch == name)
        place, excess = speed[row], found.frequency[row, mode].real - speed[row]
        for i in range(1, len(row) - 1):
            near, before, after = excess[i], excess[i - 1], excess[i + 1]
            if min(before / near, after / near, 2.0) <= 1.0:
                continue
            square, slope, _ = np.polyfit(place[i - 1:i + 2] - place[i], excess[i - 1:i + 2], 2)
            if slope**2 > 4.0 * square * near:
                closer.append(place[i] - 0.5 * slope / square)
    return np.array(closer)


def _torn(speed: FloatArray, found: Spectrum, branch: IntArray) -> FloatArray:
    """Return speeds between which a curve ends and another begins that may be its end."""
    closer = []
    low = found.frequency.real < _ABOVE**0.5 * speed[-1]
    for i, (before, after) in enumerate(itertools.pairwise(branch)):
        ends = np.setdiff1d(before[low[i]], after)
        starts = np.setdiff1d(after[low[i + 1]], before)
        if np.any(ends >= 0) and np.any(starts >= 0):
            closer.append(0.5 * (speed[i] + speed[i + 1]))
    return np.array(closer)


def _crossings(
    speed: FloatArray, found: Spectrum, branch: IntArray,
) -> tuple[FloatArray, ComplexArray, ComplexArray]:
    """Return speeds (c, 2), frequencies (c, 2) and shapes (c, 2, d) around each crossing."""
    rows, modes = [], []
    for name in range(branch.max(initial=-1) + 1):
        row, mode = np.nonzero(branch == name)
        above = found.frequency[row, mode].real > speed[row]
        for i in np.flatnonzero(above[:-1] != above[1:]):
            rows.append(row[i:i + 2])
            modes.append(mode[i:i + 2])
    at, which = (np.array(pairs, dtype=int).reshape(-1, 2) for pairs in (rows, modes))
    return speed[at], found.frequency[at, which], found.shape[at, which]


def _close(
    solver: SpectrumSolver, ends: FloatArray, frequency: ComplexArray, shapes: ComplexArray,
) -> list[CriticalSpeed]:
    """Close all brackets at once by the false position, in its Illinois variant."""
    if not len(ends):
        return []
    wanted, last = unit_shapes(shapes).conj().transpose(0, 2, 1), np.full(len(ends), -1)
    edges, excess = ends.copy(), frequency.real - ends
    closed: dict[int, CriticalSpeed] = {}
    still = np.arange(len(ends))
    for step in range(_STEPS):
        low, high = ends[still].T
        before, after = excess[still].T
        speed = (low * after - high * before) / (after - before)
        share = (speed - edges[still, 0]) / (edges[still, 1] - edges[still, 0])
        between = (1.0 - share) * frequency[still, 0] + share * frequency[still, 1]
        found, mode = _most_like(solver, speed, between, wanted[still])
        height = found.frequency[np.arange(len(still)), mode].real - speed
        # A bracket that has shrunk to a jump from one mode to another holds no crossing to find.
        done = ((np.abs(height) <= _FOUND * speed) | (np.abs(high - low) <= _FOUND * speed)
                | (step == _STEPS - 1))
        for row in np.flatnonzero(done).tolist():
            closed[int(still[row])] = _critical(
                solver, found, float(speed[row]), row, int(mode[row]))
        side = np.where((height > 0.0) == (before > 0.0), 0, 1)
        excess[still, 1 - side] *= np.where(side == last[still], 0.5, 1.0)
        ends[still, side], excess[still, side], last[still] = speed, height, side
        still = still[~done]
        if not len(still):
            break
    return [closed[row] for row in sorted(closed)]


def _most_like(
    solver: SpectrumSolver, speed: FloatArray, near: ComplexArray, wanted: ComplexArray,
) -> tuple[Spectrum, IntArray]:
    """Return vibrations at speeds (n,), and which of them are most like shapes (n, d, 2)."""
    found, sound = solver.nearest(speed, near)
    alike = np.abs(unit_shapes(found.shape) @ wanted)[:, 0].max(axis=1)
    if np.all(sound & (alike > _SURELY)):
        return found, np.zeros(len(speed), dtype=int)
    found = solver.solve(speed, _ALL)
    # Of all modes at a speed the one most like those at both ends.
    return found, np.nansum(np.abs(unit_shapes(found.shape) @ wanted), axis=2).argmax(axis=1)


def _critical(
    solver: SpectrumSolver, found: Spectrum, speed: float, row: int, mode: int,
) -> CriticalSpeed:
    frequency, support = found.frequency[row, mode], found.support[row, mode]
    rotor, shafts = found.rotor[row, mode], solver.shafts
    own = shafts.each.index(shafts.own)
    forward, backward = shafts.kinetic(rotor[:, None])[:, own]
    shapes = list(shafts.bent(rotor))
    largest = max(np.abs(deflection).max() for deflection, _ in shapes)
    if not largest > _STILL * np.abs(support).max(initial=0.0):
        largest = np.abs(support).max()
    scaled = [(deflection / largest, slope / largest) for deflection, slope in shapes]
    deflection, slope = scaled.pop(own)
    return CriticalSpeed(speed, 1 if forward >= backward else -1,
                         float(frequency.imag / np.abs(frequency)), deflection, slope,
                         support / largest, tuple(scaled), int(found.owner[row, mode]))
