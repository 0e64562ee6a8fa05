"""How large and how late is every channel over speed? Prediction, band and measured points."""

from collections import deque
from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.compared import Compared
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.machine.band import Envelope
from rotorsoil_ros.machine.peaks import resolved_speeds
from rotorsoil_ros.machine.response import Predictor
from rotorsoil_ros.monitor.criteria import answer
from rotorsoil_ros.screen.channels import MICRO, Trend
from rotorsoil_ros.screen.chart import (
    Axis,
    curve,
    drawn_grid,
    grid,
    Label,
    LINE,
    round_up,
    written,
)
from rotorsoil_ros.screen.recording import Recording
from rotorsoil_ros.units import rad_s_to_rpm

WIDTH, AMPLITUDE, PHASE = 230.0, (60.0, 0.0), (108.0, 78.0)
BOUNDS = rrb.VisualBounds2D(x_range=(-30.0, WIDTH + 28.0), y_range=(-8.0, 128.0))
DECADES = 4
HEADROOM = 10.0  # above the largest prediction, for what is measured
LIFT = 8.0  # of a word beside its tick: it hangs below its place
TRAIL = 400  # measured points that stay
RESOLUTION = 400  # of speed: a point closer to the last one replaces nothing
TRAIL_NS = 2 * NANOSECONDS
NOW_NS = NANOSECONDS // 5
FLIP = 60.0  # a step of phase beyond it is the jump from 180 to -180 degrees, in the plane 5
PREDICTED, BAND, MEASURED, NOW = (78, 154, 230), (60, 95, 140), (255, 159, 54), (150, 150, 150)


