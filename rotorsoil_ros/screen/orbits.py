"""On which path does every station move? Predicted beside measured, each circle with its scale."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
import math

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import HOUSING
from rotorsoil_ros.compared import Compared
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.monitor.vectors.history import nearest
from rotorsoil_ros.rotor.shaft import Orbit
from rotorsoil_ros.screen.bode import MEASURED, PREDICTED
from rotorsoil_ros.screen.channels import MICRO, moving_housings
from rotorsoil_ros.screen.chart import drawn_grid, Label, round_up, TEXT, written
from rotorsoil_ros.screen.recording import Recording

PITCH, ROW = 2.7, 3.1  # between the centres of circles of radius 1
POINTS = 33
ORBIT_NS = NANOSECONDS // 5
TOGETHER_S = 0.5  # between the two directions of one measured orbit
SMALLEST, LARGEST = 0.3, 0.95  # share of its circle, beyond which an orbit gets another scale
OUTERMOST = 1.3  # where what is larger is cut off
TURN = np.linspace(0.0, 2.0 * np.pi, POINTS)
BOX_ENDS = (-1.0, 1.0)


@dataclass(slots=True)
class Cell:
    """
    One circle: whose orbit, where, and at which scale since when.

    Attributes
    ----------
    station : str
        First part of its two channels, or the names of two probes.
    columns : tuple of two ints
        Of the channels along x and z, or in the directions of the probes.
    turn : (2, 2) float array
        Motion over (x, z) per what these channels tell.
    centre : (2,) float array
        Where in the plane.
    radii : deque of (int, float)
        Since when [ns] the circle has which radius [um].
    measured : float
        Largest amplitude measured last [um].

    """

    station: str
    columns: tuple[int, int]
    turn: FloatArray
    centre: FloatArray
    radii: deque[tuple[int, float]] = field(default_factory=lambda: deque(maxlen=64))
    measured: float = 0.0

    def rescale(self, stamp_ns: int, predicted: float) -> bool:
        """Choose the radius for an amplitude [um]; return whether it is another one."""
        size = max(predicted, self.measured)
        last = self.radii[-1][1] if self.radii else math.nan
        if not size > 0.0 or SMALLEST * last <= size <= LARGEST * last:
            return False
        chosen = round_up(size / 0.8)
        self.radii.append((stamp_ns, chosen))
        return chosen != last

    def radius(self, stamp_ns: int) -> float:
        """Return the radius at a time [um]."""
        known = [radius for since_ns, radius in self.radii if since_ns <= stamp_ns]
        return known[-1] if known else self.radii[0][1] if self.radii else math.nan

    def path(self, vector: ComplexArray, radius: float) -> FloatArray:
        """Return the orbit of its channels [m] in the plane, z up where its own y goes down."""
        along = (self.turn @ vector) * (1.0, -1.0) * MICRO / radius
        return self._placed(np.real(along[None] * np.exp(1j * TURN)[:, None]))

    def box(self, size: FloatArray, radius: float) -> FloatArray:
        """Return between which ends an orbit lies whose phases nobody knows."""
        corners = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)])
        return self._placed((corners * size) @ self.turn.T * (1.0, -1.0) * MICRO / radius)

    def _placed(self, offsets: FloatArray) -> FloatArray:
        reach = np.linalg.norm(offsets, axis=1, keepdims=True)
        return np.asarray(
            self.centre + offsets * np.minimum(1.0, OUTERMOST / np.maximum(reach, 1e-12)))


class Orbits:
    """The orbits of one machine, every one in its circle."""

    def __init__(
        self, recording: Recording, entity: str, case: Case, channels: Sequence[str],
    ) -> None:
        self._recording = recording
        self._entity = entity
        self._cells = cells(case, channels)
        self._channels = tuple(channels)
        lines = [line for cell in self._cells for line in _frame(cell.centre)]
        recording.still(f'{entity}/grid', drawn_grid(lines))
        recording.still(f'{entity}/names', written([
            Label(cell.station, cell.centre[0], cell.centre[1] - 1.45)
            for cell in self._cells]))
        self._style('predicted', PREDICTED)
        for cell in self._cells:
            self._style(f'measured/{cell.station}', MEASURED)
        recording.still(f'{entity}/scales', rr.Points2D.from_fields(
            colors=TEXT, radii=0.0, show_labels=True))

    @staticmethod
    def view(entity: str, case: Case, channels: Sequence[str]) -> rrb.View:
        """Return the view of all orbits."""
        centres = np.array([cell.centre for cell in cells(case, channels)])
        low, high = centres.min(axis=0) - 1.5, centres.max(axis=0) + 1.6
        return rrb.Spatial2DView(
            name='Orbits: blue predicted, orange measured, dot at shaft angle 0', origin=entity,
            visual_bounds=rrb.VisualBounds2D(
                x_range=(low[0], high[0]), y_range=(low[1], high[1])))

    def predicted(self, stamp_ns: IntArray, displacement: ComplexArray) -> None:
        """Draw predicted orbits for displacements (n, channels) [m]."""
        rows = self._recording.begins(self._entity, stamp_ns, ORBIT_NS)
        if not len(rows):
            return
        strips: list[list[FloatArray]] = []
        for stamp, vector in zip(stamp_ns[rows].tolist(), displacement[rows], strict=True):
            if not np.isfinite(vector).all():
                strips.append([])
                continue
            pairs = [vector[list(cell.columns)] for cell in self._cells]
            others = [cell.rescale(stamp, MICRO * float(np.abs(pair).max()))
                      for cell, pair in zip(self._cells, pairs, strict=True)]
            if any(others):
                self._write_scales(stamp)
            strips.append([cell.path(pair, cell.radius(stamp)) for cell, pair in zip(
                self._cells, pairs, strict=True) if cell.radii])
        self._draw('predicted', stamp_ns[rows], strips, has_phase=True)

    def expect(self, events: Sequence[Compared]) -> None:
        """Learn how large what was measured is, before a scale is chosen for it."""
        for cell in self._cells:
            names = {self._channels[column] for column in cell.columns}
            sizes = [float(np.nanmax(event.amplitude[:, column], initial=0.0))
                     for event in events for column, name in enumerate(event.channels)
                     if name in names]
            if sizes:
                cell.measured = MICRO * max(sizes)

    def compare(self, events: Sequence[Compared]) -> None:
        """Draw measured orbits of all stations of which both directions were measured."""
        tracks = {channel: Track.of(events, channel) for channel in self._channels
                  if any(channel in event.channels for event in events)}
        for cell in self._cells:
            x, z = (tracks.get(self._channels[column]) for column in cell.columns)
            if x is not None and z is not None and cell.radii:
                self._measured(cell, x, z)

    def _measured(self, cell: Cell, x: 'Track', z: 'Track') -> None:
        index = nearest(x.stamp_ns, z.stamp_ns, tolerance_s=TOGETHER_S)
        rows = np.flatnonzero(index >= 0)
        rows = rows[self._recording.begins(
            f'{self._entity}/{cell.station}', x.stamp_ns[rows], ORBIT_NS)]
        strips: list[list[FloatArray]] = []
        stamps, has_phase = x.stamp_ns[rows], False
        for stamp, row in zip(stamps.tolist(), rows.tolist(), strict=True):
            other, radius = int(index[row]), cell.radius(stamp)
            size = np.array([x.amplitude[row], z.amplitude[other]])
            if not np.isfinite(size).all():
                strips.append([])
                continue
            angle = np.array([x.phase[row], z.phase[other]])
            has_phase = bool(np.isfinite(angle).all())
            strips.append([cell.path(size * np.exp(1j * angle), radius) if has_phase
                           else cell.box(size, radius)])
        if len(rows):
            self._draw(f'measured/{cell.station}', stamps, strips, has_phase=has_phase)

    def _draw(
        self, name: str, stamp_ns: IntArray, strips: list[list[FloatArray]], *, has_phase: bool,
    ) -> None:
        """Draw orbits, and on each the point where the shaft is at the angle zero."""
        entity = f'{self._entity}/{name}'
        self._recording.strips(entity, stamp_ns, strips)
        marks = [[line[0] for line in lines] if has_phase else [] for lines in strips]
        self._recording.send(f'{entity}/mark', stamp_ns, rr.Points2D.columns(
            positions=[mark for each in marks for mark in each]).partition(
                [len(each) for each in marks]))

    def _style(self, name: str, colour: tuple[int, int, int]) -> None:
        entity = f'{self._entity}/{name}'
        self._recording.still(entity, rr.LineStrips2D.from_fields(
            colors=colour, radii=rr.Radius.ui_points(1.2)))
        self._recording.still(f'{entity}/mark', rr.Points2D.from_fields(
            colors=colour, radii=rr.Radius.ui_points(3.5)))

    def _write_scales(self, stamp_ns: int) -> None:
        """Write below each circle how large it is."""
        shown = [cell for cell in self._cells if cell.radii]
        self._recording.send(
            f'{self._entity}/scales', np.array([stamp_ns]), rr.Points2D.columns(
                positions=[(cell.centre[0], cell.centre[1] + 1.05) for cell in shown],
                labels=[f'circle: {cell.radius(stamp_ns):g} um' for cell in shown],
            ).partition([len(shown)]))


@dataclass(frozen=True, slots=True)
class Track:
    """What was measured of one channel: stamps [ns], amplitudes [m], phases [rad]."""

    stamp_ns: IntArray
    amplitude: FloatArray
    phase: FloatArray

    @classmethod
    def of(cls, events: Sequence[Compared], channel: str) -> 'Track':
        """Collect it in the order of time."""
        parts = [(event, event.channels.index(channel)) for event in events
                 if channel in event.channels]
        stamps = np.concatenate([event.stamp_ns for event, _ in parts])
        order = np.argsort(stamps, kind='stable')
        return cls(stamps[order],
                   np.concatenate([event.amplitude[:, at] for event, at in parts])[order],
                   np.concatenate([event.phase[:, at] for event, at in parts])[order])


def cells(case: Case, channels: Sequence[str]) -> list[Cell]:
    """Return the circles of a machine, along its shaft; housings that stand on soil below."""
    moving = moving_housings(case)
    housings = [Orbit.of(bearing.name, bearing.position, HOUSING)
                for bearing in case.rotor.bearings if bearing.name in moving]
    found = []
    for row, stations in enumerate((case.rotor.orbits, housings)):
        along = sorted(stations, key=lambda station: (station.position, station.name))
        for column, station in enumerate(along):
            first, second = station.channels
            if first in channels and second in channels:
                found.append(Cell(
                    station.name, (channels.index(first), channels.index(second)), station.turn,
                    np.array([column * PITCH, row * ROW])))
    return found


def _frame(centre: FloatArray) -> list[FloatArray]:
    circle = centre + np.column_stack([np.cos(TURN), np.sin(TURN)])
    return [circle, centre + np.array([(end, 0.0) for end in BOX_ENDS]),
            centre + np.array([(0.0, end) for end in BOX_ENDS])]
