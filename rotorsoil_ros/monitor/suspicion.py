"""Does what was measured look like another unit or phase? Where the data says so, it is said."""

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.compared import Reason, Weighed

# From vectors and their omega to what they would be, had this not happened to them.
UNDO: dict[str, Callable[[ComplexArray, FloatArray], ComplexArray]] = {
    'velocities for displacements': lambda measured, omega: measured / omega,
    'accelerations for displacements': lambda measured, omega: measured / omega**2,
    'displacements for velocities': lambda measured, omega: measured * omega,
    'displacements for accelerations': lambda measured, omega: measured * omega**2,
    'lag for lead': lambda measured, omega: np.conj(measured)}
LAG = 'lag for lead'
SAID = {
    'velocities for displacements': 'amplitudes look like mm/s: velocities were taken for '
                                    'displacements',
    'accelerations for displacements': 'amplitudes look like m/s^2: accelerations were taken for '
                                       'displacements',
    'displacements for velocities': 'amplitudes look like um: displacements were taken for '
                                    'velocities',
    'displacements for accelerations': 'amplitudes look like um: displacements were taken for '
                                       'accelerations',
    LAG: 'phase looks reversed (lag given as lead)'}

FEWEST_POINTS = 8
SPREAD = 1.2  # of the speeds, fastest over slowest, below which units cannot be told apart
# A run is suspected if as it is more than this share of it is not of the shape that is predicted,
# and what is left, were the slip undone, is far less and little.
LEFT_AS_IS, LEFT_SHARE, LEFT_UNDONE = 0.02, 1.0 / 3.0, 0.1
# Of a sharp peak a unit changes the shape by little, but the size by a factor: both are asked.
LEFT_OF_UNIT, OFF_BY = 0.004, 2.0
# Zero-to-peak: no bearing moves as far, whatever is wrong with a machine.
LARGEST_MOTION, FAR_BEYOND = 0.01, 100.0


@dataclass
class Sums:
    """What is known of one channel, with phases or without: sums over its points."""

    count: int = 0
    slowest: float = math.inf
    fastest: float = 0.0
    size: float = 0.0
    expected: float = 0.0
    predicted: float = 0.0  # power
    power: dict[str, float] = field(default_factory=lambda: defaultdict(float))
    cross: dict[str, complex] = field(default_factory=lambda: defaultdict(complex))

    def add(self, measured: ComplexArray, predicted: ComplexArray, omega: FloatArray) -> None:
        """Add points, (n,)."""
        self.count += len(omega)
        self.slowest = min(self.slowest, float(omega.min()))
        self.fastest = max(self.fastest, float(omega.max()))
        self.size += float(np.abs(measured).sum())
        self.expected += float(np.abs(predicted).sum())
        self.predicted += float(np.vdot(predicted, predicted).real)
        for name, undone in (('', measured), *(
                (name, undo(measured, omega)) for name, undo in UNDO.items())):
            self.power[name] += float(np.vdot(undone, undone).real)
            self.cross[name] += complex(np.vdot(predicted, undone))

    def left(self, name: str) -> float:
        """Return the share of the power that is not of the predicted shape, at any scale."""
        whole = self.predicted * self.power[name]
        return 1.0 - abs(self.cross[name]) ** 2 / whole if whole > 0.0 else math.nan


class Suspicion:
    """
    Whether the points of a run would fit their prediction, had a slip not happened.

    A point counts as it does for the verdict. What is asked is the shape over the speed, at any
    scale and any constant angle: how large the unbalance is, nobody knows before.
    """

    def __init__(self) -> None:
        self._sums: dict[tuple[Channel, bool], Sums] = defaultdict(Sums)

    def see(self, weighed: Weighed) -> None:
        """Take in points."""
        compared = weighed.compared
        for column, channel in enumerate(compared.channels):
            size, phase = compared.amplitude[:, column], compared.phase[:, column]
            predicted = compared.predicted[:, column]
            used = (weighed.reason[:, column] == Reason.USED) & (compared.speed > 0.0)
            for has_phase in (True, False):
                rows = used & (np.isfinite(phase) == has_phase)
                if rows.any():
                    turn = np.exp(1j * phase[rows]) if has_phase else 1.0
                    self._sums[channel, has_phase].add(
                        np.asarray(size[rows] * turn, dtype=complex),
                        predicted[rows] if has_phase else np.abs(predicted[rows]).astype(complex),
                        compared.speed[rows])

    @property
    def is_of_unit(self) -> bool:
        """Whether amplitudes are doubted, and not phases alone."""
        return self.said not in ('', SAID[LAG])

    @property
    def said(self) -> str:
        """What the run looks like, in one line; nothing where it looks like what it is."""
        return self._too_large() or self._misshapen()

    def _too_large(self) -> str:
        for (channel, _), sums in self._sums.items():
            mean = sums.size / sums.count
            if (sums.count >= FEWEST_POINTS and not channel.is_rotation
                    and mean > LARGEST_MOTION and sums.size > FAR_BEYOND * sums.expected):
                return (f'amplitudes look like another unit: {channel} would move {mean:.3g} m, '
                        f'predicted are {sums.expected / sums.count:.3g} m')
        return ''

    def _misshapen(self) -> str:
        known = [sums for sums in self._sums.values()
                 if sums.count >= FEWEST_POINTS and sums.fastest > SPREAD * sums.slowest
                 and sums.predicted > 0.0 and sums.power[''] > 0.0]
        weight = sum(sums.count for sums in known)
        if not weight:
            return ''
        left = {name: sum(sums.count * sums.left(name) for sums in known) / weight
                for name in ('', *UNDO)}
        best = min(UNDO, key=lambda name: left[name])
        ratio = sum(sums.size for sums in known) / sum(sums.expected for sums in known)
        is_off = left[''] > LEFT_AS_IS if best == LAG else (
            left[''] > LEFT_OF_UNIT and not 1.0 / OFF_BY < ratio < OFF_BY)
        is_suspect = is_off and left[best] < min(LEFT_SHARE * left[''], LEFT_UNDONE)
        return SAID[best] if is_suspect else ''
