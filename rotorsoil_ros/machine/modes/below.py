"""How a support vibrates without the rotors, and follows them: its modes, and what bends."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.ground.continuation import Continuation
from rotorsoil_ros.machine.support import Support

# Poles of the soil that weigh less are noise of its fit.
_NOISE = 1e-4

# All is expanded about this share of the highest frequency, which grows faster than anything
# passive: so an inverse exists even without any mass or static stiffness.
_CENTRE = -0.1j

# Modes within so many times the highest frequency from half of it are told one by one; the sum
# of others lies on a line between zero and that frequency.
_MIDDLE, _KEPT = 0.5, 1.25

# Share of the largest mass below which a motion has none.
_MASSLESS = 1e-12

# What hardly has a frequency of its own relative to the highest, as 1 / w: it has no memory.
_INSTANT = 1e-9


@dataclass(frozen=True)
class SupportModes:
    """
    Motion of a support by forces at the housings.

    Attributes
    ----------
    frequency : (k,) complex array
        w = lambda / i of its modes up to some times the highest frequency that is looked at.
    weight : (k,) complex array
        1 / (w - centre) of each.
    centre : complex
        About which the sums are expanded [rad/s].
    shape : (s, k) complex array
        Their shapes over the motions of the support, in units of their size.
    driven : (k, 2 b) complex array
        How much forces at the housings drive each.
    static, rate : (s, 2 b) complex arrays
        What all others move per force at the frequency zero, and that per frequency.
    rows : (2 b, s) float array
        Motion of the housings per motion of the support.

    Notes
    -----
    The soil's compliance without mass is constant + left (w - poles)^-1 right, so that motion z,
    its rate and the states of the soil obey (A - w B) y = F f, and

        z = sum of shape driven f / (1 - (w - centre) weight) + (static + w rate) f.

    """

    frequency: ComplexArray
    weight: ComplexArray
    centre: complex
    shape: ComplexArray
    driven: ComplexArray
    static: ComplexArray
    rate: ComplexArray
    rows: FloatArray

    @classmethod
    def of(
        cls, support: Support, compliance: Continuation, highest: float, *,
        rows: FloatArray, carried: FloatArray | None = None, rough: bool = False,
    ) -> 'SupportModes':
        """
        Solve for them.

        Parameters
        ----------
        support : Support
            What stands on the ground.
        compliance : Continuation
            That of its ground and pedestals.
        highest : float
            Frequency that is looked at [rad/s].
        rows : (2 b, s) float array
            Motion of the housings per motion of the support, in units of its size.
        carried : (2 b, 2 b) float array or None
            Mass that rides on the housings, over these rows.
        rough : bool
            Whether only guesses are wanted, of what other fits to the ground say too.

        """
        fit = compliance.rough if rough else compliance
        a, b, force = _states(support, fit, highest, rows, carried)
        own, centre = len(support.motion_mass), _CENTRE * highest
        memory = np.flatnonzero(b.any(axis=0))
        both = np.linalg.solve(a - centre * b, np.concatenate([b[:, memory], force], axis=1))
        spread, pushed = both[:, :len(memory)], both[:, len(memory):]
        # y = pushed f + (w - centre) spread y', and of what has a memory y' = V (...) V^-1 y'.
        values, vectors = np.linalg.eig(spread[memory])
        driven, shape = np.linalg.solve(vectors, pushed[memory]), spread[:own] @ vectors
        w = centre + 1.0 / np.where(values == 0.0, np.inf, values)
        kept = np.abs(values) * highest > _INSTANT
        kept &= np.abs(w - _MIDDLE * highest) < _KEPT * highest
        if fit is not compliance:  # what is of that fit alone is no guess
            kept[kept] = compliance.persists(w[kept])
        # (w - centre) / (1 - (w - centre) mu) = 1 / mu (1 / (1 - (w - centre) mu) - 1).
        slow = shape[:, kept] / values[kept]
        ends = np.array([0.0, highest])[:, None] - centre
        gains = ends / (1.0 - ends * values[~kept])
        low, high = (shape[:, ~kept] * gain @ driven[~kept] for gain in gains)
        return cls(w[kept], values[kept], centre, slow, driven[kept],
                   pushed[:own] - slow @ driven[kept] + low, (high - low) / highest, rows)


def sizes(support: Support, compliance: Continuation) -> FloatArray:
    """Return the typical size of every motion of a support, (s,)."""
    return np.append(compliance.size, np.ones(support.elastic))


def _states(
    support: Support, compliance: Continuation, highest: float, rows: FloatArray,
    carried: FloatArray | None,
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """
    Return A, B and F of (A - w B) y = F f, over motion, its rate and the states of the soil.

    z = constant p + left xi, w xi = poles xi + right p, p = f + (w^2 M - K) z, w z = unit u, the
    rate u of what has mass alone.
    """
    soil = compliance.states(_NOISE).beside(np.ones(support.elastic) + 0j)
    size = sizes(support, compliance)
    mass = size[:, None] * support.motion_mass * size
    if carried is not None:
        mass = mass + rows.T @ carried @ rows
    spring = size[:, None] * support.motion_spring * size
    own, states, unit = len(mass), len(soil.poles), 0.5 * highest
    # A rate of what has no mass would be a double eigenvalue with one vector.
    heavy, axes = np.linalg.eigh(mass)
    axes = axes[:, heavy > _MASSLESS * heavy.max(initial=0.0)]
    rates, inertia = axes.shape[1], mass @ axes
    a = np.zeros((own + rates + states,) * 2, dtype=complex)
    b = np.zeros_like(a)
    motion, rate, state = slice(0, own), slice(own, own + rates), slice(own + rates, None)
    a[motion, motion], a[motion, state] = np.eye(own) + soil.constant @ spring, -soil.left
    b[motion, rate] = unit * soil.constant @ inertia
    a[rate, rate], b[rate, motion] = unit * np.eye(rates), axes.T
    a[state, motion], a[state, state] = -soil.right @ spring, np.diag(soil.poles)
    b[state, rate], b[state, state] = -unit * soil.right @ inertia, np.eye(states)
    force = np.concatenate([soil.constant @ rows.T, np.zeros((rates, len(rows))),
                            -soil.right @ rows.T])
    return a, b, force


@dataclass(frozen=True)
class Elastic:
    """
    Coordinates y of foundations that bend, each on a spring of one and by itself, as `parted`.

    They obey (1 - w^2 m) y = E^T f + w^2 M^T z, with f the force through the bearings and z the
    motion of the support otherwise, so that they need not be unknowns.

    Attributes
    ----------
    rows : (2 b, e) complex array
        E, housing motion per each.
    coupling : (s, e) complex array
        M, mass between each and the motion of the support.
    mass : (e,) complex array
        m of each.

    """

    rows: ComplexArray
    coupling: ComplexArray
    mass: ComplexArray

    def gains(self, frequency: ComplexArray) -> ComplexArray:
        """Return what each moves per force, (n, p, e)."""
        return np.asarray(1.0 / (1.0 - frequency[..., None] ** 2 * self.mass))

    def follows(
        self, frequency: ComplexArray,
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """
        Return what they add at complex frequencies (n, p) [rad/s].

        Housing motion per force (n, p, 2 b, 2 b) and per motion of the support (n, p, 2 b, s),
        and dynamic mass of that motion, (n, p, s, s).
        """
        gains, square = self.gains(frequency)[..., None, :], frequency[..., None, None] ** 2
        driven = self.rows * gains
        return (driven @ self.rows.T, square * (driven @ self.coupling.T),
                square * ((self.coupling * gains) @ self.coupling.T))

    def motion(
        self, frequency: ComplexArray, through: ComplexArray, support: ComplexArray,
    ) -> ComplexArray:
        """Return the coordinates under forces (n, p, 2 b) and motions (n, p, s), (n, p, e)."""
        force = through @ self.rows + frequency[..., None] ** 2 * (support @ self.coupling)
        return self.gains(frequency) * force


def parted(support: Support) -> ComplexArray:
    """
    Return the motion of a support per coordinates of which no elastic one is tied to another.

    By columns T, (s, s), the elastic ones last: T^T K T has ones for these and nothing beside
    them, T^T M T is diagonal among them. Bodies of unlike loss make all that complex.
    """
    own, size = len(support.motion_mass) - support.elastic, len(support.motion_mass)
    bends, rest = slice(own, size), slice(0, own)
    # With the unit springs, which belong to the compliance otherwise.
    tied = support.motion_spring[bends, rest]
    spring = support.motion_spring[bends, bends] + np.eye(support.elastic)
    mass, axes = np.linalg.eigh(support.motion_mass[bends, bends])
    mass[mass < _MASSLESS * mass.max(initial=0.0)] = 0.0
    held = axes.T @ spring @ axes
    _, shapes = np.linalg.eig(np.linalg.solve(held, np.diag(mass)))
    # Those of one frequency, and of no mass, may still be tied to each other.
    scale = scipy.linalg.sqrtm(shapes.T @ held @ shapes)
    turn = np.eye(size, dtype=complex)
    turn[bends, rest] = -np.linalg.solve(spring, tied)
    turn[bends, bends] = axes @ np.linalg.solve(scale.T, shapes.T).T
    return turn
