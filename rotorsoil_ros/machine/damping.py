"""Where the damping comes from: bearings, pedestals, shaft, soil and radiation into it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray
from rotorsoil_ros.ground.neighbours import without_loss
from rotorsoil_ros.machine.continued import continued as continued_of
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.critical import CriticalSpeed
from rotorsoil_ros.machine.modes.names import BELOW
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.losses import WHIRL_DIRECTIONS
from rotorsoil_ros.rotor.whirl import ORBITS
from rotorsoil_ros.units import RADIANS_PER_TURN

BEARINGS, PEDESTALS, STRUCTURE, RADIATION, MATERIAL, SOIL = (
    'bearings', 'pedestals', 'foundation material', 'radiation', 'soil material', 'soil')
# By the shaft: its material, what stands around it, and the torque, which may give.
INTERNAL, EXTERNAL, TORQUE = 'shaft material', 'around the rotor', 'torque'
_OF_SHAFT = (INTERNAL, EXTERNAL, TORQUE)
DAMPERS = (BEARINGS, PEDESTALS, STRUCTURE, *_OF_SHAFT, RADIATION, MATERIAL, SOIL, BELOW)

# Above, a mode hardly swings before it is gone, and shares of its decay mean nothing.
LARGEST_DAMPING_RATIO = 0.7

# A share of less is nothing: round-off and the fit of the ground.
_NOTHING = 0.01


@dataclass(frozen=True)
class DampingSplit:
    """
    Work that each part takes out of a vibration, over n speeds or modes.

    Attributes
    ----------
    speed : (n,) float array
        Of the rotor [rad/s].
    parts : tuple of (str, str)
        What takes it, one of the words of this room, and the name of the bearing or block.
    work : (n, k) float array
        Of each part [J] per cycle; of a mode in proportion only. Negative where it feeds.

    """

    speed: FloatArray
    parts: tuple[tuple[str, str], ...]
    work: FloatArray

    @property
    def total(self) -> FloatArray:
        """All of it, (n,): what the unbalance puts in [J] per cycle."""
        return np.asarray(self.work.sum(axis=1))

    @property
    def power(self) -> FloatArray:
        """All of it over time, (n,) [W]."""
        return self.total * self.speed / RADIANS_PER_TURN

    @property
    def kinds(self) -> tuple[str, ...]:
        """What there is, in the order of the words of this room."""
        there = {kind for kind, _ in self.parts}
        return tuple(kind for kind in DAMPERS if kind in there)

    def share(self, kind: str, name: str | None = None) -> FloatArray:
        """Return the share of a kind, or of one of its parts, (n,) [-]; NaN where all is none."""
        own = [index for index, part in enumerate(self.parts)
               if part[0] == kind and name in (None, part[1])]
        with np.errstate(invalid='ignore', divide='ignore'):
            return np.asarray(self.work[:, own].sum(axis=1) / self.total)

    def where(self, holds: BoolArray) -> 'DampingSplit':
        """Return the same with NaN where it does not hold, (n,) bool."""
        return replace(self, work=np.where(holds[:, None], self.work, math.nan))

    def shares(self, row: int) -> dict[str, float | None]:
        """Return the share of every kind at one speed or mode; None where all is none."""
        found = {kind: float(self.share(kind)[row]) for kind in self.kinds}
        return {kind: share if math.isfinite(share) else None for kind, share in found.items()}

    def words(self, row: int) -> str:
        """Return how the damping of one speed or mode is divided, the largest share first."""
        shares = sorted(((float(self.share(kind)[row]), kind) for kind in self.kinds),
                        reverse=True)
        if not all(math.isfinite(share) for share, _ in shares):
            return 'none'
        return ', '.join(f'{kind} {share:.1%}' for share, kind in shares)


@dataclass(frozen=True)
class DampingSplitter:
    """
    Divides the damping of a machine.

    Attributes
    ----------
    model : CoupledModel
        The machine.

    Notes
    -----
    A force F on a motion u takes pi Im(u^H F) in a cycle. Radiation is what the soil would take
    at the same motion if its material lost nothing; the material takes the rest. Of a mode
    exp(i w t) the same sums, with dynamic stiffnesses at its own complex frequency, are the parts
    of its decay: the imaginary part of phi^H times the equation of motion. The force into the
    soil follows by equilibrium, so that no compliance is inverted for it.

    References
    ----------
    Theory manual, where the damping comes from.

    """

    model: CoupledModel

    @cached_property
    def _lossless(self) -> Support | None:
        """The same support on soil that loses nothing; None where no model knows of one."""
        support = self.model.support
        twins = [without_loss(model, block.contact) for model, block
                 in zip(support.soil_models, support.foundations, strict=False)]
        if not twins or any(twin is None for twin in twins):
            return None
        return replace(support, soil_models=tuple(twin for twin in twins if twin is not None))

    @property
    def _bending(self) -> list[Foundation]:
        return [block for block in self.model.foundations if block.body is not None]

    @cached_property
    def parts(self) -> tuple[tuple[str, str], ...]:
        """What may take energy, in the order of its columns."""
        bearings = self.model.all_bearings.each
        soil = (SOIL,) if self._lossless is None else (RADIATION, MATERIAL)
        return (*((BEARINGS, bearing.name) for bearing in bearings),
                *((PEDESTALS, bearing.name) for bearing in bearings
                  if bearing.pedestal is not None),
                *((STRUCTURE, block.name) for block in self._bending),
                *((kind, block.name) for kind in soil for block in self.model.foundations
                  if block.on is None),
                *((BELOW, 'table') for _ in range(self.model.support.table is not None)),
                *((_OF_SHAFT[index], name or 'rotor') for name, losing in zip(
                    self.model.machines, self._losing, strict=True) for index in losing))

    @cached_property
    def _losing(self) -> list[list[int]]:
        """Which of what a shaft may do each does."""
        every = [(False,) * len(_OF_SHAFT) if rotor.losses is None else rotor.losses.does
                 for rotor in self.model.rotors]
        return [[index for index, one in enumerate(does) if one] for does in every]

    def forced(self, speed: FloatArray, unbalance: ComplexArray) -> DampingSplit:
        """
        Divide what the unbalance puts in, exactly at every speed.

        Parameters
        ----------
        speed : (n,) float array
            Rotor speeds [rad/s].
        unbalance : (p,) complex array
            As `CoupledModel.unbalance_response`.

        """
        model, support = self.model, self.model.support
        found = model.unbalance_response(speed, unbalance)
        seats = [place for rotor in model.rotors
                 for place in model.channels.index(rotor.channels[0]) + np.arange(
                     4 * len(rotor.bearings))]
        pairs = (len(speed), len(seats) // 4, 2, 2)
        journal, housing = np.moveaxis(found.displacement[:, seats].reshape(pairs), 2, 0)
        through = found.force[:, seats].reshape(pairs)[:, :, 0]
        flat = housing.reshape(len(speed), -1)
        below = through.reshape(flat.shape) + speed[:, None] ** 2 * (flat @ support.housing_mass)
        deflection = np.einsum('nij,nj->ni', support.pedestals(speed), below)
        contacts = [] if support.table is not None else [
            model.channels.index(channel)
            for part in support.members for channel in part.contacts]
        motion, into_soil = (flat - deflection, below) if support.table is not None else (
            found.displacement[:, contacts], found.force[:, contacts])
        own, arriving = support.pedestal_axes, ((flat - deflection).conj() * below).imag
        taken = self._by_foundation(motion, into_soil).T
        structure = [arriving[:, list(part.seats)].sum(axis=1) - taken[index] + taken[list(
            support.above[index])].sum(axis=0) for index, (part, _) in enumerate(
                zip(support.members, support.foundations, strict=False))]
        radiated = None if self._lossless is None else _pushed(
            self._lossless.ground(speed), motion)
        all_taken = self._taken(journal - housing, through, deflection[:, own], below[:, own],
                                motion, into_soil, radiated, structure)
        lost = self._lost(speed, self._whirls(speed, unbalance, journal, through))
        return DampingSplit(speed, self.parts,
                            math.pi * np.concatenate([all_taken, lost], axis=1))

    def _whirls(
        self, speed: FloatArray, unbalance: ComplexArray, journal: ComplexArray,
        through: ComplexArray,
    ) -> list[ComplexArray]:
        """Return forward and backward motion of all nodes of every shaft, (2, n, 2 k) each."""
        model, found, first = self.model, list[ComplexArray](), 0
        for rotor, own in zip(model.rotors, model.own_speeds, strict=True):
            seats = slice(first, first + len(rotor.bearings))
            # Springs that lose a little hold the shaft, at no speed in resonance; what they
            # exert is taken off again.
            springs = rotor.nominal_springs * (1.0 + 0.5j)
            force = np.zeros((len(speed), 2 * len(rotor.node_positions), 2), dtype=complex)
            for bearing, exerted in zip(rotor.bearings, np.moveaxis(
                    springs[:, None] * journal[:, seats] - through[:, seats], 1, 0), strict=True):
                force[:, 2 * rotor.node_of(bearing.position)] += exerted
            if own is None:
                for port, load in zip(model.ports, (model.plane_forces @ unbalance).reshape(-1, 2),
                                      strict=True):
                    force[:, port] += speed[:, None] ** 2 * load
            found.append(_whirl(rotor, speed, _turns(own, speed), springs, force))
            first = seats.stop
        return found

    def _lost(
        self, speed: FloatArray, whirls: Sequence[ComplexArray], w: ComplexArray | None = None,
    ) -> FloatArray:
        """Return Im(u^H F) of what the shafts do, (n, d)."""
        found = [np.zeros((len(speed), 0))]
        for rotor, own, motions, losing in zip(
                self.model.rotors, self.model.own_speeds, whirls, self._losing, strict=True):
            if losing and rotor.losses is not None:
                exerted = [rotor.losses.exerted(
                    direction, motion, w=speed + 0j if w is None else w, speed=_turns(own, speed))
                    for direction, motion in zip(WHIRL_DIRECTIONS, motions, strict=True)]
                taken = (motions.conj()[:, None] * exerted).imag.sum(axis=(0, 3))
                found.append(taken[losing].T)
        return np.concatenate(found, axis=1)

    def of_modes(self, criticals: Sequence[CriticalSpeed]) -> list[DampingSplit | None]:
        """
        Divide the decay of the mode at every critical speed.

        None where it hardly swings, and where a passive part would give instead of take: so far
        from the real frequencies at which the ground was solved its continuation is not known.
        """
        swinging = [one for one in criticals
                    if abs(one.damping_ratio) <= LARGEST_DAMPING_RATIO]
        if not swinging:
            return [None] * len(criticals)
        highest = 1.2 * max(one.speed for one in swinging)
        span = self.model.support.known(highest)
        continued = None if self._lossless is None else continued_of(self._lossless, span)
        blocks = self.model.support.contacts
        found: list[DampingSplit | None] = []
        for one in criticals:
            if abs(one.damping_ratio) > LARGEST_DAMPING_RATIO:
                found.append(None)
                continue
            w = one.speed * (1.0 + 1j * one.damping_ratio / math.sqrt(
                1.0 - one.damping_ratio**2))
            compliance = None
            if continued is not None:
                size = continued.size[:blocks]
                compliance = (size[:, None] * size
                              * continued(np.array([w]))[:, :blocks, :blocks])
            split = self._of_mode(one, w, compliance)
            found.append(split if _is_passive(split) else None)
        return found

    def _of_mode(
        self, critical: CriticalSpeed, w: complex, lossless: ComplexArray | None,
    ) -> DampingSplit:
        model, support = self.model, self.model.support
        speed, blocks = np.array([critical.speed]), support.contacts
        shapes = model.in_order((critical.deflection, critical.slope), critical.beside)
        journals = np.concatenate([
            deflection[[rotor.node_of(bearing.position) for bearing in rotor.bearings]]
            for rotor, (deflection, _) in zip(model.rotors, shapes, strict=True)])
        pairs = (1, len(journals), 2)
        gap = journals.ravel() - support.motion_rows @ critical.support
        stiffness, damping, inertia = (part[0] for part in model.all_bearings.coefficients(
            speed, speed))
        through = (stiffness + 1j * w * damping - w**2 * inertia) @ gap
        pressed = support.motion_spring @ critical.support
        below = (support.motion_rows.T @ through - pressed
                 + w**2 * (support.motion_mass @ critical.support))[None]
        bent = [np.vdot(critical.support, spring @ critical.support).imag
                for spring in support.bent_springs]
        axes = slice(blocks, blocks + len(support.pedestal_axes))
        motion = critical.support[None, :blocks]
        radiated = None if lossless is None else _pushed(lossless, motion)
        taken = self._taken(
            gap.reshape(pairs), through.reshape(pairs), critical.support[None, axes],
            below[:, axes], motion, below[:, :blocks], radiated,
            [np.array([one]) for one in bent])
        whirls = [(np.stack(shape, axis=1).reshape(-1, 2) @ ORBITS.conj().T).T[:, None]
                  for shape in shapes]
        lost = self._lost(speed, whirls, np.array([w]))
        return DampingSplit(speed, self.parts, np.concatenate([taken, lost], axis=1))

    def _taken(
        self, gap: ComplexArray, through: ComplexArray, deflection: ComplexArray,
        below: ComplexArray, motion: ComplexArray, into_soil: ComplexArray,
        radiated: ComplexArray | None, structure: Sequence[FloatArray],
    ) -> FloatArray:
        """Return Im(u^H F) of every part, (n, k); structure is that of each foundation."""
        rows = len(gap)
        films = (gap.conj() * through).imag.sum(axis=2)
        springs = (deflection.conj() * below).imag.reshape(rows, -1, 2).sum(axis=2)
        bends = [taken[:, None] for taken, block in zip(
            structure, self.model.foundations, strict=False) if block.body is not None]
        higher = [index for above in self.model.support.above for index in above]
        grounded = np.setdiff1d(np.arange(len(self.model.support.members)), higher)
        soil = self._by_foundation(motion, into_soil)[:, grounded]
        if radiated is None:
            return np.concatenate([films, springs, *bends, soil], axis=1)
        waves = self._by_foundation(motion, radiated)[:, grounded]
        return np.concatenate([films, springs, *bends, waves, soil - waves], axis=1)

    def _by_foundation(self, motion: ComplexArray, force: ComplexArray) -> FloatArray:
        """Return Im(u^H F) of the contacts of each foundation, (n, f)."""
        ends = np.cumsum([len(part.contacts) for part in self.model.support.members], dtype=int)
        parts = np.split((motion.conj() * force).imag, ends[:-1], axis=1) if len(ends) else []
        return np.stack([part.sum(axis=1) for part in parts], axis=1) if parts else (
            np.zeros((len(motion), 0)))


def _turns(own: float | None, speed: FloatArray) -> FloatArray:
    """Return the speeds of a shaft, (n,) [rad/s]; without one of its own those asked about."""
    return speed if own is None else np.full(len(speed), own)


def _whirl(
    rotor: Rotor, omega: FloatArray, turns: FloatArray, springs: ComplexArray,
    force: ComplexArray,
) -> ComplexArray:
    """
    Return forward and backward motion of a lossy shaft on springs, (2, n, 2 k).

    Under forces over (x, z) of its rows, (n, 2 k, 2), at frequencies and rotor speeds (n,)
    [rad/s]; nothing of a shaft that loses nothing.
    """
    if (losses := rotor.losses) is None:
        return np.zeros((2, len(omega), 0), dtype=complex)
    stiffness, mass, polar = rotor.plane_matrices
    rows = [2 * rotor.node_of(bearing.position) for bearing in rotor.bearings]
    w, speed = omega[:, None, None], turns[:, None, None]
    found = []
    for direction, orbit in zip(WHIRL_DIRECTIONS, ORBITS.conj(), strict=True):
        lag = np.sign(w - speed) * (direction > 0)
        dynamic = (stiffness + losses.held(direction, speed=0.0, lag=0.0)
                   + speed * losses.turning(direction) + 1j * lag * losses.hysteretic
                   + w * losses.rate(direction) - w**2 * mass + direction * w * speed * polar)
        for row, spring in zip(rows, springs, strict=True):
            dynamic[:, row, row] += spring
        found.append(np.linalg.solve(dynamic, (force @ orbit)[..., None])[..., 0])
    return np.array(found)


def _is_passive(split: DampingSplit) -> bool:
    """Return whether soil and its material only take; bearings may give."""
    taken = [split.share(kind) for kind in split.kinds
             if kind in (RADIATION, MATERIAL, SOIL, BELOW)]
    return all(share[0] >= -_NOTHING for share in taken if math.isfinite(share[0]))


def _pushed(compliance: ComplexArray, motion: ComplexArray) -> ComplexArray:
    """Return the force of blocks that move on ground of a compliance, (n, 6 f)."""
    # Rigid ground is a compliance of zero: what cannot move takes no work.
    free = np.flatnonzero(compliance.diagonal(axis1=1, axis2=2).any(axis=0))
    force = np.zeros(motion.shape, dtype=complex)
    force[:, free] = np.linalg.solve(
        compliance[:, free[:, None], free], motion[:, free, None])[..., 0]
    return force
