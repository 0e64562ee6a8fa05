"""What is in one stretch of raw samples: a vector, or the reason why it may not be one."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, FloatArray
from rotorsoil_ros.case.entries.sensors import Pickup
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.monitor.vectors.orders import (
    deviations,
    fit,
    OrderFit,
    OrderVector,
    SpeedTrack,
    Turning,
)
from rotorsoil_ros.monitor.vectors.quality import examine, jump, left_spikes, spikes
from rotorsoil_ros.monitor.vectors.refusal import Flaw, Refusal
from rotorsoil_ros.monitor.vectors.sampling import (
    even_grids,
    image,
    phase_scatter,
    Sampling,
    sampling,
    scattered,
    told_by,
)

FITTED = (1, 2, 3)  # a harmonic that is there and not fitted would disturb the others
TOLD = FITTED[:2]

# Orders are fitted and told below these shares of the sample rate.
_FITTED_BELOW, _TOLD_BELOW = 0.45, 0.40

# Harmonics up to this one may lie above half the rate and look like another order.
_HIGHEST_IMAGE = 10

# A sensor that feels so much of its range has felt more.
_RANGE_USED = 0.98

_SPIKES_PER_TURN = 1.0 / 3.0  # that may be left out

# Multiples of its standard error below which a vector is noise.
ABOVE_NOISE = 3.0

_TINY = np.finfo(float).tiny


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """
    Samples of some turns, in the order of time.

    Attributes
    ----------
    at : Turning
        When the samples were taken, and where the rotor was.
    values : (n,) float array
        Acceleration [m/s^2].
    peaks : (n,) float array
        The largest that the sensor felt with each, along any axis that counts [m/s^2].
    until : float
        Where the next stretch begins [s].
    turns : float
        How many turns make a stretch.
    pickup : Pickup
        What is known of the sensor.
    above_noise : float
        Multiple of its standard error below which a vector is noise.
    beside : sequence of SpeedTrack
        Other machines whose parts turn so much faster or slower that the samples tell them.

    """

    at: Turning
    values: FloatArray
    peaks: FloatArray
    until: float
    turns: float
    pickup: Pickup
    above_noise: float = ABOVE_NOISE
    beside: Sequence[SpeedTrack] = ()


class Finding:
    """Finds the vector of a stretch; a rule whose failure makes others meaningless comes first."""

    def __init__(self, stretch: Stretch, track: SpeedTrack) -> None:
        self._stretch, self._track = stretch, track
        self._at, self._values, self._peaks = stretch.at, stretch.values, stretch.peaks
        self._turn_rate = self._at.turns / max(float(np.ptp(stretch.at.time)), _TINY)
        self._most = int(stretch.turns * _SPIKES_PER_TURN)
        self._spikes = 0
        self.left_out: list[str] = []

    def vector(self) -> OrderVector | Refusal:
        """Return the vector, with NaN for an order that cannot be told, or a refusal."""
        stretch, turn_rate = self._stretch, self._turn_rate
        taken = sampling(self._at.time, until=stretch.until, turn_rate=turn_rate,
                         turns=stretch.turns)
        if isinstance(taken, Refusal):
            return taken
        out, deviation = spikes(self._values)
        if np.count_nonzero(out) <= self._most:
            self._drop(out)
        found = examine(self._values, taken, turn_rate=turn_rate, turns=stretch.turns)
        if isinstance(found, Refusal):
            return found
        if (peak := float(self._peaks.max())) >= _RANGE_USED * stretch.pickup.range:
            return Refusal(Flaw.CLIPPED, f'clipped at {peak:.4g} m/s^2')
        if flaw := self._of_rate(found.rate):
            return flaw
        try:
            return self._fitted(taken, found.rate, deviation=deviation, hidden=found.hidden)
        except NotSolvedError as error:
            return Refusal(Flaw.UNSOLVED, str(error))

    def _drop(self, out: BoolArray) -> None:
        """Leave spikes out."""
        if number := int(np.count_nonzero(out)):
            self._at, self._values = self._at.rows(~out), self._values[~out]
            self._peaks = self._peaks[~out]
            self._spikes += number

    def _of_rate(self, rate: float) -> Refusal | None:
        """Return why 1X cannot be told at a rate of new values [1/s]."""
        if self._turn_rate > _TOLD_BELOW * rate:
            return Refusal(Flaw.NYQUIST, f'1X is above {_TOLD_BELOW:g} of the sample rate')
        if (other := self._image(1, rate)) is not None:
            return Refusal(
                Flaw.ALIAS, f'1X cannot be told from {other}X at this rate: sample at '
                f'{_HIGHEST_IMAGE + 1} times the speed or more, or state anti_alias in the case')
        return None

    def _image(self, order: int, rate: float) -> int | None:
        return None if self._stretch.pickup.has_filter else image(
            order, rate=rate, turn_rate=self._turn_rate, turns=self._stretch.turns,
            highest=_HIGHEST_IMAGE)

    def _fitted(
        self, taken: Sampling, rate: float, *, deviation: float, hidden: float,
    ) -> OrderVector | Refusal:
        """Return the vector that the samples give at a rate of new values [1/s]."""
        orders = [order for order in FITTED if order * self._turn_rate <= _FITTED_BELOW * rate]
        found = self._fit(self._at, orders)
        if (out := left_spikes(found.residual, deviation=deviation)).any():
            self._drop(out)
            if self._spikes > self._most:
                return Refusal(Flaw.SPIKES, f'{self._spikes} spikes in a stretch')
            found = self._fit(self._at, orders)
        middle = self._at.middle
        speed = float(np.interp(middle, self._track.time, self._track.speed))
        scatter = 0.0 if taken.is_even else self._scatter(found, taken, speed, orders)
        if isinstance(scatter, Refusal):
            return scatter
        likely = orders[:len(TOLD)]
        size = np.abs(found.vectors[:len(likely)])
        error = np.hypot(deviations(found, likely, speed=speed),
                         size * (0.5 * scatter**2 + hidden))
        if flaw := _of_fit(found, float(size[0]), float(error[0]), speed,
                           self._stretch.above_noise):
            return flaw
        told = self._told(rate)
        self.left_out += ['spike left out'] * self._spikes
        vectors = [found.vectors[orders.index(order)] if order in told else math.nan
                   for order in TOLD]
        errors = [error[orders.index(order)] if order in told else math.nan for order in TOLD]
        return OrderVector(middle, speed, np.array(vectors, dtype=complex), np.array(errors),
                           self._track.has_phase, np.abs(found.beside))

    def _fit(self, at: Turning, orders: list[int]) -> OrderFit:
        """Fit what the rotor does and what others do, wherever it was."""
        return fit(at, self._values, orders, [Turning.of(np.clip(
            at.time, track.time[0], track.time[-1]), track) for track in self._stretch.beside])

    def _told(self, rate: float) -> set[int]:
        """Return which orders can be told, and take down why others cannot."""
        told = set()
        for order in TOLD:
            if order * self._turn_rate > _TOLD_BELOW * rate:
                self.left_out.append(
                    f'{order}X left out: above {_TOLD_BELOW:g} of the sample rate')
            elif (other := self._image(order, rate)) is not None:
                self.left_out.append(
                    f'{order}X left out: cannot be told from {other}X at this rate')
            else:
                told.add(order)
        return told

    def _scatter(
        self, found: OrderFit, taken: Sampling, speed: float, orders: list[int],
    ) -> float | Refusal:
        """Return the phase of 1X by which stamps may be wrong [rad], or refuse them."""
        grids = list(self._held_against(found, taken, speed, orders))
        if taken.is_ordered:
            grids = [max(grids)]  # the best: others may lie far off and still beat the stamps
        worst = 0.0
        for likelihood, apart in grids:
            is_wrong, left = told_by(apart, likelihood, taken, number=len(self._values),
                                     step_phase=speed * taken.step)
            if is_wrong:
                return scattered(left, speed=speed)
            worst = max(worst, left)
        return worst

    def _held_against(
        self, found: OrderFit, taken: Sampling, speed: float, orders: list[int],
    ) -> Iterator[tuple[float, float]]:
        """Yield by how much likelier each even grid is than the stamps, and how far apart."""
        for grid in self._grids(taken):
            even = self._fit(Turning.of(grid, self._track), orders)
            likelihood = len(grid) * math.log(max(found.power, _TINY) / max(even.power, _TINY))
            yield likelihood, phase_scatter(self._at.time, grid, speed=speed)

    def _grids(self, taken: Sampling) -> Iterator[FloatArray]:
        """Yield the even grids, as far as the speed is known."""
        begin, end = self._track.time[0], self._track.time[-1]
        for grid in even_grids(self._at.time, taken):
            yield np.clip(grid, begin, end)


def _of_fit(
    found: OrderFit, size: float, error: float, speed: float, above_noise: float,
) -> Refusal | None:
    """Return why a vector of 1X with its standard error [m] at a speed [rad/s] is none."""
    if flaw := jump(found.residual, first=size * speed**2, deviation=error * speed**2):
        return flaw
    if size < above_noise * error:
        return Refusal(Flaw.NOISE, f'below noise: less than {above_noise:g} times its standard '
                                   'error')
    return None
