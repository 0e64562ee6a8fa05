"""How is the vibrating machine drawn in three dimensions? Scaled, slowed down, and saying so."""

from collections.abc import Iterable

import numpy as np
import rerun as rr

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.ground.plan import Part
from rotorsoil_ros.screen.recording import Recording
from rotorsoil_ros.screen.scene import Block, Scene
from rotorsoil_ros.units import rad_s_to_rpm

FRAME_NS = NANOSECONDS // 10
TURN_NS = 4 * NANOSECONDS  # a drawn turn of the shaft; the real one could not be followed
STEEL, GOLD, CONCRETE, EDGE = (70, 130, 180), (230, 160, 30), (150, 150, 145), (60, 60, 60)
EARTH = (160, 120, 70)
MOVING = 'moving'
SHAFT_RADIUS = rr.Radius.ui_points(3.0)
ORBIT_RADIUS = rr.Radius.ui_points(1.5)
EDGE_RADIUS = rr.Radius.ui_points(1.0)


class Picture:
    """Draws one machine into a recording, at most ten times per second of message time."""

    def __init__(
        self, recording: Recording, entity: str, caption: str, scene: Scene,
    ) -> None:
        self._recording = recording
        self._entity = entity
        self._caption = caption
        self._scene = scene
        self._scale = 1.0
        self._reservation = '; the height of the block is schematic' if any(
            block.is_schematic for block in scene.blocks) else ''
        self._draw_at_rest()

    def draw(
        self, stamp_ns: IntArray, speed: FloatArray, displacement: ComplexArray,
    ) -> None:
        """Draw frames (n,): speeds [rad/s] and displacements (n, channels) [m, rad]."""
        scene, known = self._scene, ~np.isnan(displacement[:, 0].real)
        largest = np.where(known, scene.largest(displacement), 0.0)
        scale = scene.scales(largest, self._scale)
        self._scale = float(scale[-1])
        turn = 2.0 * np.pi * (stamp_ns % TURN_NS) / TURN_NS
        offsets = scene.stations_at(displacement, turn) * scale[:, None, None]
        y = np.array([station.y for station in scene.stations])
        self._send_strips('shaft', stamp_ns, scene.shaft(offsets)[:, None], known)
        self._send_strips('orbits', stamp_ns, scene.orbits(displacement, scale), known)
        self._send_strips('discs', stamp_ns, scene.discs(offsets), known)
        self._send_points(stamp_ns, scene.points(y, offsets), known)
        for block in scene.blocks:
            moved = np.real(displacement[:, list(block.channels)] * np.exp(1j * turn)[:, None])
            self._move(block, stamp_ns, np.where(known[:, None], moved, 0.0) * scale[:, None])
        self._recording.send(self._caption, stamp_ns, rr.TextDocument.columns(
            text=[self._words(*frame) for frame in zip(known, speed, largest, scale, strict=True)],
            media_type=['text/markdown'] * len(known)))

    def _words(self, known: bool, speed: float, largest: float, scale: float) -> str:
        if not known:
            return (f'**No prediction at {rad_s_to_rpm(speed):.0f} rpm**: '
                    'the foundation is drawn at rest, the shaft is not drawn.')
        return (f'**Displacements x {scale:g}** at {rad_s_to_rpm(speed):.0f} rpm; the largest is '
                f'{1e6 * largest:.3g} um. One turn is drawn in {TURN_NS / NANOSECONDS:g} s'
                f'{self._reservation}.')

    def _send_strips(
        self, name: str, stamp_ns: IntArray, strips: FloatArray, known: BoolArray,
    ) -> None:
        """Send one set of lines per frame, none where nothing is known."""
        if not strips.shape[1]:
            return
        sent = strips[known].reshape(-1, *strips.shape[2:])
        self._recording.send(f'{self._entity}/{name}', stamp_ns, rr.LineStrips3D.columns(
            strips=list(sent)).partition(np.where(known, strips.shape[1], 0)))

    def _send_points(
        self, stamp_ns: IntArray, points: FloatArray, known: BoolArray,
    ) -> None:
        self._recording.send(f'{self._entity}/stations', stamp_ns, rr.Points3D.columns(
            positions=points[known].reshape(-1, 3)).partition(
                np.where(known, points.shape[1], 0)))

    def _move(self, block: Block, stamp_ns: IntArray, moved: FloatArray) -> None:
        """Shift and turn a block, with all that stands on it, by (n, 6) [m, rad]."""
        angle = np.linalg.norm(moved[:, 3:], axis=1)
        half = np.where(angle > 0.0, np.sin(0.5 * angle) / np.where(angle > 0.0, angle, 1.0), 0.5)
        quaternion = np.column_stack([moved[:, 3:] * half[:, None], np.cos(0.5 * angle)])
        moving = f'{self._entity}/{block.name}/{MOVING}'
        self._recording.send(moving, stamp_ns, rr.Transform3D.columns(
            translation=moved[:, :3], quaternion=quaternion))

    def _draw_at_rest(self) -> None:
        """Log what never changes: coordinates, styles, ground and what rides on each block."""
        scene, log = self._scene, self._log
        log('', rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        log('shaft', rr.LineStrips3D.from_fields(colors=STEEL, radii=SHAFT_RADIUS))
        log('orbits', rr.LineStrips3D.from_fields(colors=GOLD, radii=ORBIT_RADIUS))
        log('discs', rr.LineStrips3D.from_fields(colors=STEEL, radii=SHAFT_RADIUS))
        log('stations', rr.Points3D.from_fields(colors=GOLD, radii=rr.Radius.ui_points(5.0)))
        # Beside the machine and not on it: names of neighbours would cover each other.
        log('names', rr.Points3D(
            [scene.name_place(station) for station in scene.stations], colors=GOLD, radii=0.0,
            labels=[station.name for station in scene.stations],
            show_labels=True))
        axis = scene.points(scene.y[[0, -1]], np.zeros((2, 2)))
        log('shaft_at_rest', rr.LineStrips3D([axis], colors=(*STEEL, 90), radii=EDGE_RADIUS))
        log('pedestals', self._pedestals(scene.ground_seats, foot=0.0))
        for block in scene.blocks:
            parts = block.parts or (Part(block.half_width, block.half_length, 0.0, 0.0),)
            sizes = [(2.0 * part.half_width, 2.0 * part.half_length, block.height)
                     for part in parts]
            centres = [(part.x, part.y, 0.5 * block.height) for part in parts]
            seats = np.array(block.seats) - block.centre_y
            # What is static hides what moves: the block stands here and moves one level below.
            log(block.name, rr.Transform3D(
                translation=(block.centre_x, block.centre_y, 0.0)))
            if block.hole:
                log(f'{block.name}/ground', rr.LineStrips3D(
                    block.hole, colors=EARTH, radii=EDGE_RADIUS))
            log(f'{block.name}/{MOVING}/body', rr.Boxes3D(
                sizes=sizes, centers=centres, colors=CONCRETE, fill_mode='solid'))
            log(f'{block.name}/{MOVING}/edges', rr.Boxes3D(
                sizes=sizes, centers=centres, colors=EDGE, radii=EDGE_RADIUS))
            log(f'{block.name}/{MOVING}/pedestals', self._pedestals(
                seats, foot=block.height, across=-block.centre_x))

    def _pedestals(
        self, seats: Iterable[float], *, foot: float, across: float = 0.0,
    ) -> rr.LineStrips3D:
        """Return one trestle from its foot to the shaft axis, so far across, at each seat."""
        top = self._scene.shaft_height
        spread = 0.3 * (top - foot)
        return rr.LineStrips3D(
            [[(across - spread, y, foot), (across, y, top), (across + spread, y, foot)]
             for y in seats],
            colors=EDGE, radii=SHAFT_RADIUS)

    def _log(self, name: str, what: rr.AsComponents) -> None:
        path = f'{self._entity}/{name}' if name else self._entity
        self._recording.still(path, what)