class Bode:
    """Amplitude and phase over speed of every channel of one machine."""

    def __init__(
        self, recording: Recording, entity: str, shown: Sequence[Trend], predictor: Predictor,
    ) -> None:
        self._recording = recording
        self._entity = entity
        self._trends = shown
        low, high = predictor.table.speed_range
        self._speed = Axis(rad_s_to_rpm(low), rad_s_to_rpm(high), 0.0, WIDTH)
        self._phase = Axis(-180.0, 180.0, *PHASE)
        response = np.abs(answer(predictor, resolved_speeds(predictor)))
        self._amplitude = [
            _amplitude_axis(MICRO * float(np.nanmax(column, initial=0.0)))
            for column in response.T]
        self._trails = {trend.channel: Trail(trend) for trend in shown}
        for trend in shown:
            self._draw_frame(trend, self._amplitude[trend.column])
        self.predict(predictor)

    @staticmethod
    def view(entity: str, trend: Trend) -> rrb.View:
        """Return the view of a channel."""
        path = Bode.path(entity, trend)
        return rrb.Spatial2DView(
            name=f'{trend.channel} [{trend.unit}, deg]', origin=path,
            contents=[f'{path}/**', f'{entity}/now'], visual_bounds=BOUNDS)

    @staticmethod
    def path(entity: str, trend: Trend) -> str:
        """Return under which entity a channel is drawn."""
        return f'{entity}/{trend.channel}'

    def predict(self, predictor: Predictor | None) -> None:
        """Draw the prediction of an unbalance, or none."""
        for trend in self._trends:
            lines: list[FloatArray] = []
            if predictor is not None:
                speed = resolved_speeds(predictor)
                vector = answer(predictor, speed)[:, trend.column]
                x = self._speed.place(rad_s_to_rpm(speed))
                lines = curve(x, self._amplitude[trend.column].place(MICRO * np.abs(vector)))
                lines += curve(x, self._phase.place(np.degrees(np.angle(vector))),
                               largest_step=FLIP / 12.0)
            self._recording.still(f'{self.path(self._entity, trend)}/predicted', rr.LineStrips2D(
                lines, colors=PREDICTED, radii=rr.Radius.ui_points(1.0)))

    def band(self, envelope: Envelope | None) -> None:
        """Draw between which amplitudes the predictions lie, or nothing."""
        for trend in self._trends:
            lines: list[FloatArray] = []
            if envelope is not None:
                x = self._speed.place(rad_s_to_rpm(envelope.speed))
                for side in (envelope.low, envelope.high):
                    lines += curve(x, self._amplitude[trend.column].place(
                        MICRO * side[:, trend.column]))
            self._recording.still(f'{self.path(self._entity, trend)}/band', rr.LineStrips2D(
                lines, colors=BAND, radii=LINE, draw_order=-5.0))

    def compare(self, event: Compared) -> None:
        """Add measured points."""
        for column, channel in enumerate(event.channels):
            trail = self._trails.get(channel)
            if trail is None:
                continue
            amplitude = self._amplitude[trail.trend.column].place(
                MICRO * event.amplitude[:, column])
            turned = np.degrees(np.angle(np.exp(1j * event.phase[:, column])))
            points = np.column_stack([
                self._speed.place(rad_s_to_rpm(event.speed)), amplitude,
                self._phase.place(turned)])
            for stamp_ns, point in zip(event.stamp_ns.tolist(), points, strict=True):
                if trail.add(stamp_ns, point):
                    self._draw_trail(trail.trend, stamp_ns, trail.points())

    def now(self, stamp_ns: IntArray, speed: FloatArray) -> None:
        """Draw a line at the speed of the moment."""
        rows = self._recording.begins(f'{self._entity} now', stamp_ns, NOW_NS)
        if len(rows):
            x = self._speed.place(rad_s_to_rpm(speed[rows])).tolist()
            self._recording.strips(f'{self._entity}/now', stamp_ns[rows], [
                [np.array([(at, PHASE[0]), (at, AMPLITUDE[1])])] if np.isfinite(at) else []
                for at in x])

    def _draw_trail(self, trend: Trend, stamp_ns: int, points: FloatArray) -> None:
        self._recording.send(
            f'{self.path(self._entity, trend)}/measured', np.array([stamp_ns]),
            rr.Points2D.columns(positions=points).partition([len(points)]))

    def _draw_frame(self, trend: Trend, amplitude: Axis) -> None:
        speed, phase = self._speed, self._phase
        path, bottom = self.path(self._entity, trend), PHASE[0]
        rpm, sizes, angles = speed.ticks(6), amplitude.ticks(DECADES), (-180.0, 0.0, 180.0)
        lines = grid(speed, amplitude, x_ticks=rpm, y_ticks=sizes)
        lines += grid(speed, phase, x_ticks=rpm, y_ticks=(-90.0, *angles, 90.0))
        labels = [Label(f'{tick:g}', float(speed.place(np.array(tick))), bottom + 3.0)
                  for tick in rpm]
        labels += [Label(f'{tick:g}', -14.0, float(amplitude.place(np.array(tick))) - LIFT)
                   for tick in sizes]
        labels += [Label(f'{tick:g}', -14.0, float(phase.place(np.array(tick))) - LIFT)
                   for tick in angles]
        labels += [Label('rpm', WIDTH + 14.0, bottom + 3.0)]
        self._recording.still(f'{path}/grid', drawn_grid(lines))
        self._recording.still(f'{path}/labels', written(labels))
        self._recording.still(f'{path}/legend', rr.Points2D(
            [(0.65 * WIDTH, 44.0), (0.89 * WIDTH, 44.0)], radii=0.0, show_labels=True,
            colors=[PREDICTED, MEASURED], labels=['predicted', 'measured']))
        self._recording.still(f'{path}/measured', rr.Points2D.from_fields(
            colors=MEASURED, radii=rr.Radius.ui_points(1.5), draw_order=10.0))
        self._recording.still(f'{self._entity}/now', rr.LineStrips2D.from_fields(
            colors=NOW, radii=LINE))


class Trail:
    """Points that were measured lately, spread over speed: at rest nothing is added."""

    def __init__(self, trend: Trend) -> None:
        self.trend = trend
        self._points: deque[FloatArray] = deque(maxlen=TRAIL)
        self._drawn_ns: int | None = None

    def add(self, stamp_ns: int, point: FloatArray) -> bool:
        """Add speed, amplitude and phase in the plane; return whether it is time to draw."""
        if not np.isfinite(point[:2]).all():
            return False
        step = WIDTH / RESOLUTION
        if self._points and np.linalg.norm((point - self._points[-1])[:2]) < step:
            return False
        self._points.append(point)
        if self._drawn_ns is not None and 0 <= stamp_ns - self._drawn_ns < TRAIL_NS:
            return False
        self._drawn_ns = stamp_ns
        return True

    def points(self) -> FloatArray:
        """Return all points of amplitude and, where it is known, of phase, (m, 2)."""
        points = np.array(self._points)
        phases = points[np.isfinite(points[:, 2])]
        return np.vstack([points[:, :2], phases[:, [0, 2]]])


def _amplitude_axis(largest: float) -> Axis:
    """Return an axis for amplitudes up to a largest predicted one [um, urad]."""
    top = round_up(HEADROOM * largest) if largest > 0.0 else 1.0
    return Axis(top / 10.0**DECADES, top, *AMPLITUDE, is_log=True)
