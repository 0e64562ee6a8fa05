"""Which free vibrations unbalance strikes while the speed changes, and how strongly."""

from collections.abc import Iterator
from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray
from rotorsoil_ros.channel import across
from rotorsoil_ros.errors import NotSolvedError, OutOfTableError
from rotorsoil_ros.ground.rational import interpolants, RationalMatrix
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.stability import Stability

# Speeds at which the response is sampled, and how far beyond the range if it is known there:
# modes just outside are struck from inside.
_SAMPLES, _BEYOND = 300, (0.5, 1.2)

# A fit is finer than any table of responses; of so many nodes none has needed half.
_TOLERANCE, _MOST_NODES = 1e-6, 24

# One that misses more than this share of the largest response tells nothing of vibrations: tables
# over speed that are smooth piece by piece leave some thousandths.
_FAIR = 1e-2

# Vibrations in the range of speeds times these are struck in it ...
_STRUCK = (0.3, 1.5)
# ... and count from this share of the largest response on, and from so many times what is missed.
_COUNTS, _ABOVE_MISSED = 1e-4, 3.0

# So small a growth is round-off of a vibration without damping, which is given so little of it
# that its steady response is finite.
_UNDAMPED, _LEAST = 1e-7, 1e-12

# Columns that move so much less than the largest of their unit are round-off.
_STILL = 1e-9

# The frequency of modes lighter than this follows the speed, looked at so far to either side.
# Heavier ones are past before it could matter, and a fit of their own is not sharp.
LIGHT, _SIDE = 0.1, 0.005
# Samples about such a mode: out to so many half bandwidths, and to this share of its frequency.
_WIDTHS, _NEAR, _ABOUT = 30.0, 0.05, 30
# Its slope is that of a mode of a rotor; what is beyond belongs to another mode.
_SLOPES = (-3.0, 0.95)


