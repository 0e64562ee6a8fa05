"""Which foundation that bends the entries of a case file describe, and what is refused of it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case import schema
from rotorsoil_ros.case.cache import Cache, content_key
from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.flexible.files import Loss, of_matrices, of_modes
from rotorsoil_ros.case.flexible.stacking import StackEntries
from rotorsoil_ros.channel import ACROSS, DOFS
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.soil import Circle, Contact, Rectangle
from rotorsoil_ros.machine.flexible.body import CONTACT, EACH, FlexibleBody, GREEN, PROBE
from rotorsoil_ros.machine.flexible.rigidity import ABOVE_EXCITATION
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.units import rad_s_to_hz

# Modes have to reach so many times the highest 1X frequency.
LEAST_REACH = 2.0

# To be raised whenever other bodies come out of the same files, or other files are refused.
_ALGORITHM = 2

# A seat belongs onto the shaft [m].
_OFF_SHAFT = 0.02

_MATRICES, _MODES = ('stiffness', 'mass', 'dofs'), ('modes', 'residual', 'rigid')
# What a body that bends brings along itself.
_OWN = ('mass', 'density', 'centre_of_gravity_height', 'inertia', 'parts', 'embedment',
        'side_contact', 'young_modulus')


@dataclass(frozen=True)
class FlexibleEntries:
    """
    Builds foundations that bend and says at which key one was refused.

    Attributes
    ----------
    faults : Faults
        Of the case.
    files : dict of str to str
        Bodies that came with the document, and those that are built here for it.
    speed : float
        Highest of the rotor [rad/s].
    cache : Cache
        Where bodies lie that were reduced before.

    """

    faults: Faults
    files: dict[str, str]
    speed: float
    cache: Cache

    def foundation(
        self, index: int, entry: schema.FoundationEntry, below: Mapping[str, Foundation],
    ) -> Foundation:
        """Return one foundation on the ground or on those below, or raise an InputError."""
        flexible = entry.flexible
        assert flexible is not None
        given = next((key for key in _OWN if key in entry.model_fields_set
                      and getattr(entry, key) is not None), None)
        if given is not None:
            raise self.faults.error('foundations', index, given, problem=(
                'belongs to a rigid block; flexible brings its own'))
        body = self._body(index, entry.name, flexible)
        with self.faults.at('foundations', index, 'flexible', entry=flexible):
            body = self._on_ground(index, entry, body)
            self._refuse_few_modes(index, flexible, body)
        mass = body.mass_about_centre
        height = float(mass[0, 4] / mass[0, 0])
        moments = mass.diagonal()[3:] - mass[0, 0] * np.array([height**2, height**2, 0.0])
        about_x, about_y, about_z = np.maximum(moments, 0.0).tolist()
        with self.faults.at('foundations', index, entry=entry):
            alone = Foundation(
                name=entry.name, contact=_outline(entry, body), centre_x=entry.centre_x,
                centre_y=entry.centre_y or 0.0, mass=float(mass[0, 0]),
                centre_of_gravity_height=height, inertia=(about_x, about_y, about_z), body=body,
                height=_drawn_height(body) if entry.height is None else entry.height)
        block = StackEntries(self.faults).stood(index, entry, alone, below)
        x, y = self._centre(entry, body, block)
        return replace(block, centre_x=x, centre_y=y)

    def _body(self, index: int, name: str, entry: schema.FlexibleEntry) -> FlexibleBody:
        """Return the body: as it came with the document, out of the cache, or from its files."""
        by_modes = self._by_modes(index, entry)
        highest = entry.keep_up_to * self.speed
        asked = [highest, entry.model_dump()]
        # Machines of other speeds on the same foundation ask for other modes.
        told = f'flexible {name} {highest:.9g}'
        if told in self.files:
            stored = json.loads(self.files[told])
            if stored['asked'] == json.loads(json.dumps(asked)):
                return FlexibleBody.from_plain(stored['body'])
        paths = [self._path(getattr(entry, key)) for key in (_MODES if by_modes else _MATRICES)
                 + ('dofs',) * by_modes if getattr(entry, key) is not None]
        key = content_key('flexible', _ALGORITHM, asked, [_digest(path) for path in paths])
        kept = self.cache.load('flexible', key)
        if kept is not None:
            plain: dict[str, Any] = json.loads(str(kept['body']))
            body = FlexibleBody.from_plain(plain)
        else:
            with self.faults.at('foundations', index, 'flexible', entry=entry):
                body = self._of_files(entry, highest)
            self.cache.store('flexible', key, {'body': np.array(json.dumps(body.to_plain()))})
        self.files[told] = json.dumps({'asked': asked, 'body': body.to_plain()})
        return body

    def _by_modes(self, index: int, entry: schema.FlexibleEntry) -> bool:
        """Return whether modes are given, all that belongs to them included, or matrices."""
        place = ('foundations', index, 'flexible')
        both = [key for key in ('stiffness', 'modes') if getattr(entry, key) is not None]
        if len(both) != 1:
            raise self.faults.error(*place, problem=(
                'needs either stiffness, mass and dofs, or modes, residual and rigid, got '
                f'{"both" if both else "neither"}'))
        needed = _MODES if both == ['modes'] else _MATRICES
        unused = next((key for key in (*_MODES, *_MATRICES[:2]) if key not in needed
                       and getattr(entry, key) is not None), None)
        if unused is not None:
            raise self.faults.error(*place, unused, problem=(
                f'belongs to {"stiffness" if both == ["modes"] else "modes"}, got {both[0]}'))
        for key in needed:
            if getattr(entry, key) is None:
                raise self.faults.error(*place, key, problem='is missing' + (
                    '; without the residual flexibility 60 modes of a raft are still off by '
                    '38 %, with it 10 are by 0.8 %: let the program write it (RESVEC), or the '
                    'static flexibility at the interface less that of the modes'
                    if key == 'residual' else f'; {both[0]} needs it'))
        if (entry.loss_factor is None) is (entry.damping_ratios is None):
            raise self.faults.error(*place, problem=(
                'needs either loss_factor or damping_ratios, got '
                f'{"neither" if entry.loss_factor is None else "both"}'))
        if not LEAST_REACH <= entry.keep_up_to < math.inf:
            raise self.faults.error(*place, 'keep_up_to', problem=(
                f'must be >= {LEAST_REACH:g} times the highest 1X frequency, '
                f'got {entry.keep_up_to:g}'))
        return both == ['modes']

    def _path(self, file: str) -> Path:
        return self.faults.path.parent / file

    def _of_files(self, entry: schema.FlexibleEntry, highest: float) -> FlexibleBody:
        def at(file: str | None) -> Path | None:
            return None if file is None else self._path(file)

        loss = Loss(entry.loss_factor, entry.damping_ratios)
        modes, residual, rigid, dofs = map(
            at, (entry.modes, entry.residual, entry.rigid, entry.dofs))
        if modes is not None:
            assert residual is not None
            assert rigid is not None
            return of_modes(modes, residual=residual, rigid=rigid, dofs=dofs, loss=loss)
        stiffness, mass = at(entry.stiffness), at(entry.mass)
        assert stiffness is not None
        assert mass is not None
        assert dofs is not None
        return of_matrices(stiffness, mass=mass, dofs=dofs, highest=highest, loss=loss,
                           grounded=entry.grounded)

    def _on_ground(
        self, index: int, entry: schema.FoundationEntry, body: FlexibleBody,
    ) -> FlexibleBody:
        """Return the body with how the ground stands below it, fit for that."""
        model, under = self.faults.entries.support.model, entry.soil_under
        assert entry.flexible is not None
        place = ('foundations', index)
        if not len(body.contacts):
            raise self.faults.error(*place, 'flexible', 'dofs', problem=(
                'must have motions of kind contact, where the ground is'))
        if entry.flexible.grounded:
            if entry.on is not None:
                raise self.faults.error(*place, 'on', problem=(
                    'must not be given of a body that is grounded, which stands on firm ground'))
            return body
        rank = np.linalg.matrix_rank(body.about_centre[body.contacts])
        if rank < len(DOFS):
            raise self.faults.error(*place, 'flexible', 'dofs', problem=(
                'must have contacts that hold all six rigid motions, '
                f'got {rank}' + ('; one contact needs x, y, z, rx, ry, rz'
                                 if body.has_one_contact else '')))
        if entry.on is not None:
            return body if body.has_one_contact else self._patched(body, EACH)
        if body.has_one_contact:
            self._refuse_soft_contact(index, entry.flexible, body)
            if under is not None:
                raise self.faults.error(*place, 'soil_under', problem=(
                    f'belongs to several contacts, got {under} and one'))
            return body
        if under is None and model != 'rigid':
            raise self.faults.error(*place, 'soil_under', problem=(
                f'is missing: winkler, green or each, below {len(body.patches)} contacts'))
        outlined = entry.radius is not None or entry.half_width is not None
        if (not body.patches[0].area and model not in ('rigid', 'table')
                and (under == GREEN or (under == EACH and not outlined))):
            raise self.faults.error(*place, 'flexible', 'dofs', problem=(
                f'must say the area [m^2] of every contact below which soil_under is {under}'
                + ('' if under == GREEN else ', or the foundation its half_width and half_length')
            ))
        return self._patched(body, under or EACH)

    def _patched(self, body: FlexibleBody, under: str) -> FlexibleBody:
        """Return a body on several contacts, with those motions that the ground resists."""
        # Springs shared out by area, and even tractions, turn no patch.
        dofs = tuple(
            replace(dof, kind=PROBE) if under != EACH and dof.kind == CONTACT
            and dof.axis not in DOFS[:3] else dof for dof in body.dofs)
        return replace(body, dofs=dofs, bed=under)

    def _refuse_soft_contact(
        self, index: int, entry: schema.FlexibleEntry, body: FlexibleBody,
    ) -> None:
        lowest = math.sqrt(float(body.stiffness.min(initial=math.inf)))
        if (lowest < ABOVE_EXCITATION * self.speed and not entry.rigid_contact
                and self.faults.entries.support.model != 'rigid'):
            raise self.faults.error('foundations', index, 'flexible', problem=(
                f'stands on one contact and bends at {rad_s_to_hz(lowest):.4g} Hz, below '
                f'{ABOVE_EXCITATION:g} times the highest 1X frequency of '
                f'{rad_s_to_hz(self.speed):.4g} Hz: one mean contact under a raft is off by up '
                'to a factor of 12; divide it into patches, with soil_under, or say '
                'rigid_contact: true where its base does not bend, as below a frame'))

    def _refuse_few_modes(
        self, index: int, entry: schema.FlexibleEntry, body: FlexibleBody,
    ) -> None:
        if entry.modes is not None and body.reach < LEAST_REACH * self.speed:
            raise self.faults.error('foundations', index, 'flexible', 'modes', problem=(
                f'must reach {LEAST_REACH:g} times the highest 1X frequency, '
                f'{rad_s_to_hz(LEAST_REACH * self.speed):.4g} Hz, '
                f'got {rad_s_to_hz(body.reach):.4g} Hz'))

    def _centre(
        self, entry: schema.FoundationEntry, body: FlexibleBody, block: Foundation,
    ) -> tuple[float, float]:
        """Return where the contact is beside the shaft, after all seats were found on it."""
        if self.faults.under:
            # Among several machines seats bear their names, and places are those of the ground.
            return block.centre_x, block.centre_y
        x, y, seats = block.centre_x, block.centre_y, self._seats(entry, body, block.elevation)
        # Without a seat its own axes are those of the ground.
        mean = np.nanmean(np.array([gap for _, gap in seats] or [np.array(body.centre)]), axis=0)
        if block.on is None or not block.on.places:
            x = x if 'centre_x' in entry.model_fields_set else float(mean[0])
            y = float(mean[1]) if entry.centre_y is None else y
        for number, gap in seats:
            bearing = self.faults.entries.rotor.bearings[number]
            with self.faults.at('rotor', 'bearings', number, entry=bearing):
                require_on_shaft(bearing.seat or bearing.name, gap - np.array([x, y, 0.0]))
        return x, y

    def _seats(
        self, entry: schema.FoundationEntry, body: FlexibleBody, elevation: float,
    ) -> list[tuple[int, FloatArray]]:
        """Return which bearings stand on a body, each with the way from its seat to it, (3,)."""
        entries = self.faults.entries
        upright = entries.rotor.orientation == 'vertical'
        height = entries.rotor.shaft_height - elevation
        across = ('x', 'y') if upright else ACROSS
        own = {entry.name, None} if len(entries.foundations) == 1 else {entry.name}
        found = []
        for number, bearing in enumerate(entries.rotor.bearings):
            if bearing.foundation not in own:
                continue
            with self.faults.at('rotor', 'bearings', number, entry=bearing):
                seat = [body.seat(bearing.seat or bearing.name, axis) for axis in across][-1]
            here = [0.0, 0.0, height + bearing.position] if upright else [
                0.0, bearing.position, height]
            found.append((number, np.array(here) - (np.array(body.dofs[seat].place)
                                                    - body.centre)))
        return found


def require_on_shaft(seat: str, gap: FloatArray) -> None:
    """Raise a RotorSoilError where the way (3,) from a seat to its bearing [m] is long."""
    across, along, up = np.where(np.isfinite(gap), gap.round(4) + 0.0, 0.0).tolist()
    if math.hypot(across, along, up) > _OFF_SHAFT:
        raise RotorSoilError(
            f'seat must be on the shaft within {_OFF_SHAFT:g} m, got {across:g} m across, '
            f'{along:g} m along and {up:g} m up from {seat} to the bearing')


def _drawn_height(body: FlexibleBody) -> float | None:
    """Return how high a body is above its contact, by the highest probe; None without one."""
    highest = max((body.dofs[row].place[2] for row in body.of_kind(PROBE)), default=math.nan)
    above = highest - body.centre[2]
    return above if above > 0.0 else None


def _digest(path: Path) -> str:
    """Return what identifies what a file says; nothing of one that cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ''


def _outline(entry: schema.FoundationEntry, body: FlexibleBody) -> Contact:
    """Return the contact as a whole: given, or the rectangle of the same second moments."""
    if entry.radius is not None:
        return Circle(entry.radius)
    if entry.half_width is not None and entry.half_length is not None:
        return Rectangle(entry.half_width, entry.half_length)
    area = np.array([patch.area for patch in body.patches])
    places = np.array([patch.place[:2] for patch in body.patches]) - body.centre[:2]
    # Patches without an area are points: pictures show where they are, no ground asks for more.
    own = np.where(area > 0.0, area, 1.0)
    squares = own @ (places**2 + (area / 12.0)[:, None]) / own.sum()
    width, length = np.sqrt(3.0 * squares).tolist()
    least = 1e-3 + 0.05 * max(width, length)
    return Rectangle(max(width, least), max(length, least))
