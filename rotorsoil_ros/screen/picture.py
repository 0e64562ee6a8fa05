"""How are vibrating machines drawn in three dimensions? Scaled, slowed down, and saying so."""

from collections.abc import Sequence

import numpy as np
import rerun as rr

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.ground.plan import Part
from rotorsoil_ros.screen.recording import Recording
from rotorsoil_ros.screen.scene import Block, Scene
from rotorsoil_ros.units import rad_s_to_rpm

FRAME_NS = NANOSECONDS // 10
TURN_NS = 4 * NANOSECONDS  # a drawn turn of the fastest shaft; the real one could not be followed
STEEL, GOLD, CONCRETE, EDGE = (70, 130, 180), (230, 160, 30), (150, 150, 145), (60, 60, 60)
EARTH, AT_REST = (160, 120, 70), (95, 105, 95)
MOVING = 'moving'
SHAFT_RADIUS = rr.Radius.ui_points(3.0)
ORBIT_RADIUS = rr.Radius.ui_points(1.5)
EDGE_RADIUS = rr.Radius.ui_points(1.0)


class Picture:
    """
    Draws machines on what they stand on, at most ten times per second of message time.

    Each of several sources moves everything at its own frequency. Orbits are those of one alone:
    the path under several does not close.
    """

    def __init__(
        self, recording: Recording, entity: str, caption: str, scene: Scene,
        sources: Sequence[str] = ('',),
    ) -> None:
        self._recording = recording
        self._entity = entity
        self._caption = caption
        self._scene = scene
        self._sources = sources
        self._scale = 1.0
        self._last_ns = 0
        self._turn = np.zeros(len(sources))
        self._reservation = '; the height of the block is schematic' if any(
            block.is_schematic for block in scene.blocks) else ''
        self._draw_at_rest()

    def draw(self, stamp_ns: IntArray, speed: FloatArray, parts: ComplexArray) -> None:
        """
        Draw frames.

        Parameters
        ----------
        stamp_ns : (n,) int array
            When [ns].
        speed : (n, s) float array
            Of each source [rad/s]; NaN of one that is silent.
        parts : (n, s, channels) complex array
            What it moves [m, rad], zero where it does nothing, NaN where nobody knows it.

        """
        scene = self._scene
        known: BoolArray = ~np.any(np.isnan(parts[:, :, 0].real), axis=1)
        parts = np.where(known[:, None, None], parts, 0.0)
        largest = scene.largest(np.abs(parts).sum(axis=1))
        scale = scene.scales(largest, self._scale)
        self._scale = float(scale[-1])
        turn = self._turns(stamp_ns, speed)
        moved = np.real(np.einsum('nsc,ns->nc', parts, np.exp(1j * turn))) * scale[:, None]
        offsets = [line.offsets(moved) for line in scene.moving]
        self._draw_shafts(stamp_ns, offsets, known)
        if len(self._sources) == 1:
            self._send_strips('orbits', stamp_ns, [
                line.orbits(parts[:, 0], scale) for line in scene.moving], known)
        for block in scene.blocks:
            self._move(block, stamp_ns, moved[:, list(block.channels)])
        for lattice in scene.lattices:
            here = lattice.moved(moved)
            self._send_strips(f'{lattice.name}/lines', stamp_ns, [lattice.lines(here)],
                              np.ones_like(known))
            self._send_points(f'{lattice.name}/places', stamp_ns, lattice.places + here,
                              np.ones_like(known))
        self._recording.send(self._caption, stamp_ns, rr.TextDocument.columns(
            text=[self._words(*frame) for frame in zip(known, speed, largest, scale, strict=True)],
            media_type=['text/markdown'] * len(known)))

    def _turns(self, stamp_ns: IntArray, speed: FloatArray) -> FloatArray:
        """Return at which angle every source is drawn, (n, s) [rad]."""
        if not self._last_ns:
            self._last_ns = int(stamp_ns[0] - stamp_ns[0] % TURN_NS)
        step = np.diff(stamp_ns, prepend=self._last_ns) / TURN_NS
        size = np.where(np.isfinite(speed), np.abs(speed), 0.0)
        fastest = size.max(axis=1, keepdims=True)
        ratio = np.where(fastest > 0.0, size / np.where(fastest > 0.0, fastest, 1.0), 1.0)
        turns = self._turn + np.cumsum(2.0 * np.pi * step[:, None] * ratio, axis=0)
        self._turn, self._last_ns = turns[-1] % (2.0 * np.pi), int(stamp_ns[-1])
        return np.asarray(turns)

    def _words(self, known: bool, speed: FloatArray, largest: float, scale: float) -> str:
        rpm = ', '.join(
            f'{name} {rad_s_to_rpm(own):.0f} rpm'.strip() if np.isfinite(own)
            else f'nothing of {name}'
            for name, own in zip(self._sources, speed.tolist(), strict=True))
        if not known:
            return (f'**No prediction at {rpm}**: '
                    'the foundation is drawn at rest, the shaft is not drawn.')
        fastest = ' of the fastest' if len(self._sources) > 1 else ''
        return (f'**Displacements x {scale:g}** at {rpm}; the largest is '
                f'{1e6 * largest:.3g} um. One turn{fastest} is drawn in '
                f'{TURN_NS / NANOSECONDS:g} s{self._reservation}.')

    def _draw_shafts(
        self, stamp_ns: IntArray, offsets: Sequence[FloatArray], known: BoolArray,
    ) -> None:
        drawn = list(zip(self._scene.moving, offsets, strict=True))
        self._send_strips('shaft', stamp_ns, [
            line.shaft(own)[:, None] for line, own in drawn], known)
        self._send_strips('discs', stamp_ns, [line.discs(own) for line, own in drawn], known)
        self._send_points('stations', stamp_ns, np.concatenate(
            [line.stationed(own) for line, own in drawn], axis=1), known)

    def _send_strips(
        self, name: str, stamp_ns: IntArray, strips: Sequence[FloatArray], known: BoolArray,
    ) -> None:
        """Send sets of lines (n, lines, points, 3) per frame, none where nothing is known."""
        each = np.concatenate(list(strips), axis=1)
        if each.shape[1]:
            sent = each[known].reshape(-1, *each.shape[2:])
            self._recording.send(f'{self._entity}/{name}', stamp_ns, rr.LineStrips3D.columns(
                strips=list(sent)).partition(np.where(known, each.shape[1], 0)))

    def _send_points(
        self, name: str, stamp_ns: IntArray, points: FloatArray, known: BoolArray,
    ) -> None:
        self._recording.send(f'{self._entity}/{name}', stamp_ns, rr.Points3D.columns(
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
            [place for _, place in scene.names], colors=GOLD, radii=0.0,
            labels=[name for name, _ in scene.names], show_labels=True))
        log('shaft_at_rest', rr.LineStrips3D(
            [line.points(line.y[[0, -1]], np.zeros((2, 2))) for line in scene.lines],
            colors=(*STEEL, 90), radii=EDGE_RADIUS))
        log('pedestals', _trestles(scene.legs))
        for block in scene.blocks:
            self._draw_block(block)
        for lattice in scene.lattices:
            log(f'{lattice.name}/lines', rr.LineStrips3D.from_fields(
                colors=CONCRETE, radii=SHAFT_RADIUS))
            log(f'{lattice.name}/places', rr.Points3D.from_fields(
                colors=CONCRETE, radii=rr.Radius.ui_points(5.0)))
            log(f'{lattice.name}/at_rest', rr.LineStrips3D(
                list(lattice.lines(np.zeros_like(lattice.places))), colors=AT_REST,
                radii=EDGE_RADIUS))

    def _draw_block(self, block: Block) -> None:
        log = self._log
        parts = block.parts or (Part(block.half_width, block.half_length, 0.0, 0.0),)
        sizes = [(2.0 * part.half_width, 2.0 * part.half_length, block.height) for part in parts]
        centres = [(part.x, part.y, 0.5 * block.height) for part in parts]
        # What is static hides what moves: the block stands here and moves one level below.
        log(block.name, rr.Transform3D(translation=(
            block.centre_x, block.centre_y, block.elevation)))
        if block.hole:
            log(f'{block.name}/ground', rr.LineStrips3D(
                block.hole, colors=EARTH, radii=EDGE_RADIUS))
        log(f'{block.name}/{MOVING}/body', rr.Boxes3D(
            sizes=sizes, centers=centres, colors=CONCRETE, fill_mode='solid'))
        log(f'{block.name}/{MOVING}/edges', rr.Boxes3D(
            sizes=sizes, centers=centres, colors=EDGE, radii=EDGE_RADIUS))
        log(f'{block.name}/{MOVING}/pedestals', _trestles(block.legs))

    def _log(self, name: str, what: rr.AsComponents) -> None:
        path = f'{self._entity}/{name}' if name else self._entity
        self._recording.still(path, what)


def _trestles(legs: Sequence[FloatArray]) -> rr.LineStrips3D:
    return rr.LineStrips3D(list(legs), colors=EDGE, radii=SHAFT_RADIUS)
