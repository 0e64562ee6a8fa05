"""Of which frequencies is a vibration made, and how do they go with time? Raw samples only."""

from collections import deque

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from scipy.signal import get_window

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.events import NANOSECONDS, Samples
from rotorsoil_ros.screen.chart import Axis, drawn_grid, grid, Label, written
from rotorsoil_ros.screen.recording import Recording

COLUMNS, PARTS, PART_ROWS = 160, 10, 8
ROWS = PARTS * PART_ROWS
PERIOD_NS = 2 * NANOSECONDS
ORDERS = 6  # of the fastest speed, that are shown
QUIETEST, LOUDEST = 0.001, 10.0  # [mm/s rms], darkest and brightest
LOWEST_HZ = 2.0  # below it the integration of acceleration shows nothing but its noise
FEWEST_SAMPLES = 64
FASTEST_HZ = 65_536.0
WATERFALL_BOUNDS = rrb.VisualBounds2D(x_range=(-14.0, COLUMNS + 6.0), y_range=(-12.0, ROWS + 10.0))
SPEED = (255, 255, 255, 110)


class Waterfall:
    """
    The spectrum of one raw channel every two seconds, the newest on top.

    Every column shows the largest line of the spectrum that falls into it: a peak that is
    narrower than a column is not lost. The picture is made of parts, of which the oldest begins
    anew: each period sends what has come, and by how much the rest has moved.
    """

    def __init__(self, recording: Recording, entity: str, topic: str, *, top_hz: float) -> None:
        self._recording = recording
        self._entity = entity
        self._frequency = Axis(0.0, top_hz, 0.0, COLUMNS)
        self._stamps: list[IntArray] = []
        self._samples: list[FloatArray] = []
        self._count = 0  # periods so far
        self._rows: deque[np.ndarray] = deque(maxlen=PART_ROWS)
        self._turning: deque[float] = deque(maxlen=PART_ROWS + 1)
        recording.still(f'{entity}/labels', written(
            [Label(f'no raw acceleration has come on {topic}', 0.5 * COLUMNS, 0.5 * ROWS)]))

    @staticmethod
    def view(entity: str, channel: str) -> rrb.View:
        """Return the view of a channel."""
        return rrb.Spatial2DView(
            name=f'{channel} [Hz]', origin=entity, visual_bounds=WATERFALL_BOUNDS)

    def take(self, event: Samples, speed: float) -> None:
        """Add samples, and the speed at their end [rad/s]; draw when a period is full."""
        if self._stamps and event.stamp_ns[0] < self._stamps[-1][-1]:
            self._stamps, self._samples = [], []  # time has jumped back
        self._stamps.append(event.stamp_ns)
        self._samples.append(event.acceleration)
        if event.stamp_ns[-1] - self._stamps[0][0] < PERIOD_NS:
            return
        stamps, samples = np.concatenate(self._stamps), np.concatenate(self._samples)
        self._stamps, self._samples = [], []
        frequency, velocity = spectrum(stamps, samples)
        if len(frequency):
            if not self._rows:
                self._draw_frame()
            self._rows.appendleft(self._shades(frequency, velocity))
            self._turning.appendleft(speed / (2.0 * np.pi))
            self._draw(int(stamps[-1]))

    def _shades(self, frequency: FloatArray, velocity: FloatArray) -> np.ndarray:
        """Return one row of the picture, a byte for each column."""
        chosen = (frequency >= LOWEST_HZ) & (frequency < self._frequency.high)
        loudest = np.full(COLUMNS, QUIETEST)
        column = self._frequency.place(frequency[chosen]).astype(int)
        np.maximum.at(loudest, column, velocity[chosen])
        steps = Axis(QUIETEST, LOUDEST, 0.0, 255.0, is_log=True)
        return steps.place(loudest).astype(np.uint8)

    def _draw(self, stamp_ns: int) -> None:
        """Send the part that grows, newest row on top, and move everything down by a row."""
        part = f'{self._entity}/picture/{self._count // PART_ROWS % PARTS}'
        grown = self._count % PART_ROWS + 1
        stamps, rows = np.array([stamp_ns]), list(self._rows)[:grown]
        self._recording.send(part, stamps, rr.ComponentColumnList([
            *rr.DepthImage.columns(buffer=[np.concatenate(rows).tobytes()], format=[
                rr.components.ImageFormat(width=COLUMNS, height=grown, channel_datatype='U8')]),
            *rr.Transform3D.columns(translation=[[0.0, -float(self._count), 0.0]])]))
        turning = np.array(list(self._turning)[:grown + 1])  # from the end of the part before
        points = np.column_stack([self._frequency.place(turning),
                                  np.arange(len(turning)) + 0.5])[np.isfinite(turning)]
        self._recording.strips(f'{part}/speed', stamps, [[points] * (len(points) > 1)])
        self._recording.send(f'{self._entity}/picture', stamps, rr.Transform3D.columns(
            translation=[[0.0, float(self._count), 0.0]]))
        self._count += 1

    def _draw_frame(self) -> None:
        ticks = self._frequency.ticks(8)
        seconds = PERIOD_NS // NANOSECONDS
        rows = Axis(0.0, float(ROWS * seconds), 0.0, float(ROWS))
        ago = rows.ticks(4)
        labels = [Label(f'{tick:g}', float(self._frequency.place(np.array(tick))), ROWS + 1.0)
                  for tick in ticks]
        labels += [Label(f'{tick:g} s ago' if tick else 'now', -7.0,
                         float(rows.place(np.array(tick))) - 3.0) for tick in ago]
        labels.append(Label(
            f'velocity from {QUIETEST:g} (dark) to {LOUDEST:g} mm/s rms (bright) over frequency '
            '[Hz]; line: speed', 0.5 * COLUMNS, -6.0))
        still = self._recording.still
        still(f'{self._entity}/labels', written(labels))
        still(f'{self._entity}/grid', drawn_grid(
            grid(self._frequency, rows, x_ticks=ticks, y_ticks=ago)))
        for part in range(PARTS):
            # Not its pixels: what is static would hide those that come.
            still(f'{self._entity}/picture/{part}', rr.DepthImage.from_fields(
                colormap='inferno', depth_range=(0.0, 255.0), draw_order=-20.0))
            still(f'{self._entity}/picture/{part}/speed', rr.LineStrips2D.from_fields(
                colors=SPEED, radii=rr.Radius.ui_points(0.5)))


def spectrum(stamp_ns: IntArray, acceleration: FloatArray) -> tuple[FloatArray, FloatArray]:
    """
    Return frequencies [Hz] and velocities [mm/s rms] of samples [m/s^2]; nothing of too few.

    Notes
    -----
    The samples are laid onto an even grid first: stamps jitter and samples are lost.

    """
    time = (stamp_ns - stamp_ns[0]) / NANOSECONDS
    known = np.isfinite(acceleration) & (np.diff(time, prepend=-1.0) > 0.0)
    time, samples = time[known], acceleration[known]
    if len(time) < FEWEST_SAMPLES:
        return np.empty(0), np.empty(0)
    step = max(float(np.median(np.diff(time))), 1.0 / FASTEST_HZ)
    even = np.interp(np.arange(0.0, time[-1], step), time, samples - samples.mean())
    window = get_window('hann', len(even))
    amplitude = np.abs(np.fft.rfft(even * window)) * 2.0 / window.sum()
    frequency = np.fft.rfftfreq(len(even), step)
    omega = 2.0 * np.pi * np.maximum(frequency, 1.0 / (time[-1] + step))
    return np.asarray(frequency), np.asarray(1e3 / np.sqrt(2.0) * amplitude / omega)