@dataclass(frozen=True, slots=True, eq=False)
class Poles:
    """
    Free vibrations of a machine, as the response to its own unbalance tells them.

    Attributes
    ----------
    decay : (k,) complex array
        lambda of exp(lambda t), where it turns with the rotor [rad/s].
    slope : (k,) float array
        By which the frequency grows with the speed there [-]; 0 of heavily damped ones.
    strength : (k, p, w) complex array
        rho: what one of unit strength does to all motions and forces, per unit unbalance of
        each plane, times 1 - slope.
    missed : float
        Largest error of the fit over the largest response.
    doubt : str
        Why there are none; empty where they are known.

    """

    decay: ComplexArray
    slope: FloatArray
    strength: ComplexArray
    missed: float = 0.0
    doubt: str = ''

    @classmethod
    def none(cls, doubt: str) -> 'Poles':
        """Return no vibrations, and why."""
        return cls(np.zeros(0, dtype=complex), np.zeros(0), np.zeros((0, 0, 0), dtype=complex),
                   math.nan, doubt)

    def __len__(self) -> int:
        """Return the number of vibrations."""
        return len(self.decay)

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return everything as plain arrays."""
        return {'pole_decay': self.decay, 'pole_slope': self.slope,
                'pole_strength': self.strength, 'pole_missed': np.array(self.missed),
                'pole_doubt': np.array(self.doubt)}

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> 'Poles':
        """Rebuild from `to_arrays`."""
        return cls(arrays['pole_decay'], arrays['pole_slope'], arrays['pole_strength'],
                   float(arrays['pole_missed']), str(arrays['pole_doubt']))


def poles_of(
    model: CoupledModel, speed_range: tuple[float, float], growth: Stability, *,
    dense: FloatArray,
) -> Poles:
    """
    Return the free vibrations of a machine that running through a range of speeds strikes.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    speed_range : tuple of two floats
        Lowest and highest speed [rad/s].
    growth : Stability
        Where it grows: there is no response to learn from.
    dense : (n,) float array
        Speeds [rad/s] that crowd where it resonates.

    Notes
    -----
    All channels and planes share the denominator of the response H(Omega) = Y / Omega^2, so one
    rational fit gives H = sum R / (Omega - p) + const, with lambda = i p and
    rho = -i lambda^2 R (theory manual, passage). Any pole left out is treated quasi-statically.

    """
    planes, width = len(model.planes), len(model.groups)
    speed, response = sampled(model, speed_range, growth, dense=dense)
    if len(speed) <= 2 * _MOST_NODES:
        return Poles.none('there is no steady response to learn from')
    fitted = fit(speed, response.reshape(len(speed), -1), np.repeat(
        model.groups[None], planes, axis=0).ravel(), speed_range)
    if isinstance(fitted, str):
        return Poles.none(fitted)
    decay, strength, missed = fitted
    slope = np.array([_slope(model, each) for each in decay.tolist()])
    strength = strength.reshape(len(decay), planes, width)
    return Poles(decay, slope, (1.0 - slope)[:, None, None] * strength, missed)


def fit(
    speed: FloatArray, response: ComplexArray, groups: np.ndarray,
    speed_range: tuple[float, float],
) -> tuple[ComplexArray, ComplexArray, float] | str:
    """
    Return lambda (k,), rho (k, q) and what the fit misses; or why there is no sound one.

    Parameters
    ----------
    speed : (n,) float array
        Ascending [rad/s].
    response : (n, q) complex array
        Over the squared speed.
    groups : (q,) int array
        Kind of each column: same unit, same number.
    speed_range : tuple of two floats
        In which vibrations are struck [rad/s].

    """
    size = np.abs(response).max(axis=0)
    kinds = np.array([size[groups == kind].max() for kind in groups])
    moves = size > _STILL * kinds
    if not moves.any():
        return 'no unbalance moves it'
    scaled = response[:, moves] / size[moves]
    fits = interpolants(speed, scaled, scale=np.ones(scaled.shape),
                        most=min(_MOST_NODES, len(speed) // 2), tolerance=_TOLERANCE)
    # What a channel does at most, beside which a vibration counts.
    peak = np.abs(speed[:, None] ** 2 * scaled).max(axis=0)
    for missed, rational in sorted(fits, key=lambda each: each[0]):
        if not missed <= _FAIR:
            break
        found = _struck(rational, peak, missed, speed_range)
        if found is not None:
            decay, own = found
            strength = np.zeros((len(decay), len(moves)), dtype=complex)
            strength[:, moves] = own * size[moves]
            return decay, strength, missed
    return ('its response follows no law of free vibrations (noise in a table?): the best fit '
            f'misses {100.0 * min(worst for worst, _ in fits):.2g} %')


def _struck(
    rational: RationalMatrix, peak: FloatArray, missed: float, speed_range: tuple[float, float],
) -> tuple[ComplexArray, ComplexArray] | None:
    """Return lambda and rho of what is struck; None if any of it would grow."""
    poles, residues = rational.partial_fractions()
    decay, low, high = 1j * poles, *speed_range
    round_off = np.abs(decay.real) < _UNDAMPED * np.abs(decay)
    decay = np.where(round_off & (decay.real > -_LEAST * np.abs(decay)),
                     1j * decay.imag - _LEAST * np.abs(decay), decay)
    strength = -1j * (decay**2)[:, None] * residues
    share = (np.abs(strength) / peak).max(axis=1)
    near = (decay.imag > _STRUCK[0] * low) & (decay.imag < _STRUCK[1] * high)
    counts = near & (share > np.abs(decay.real) * max(_COUNTS, _ABOVE_MISSED * missed))
    inside = (decay.imag >= low) & (decay.imag <= high)
    if np.any(counts & inside & (decay.real > 0.0)):
        return None
    kept = np.flatnonzero(counts & (decay.real <= 0.0))
    kept = kept[np.argsort(decay.imag[kept])]
    return decay[kept], strength[kept]


def sampled(
    model: CoupledModel, speed_range: tuple[float, float], growth: Stability | None = None, *,
    dense: FloatArray,
) -> tuple[FloatArray, ComplexArray]:
    """
    Return speeds (n,) and the response over the squared speed, (n, planes, w).

    As `poles_of` takes them, and a little beyond the range where the machine is known there;
    nothing of a machine that nobody can solve.
    """
    low, high = speed_range
    for first, last in ((_BEYOND[0] * low, _BEYOND[1] * high), (low, high)):
        try:
            first, last = model.bearings.within_tables((first, last))
            even = np.linspace(first or last / _SAMPLES, last, _SAMPLES)
            speed = np.union1d(even, dense[(dense > 0.0) & (dense >= first) & (dense <= last)])
            if growth is not None:
                speed = speed[(speed > high) | growth.holds(speed)]
            displacement, force = model.synchronous_response(speed, model.plane_forces)
        except (OutOfTableError, NotSolvedError):
            continue
        rows = np.concatenate([displacement, force[:, model.transmits_force]], axis=1)
        return speed, rows.transpose(0, 2, 1)
    return np.zeros(0), np.zeros((0, len(model.planes), len(model.groups)), dtype=complex)


def _slope(model: CoupledModel, decay: complex) -> float:
    """Return by how much the frequency of a light mode grows per speed; 0 of a heavy one."""
    if not -decay.real < LIGHT * abs(decay) or not model.rotor.discs:
        return 0.0
    try:
        below, above = (list(_modes_near(model, decay, (1.0 + side) * decay.imag))
                        for side in (-_SIDE, _SIDE))
    except (OutOfTableError, NotSolvedError):
        return 0.0
    # The pair that lies evenly about what turns with the rotor.
    pairs = [(abs(one + other - 2.0 * decay), (other - one).imag / (2.0 * _SIDE * decay.imag))
             for one in below for other in above]
    slopes = [(apart, slope) for apart, slope in pairs if _SLOPES[0] < slope < _SLOPES[1]]
    return min(slopes, default=(0.0, 0.0))[1]


def _modes_near(model: CoupledModel, decay: complex, speed: float) -> Iterator[complex]:
    """Yield lambda of the modes near one while the rotor turns at a fixed speed."""
    half = max(-decay.real, 1e-6 * decay.imag)
    about = np.concatenate([half * np.geomspace(0.1, _WIDTHS, _ABOUT),
                            np.linspace(0.0, _NEAR * decay.imag, _ABOUT)])
    omega = np.unique(decay.imag + np.concatenate([-about, about]))
    omega = omega[omega > 0.0]
    discs = tuple(channel for disc in model.rotor.discs for channel in across(disc.name))
    rows = np.concatenate([
        model.frequency_response(omega, speed=speed, channel=disc)[discs].displacement
        for disc in discs], axis=1)
    size = np.abs(rows).max(axis=0)
    moves: BoolArray = size > _STILL * size.max()
    fits = interpolants(omega, rows[:, moves] / size[moves], scale=np.ones(
        (len(omega), int(moves.sum()))), most=_MOST_NODES, tolerance=_TOLERANCE**1.5)
    poles, _ = min(fits, key=lambda each: each[0])[1].partial_fractions()
    yield from (1j * poles[np.abs(poles - decay.imag) < _NEAR * decay.imag]).tolist()
