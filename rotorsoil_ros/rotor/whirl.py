"""How the turning rotor on plain springs answers a force, at any speed at once."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import AnyArray, BoolArray, ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.losses import receding, WHIRL_DIRECTIONS
from rotorsoil_ros.rotor.projection import shapes_at_ports

# A mode whose dynamic stiffness fell below this share of its static one is kept out of the sum
# and solved for: dividing by it would cost as many digits as the share has zeros.
_NEAR_POLE = 1e-3

# Modes this far above the excitation, as a ratio of squared frequencies or, at fixed speed, of
# frequencies, are summed once as a power series; so many terms leave less than round-off.
_FAR = 16.0
_TERMS = 13

_LOOSE = ('the shaft on its bearings is not stiff in every direction: its modes cannot be '
          'found')

# Orbit of a unit whirl over (x, z): forward turns with the spin, from z into x.
ORBITS = np.array([[-1j, 1.0], [1j, 1.0]]) / np.sqrt(2.0)


@dataclass(frozen=True, slots=True)
class WhirlModes:
    """
    Forward and backward whirl modes of a rotor on isotropic springs, at chosen ports.

    With omega = order * speed the rotor's matrices depend on omega^2 alone: in forward whirl
    K0 - omega^2 (M - J / order), in backward whirl K0 - omega^2 (M + J / order), where J is
    the polar inertia. Two real symmetric eigenproblems therefore serve every speed. At fixed
    speed they are K0 - omega^2 M +- omega speed J, and one problem of twice the size serves
    every omega. A rotor that loses energy has complex modes, the ones that resonate and the ones
    that are driven differ, and two problems of twice the size serve either purpose.

    Attributes
    ----------
    inverse : (2, m) float or complex array
        1 / omega_k^power of forward and backward modes; negative where it is no resonance.
    shapes : (2, p, m) float or complex array
        Their shapes at the ports, normalised to unit energy.
    driven : (2, p, m) float or complex array
        How much a force at each port drives them: the same where nothing is lost.
    power : int
        2 where speed follows omega and nothing is lost, else 1.

    References
    ----------
    Lalanne & Ferraris (1998), ch. 2, for the whirling directions of a symmetric rotor.

    """

    inverse: AnyArray
    shapes: AnyArray
    driven: AnyArray
    power: int

    @classmethod
    def of(
        cls, rotor: Rotor, ports: list[int], *, springs: FloatArray, order: float,
    ) -> 'WhirlModes':
        """
        Solve for the modes at omega = order * speed.

        Parameters
        ----------
        rotor : Rotor
            Shaft and discs.
        ports : list of int
            Rows of the plane matrices at which forces act or motion is wanted.
        springs : (b,) float array
            Isotropic stiffness put in place of each bearing [N/m].
        order : float
            Excitation frequency over speed.

        """
        stiffness, mass, polar = held(rotor, springs)
        if rotor.losses is not None:
            return cls._lossy(rotor, ports, springs, [
                (*rotor.losses.following(direction, order=order), mass - direction / order * polar)
                for direction in WHIRL_DIRECTIONS])
        pairs = [_modes(mass - direction / order * polar, stiffness)
                 for direction in WHIRL_DIRECTIONS]
        shapes = np.array([own[ports] for _, own in pairs])
        return cls(np.array([values for values, _ in pairs]), shapes, shapes, 2)

    @classmethod
    def at(
        cls, rotor: Rotor, ports: list[int], *, springs: FloatArray, speed: float,
        highest: float, lag: float = 0.0,
    ) -> 'WhirlModes':
        """
        Solve for the modes at fixed speed.

        Parameters
        ----------
        rotor, ports, springs
            As in `of`.
        speed : float
            Of the rotor [rad/s].
        highest : float
            Frequency up to which the receptance is wanted [rad/s]: of many elements no more
            shapes are kept than it takes.
        lag : float
            Sign of the frequencies less the speed.

        """
        matrices = held(rotor, springs)
        if rotor.losses is not None:
            _, mass, polar = matrices
            return cls._lossy(rotor, ports, springs, [
                (rotor.losses.held(direction, speed=speed, lag=lag),
                 rotor.losses.rate(direction) + direction * speed * polar, mass)
                for direction in WHIRL_DIRECTIONS])
        try:
            basis = shapes_at_ports(*matrices, ports, highest=highest, speed=speed)
        except np.linalg.LinAlgError as error:
            raise NotSolvedError(_LOOSE) from error
        stiffness, mass, polar = (basis.T @ matrix @ basis for matrix in matrices)
        squares, rest = _modes(mass, stiffness)
        inverse, vectors = np.linalg.eigh(
            spinning(np.maximum(squares, 0.0), rest.T @ polar @ rest, np.array([speed])))
        shapes = basis[ports] @ rest @ vectors[0, :len(rest)]
        both = np.array([shapes, shapes])
        return cls(np.array([inverse[0], -inverse[0]]), both, both, 1)

    @classmethod
    def _lossy(
        cls, rotor: Rotor, ports: list[int], springs: FloatArray,
        added: list[tuple[ComplexArray, ComplexArray, FloatArray]],
    ) -> 'WhirlModes':
        """Solve for the modes with what adds to stiffness and rate of each direction, and mass."""
        stiffness, mass, _ = held(rotor, springs)
        # Over the modes at rest all entries are alike, which deflections and slopes are not.
        squares, rest = _modes(mass, stiffness)
        one = np.eye(len(rest))
        found = [receding(one + rest.T @ more @ rest, rest.T @ rate @ rest,
                          rest.T @ weight @ rest, float(squares.max() ** -0.5))
                 for more, rate, weight in added]
        return cls(np.array([inverse for inverse, _, _ in found]),
                   np.array([rest[ports] @ right for _, right, _ in found]),
                   np.array([rest[ports] @ left.T for _, _, left in found]), 1)

    def receptance(self, omega: FloatArray) -> 'PortReceptance':
        """
        Return the receptance between all ports.

        Parameters
        ----------
        omega : (n,) float array
            Excitation frequency [rad/s].

        """
        argument = omega**self.power
        scale = np.abs(argument).max(initial=np.finfo(float).tiny)
        close = np.abs(self.inverse) * scale * _FAR > 1.0
        directions, indices = np.nonzero(close)
        stiffness = 1.0 - argument[:, None] * self.inverse[close]
        size = np.abs(stiffness)
        near = int((size < _NEAR_POLE).sum(axis=1).max(initial=0))
        nearest = np.argsort(size, axis=1)[:, :near]
        gain = 1.0 / np.where(size < np.finfo(float).tiny, 1.0, stiffness)
        np.put_along_axis(gain, nearest, 0.0, axis=1)
        shapes, driven = (own[directions, :, indices] for own in (self.shapes, self.driven))
        powers = np.vander(argument / scale, _TERMS, increasing=True)
        receptances = np.stack([
            powers @ self._series(direction, ~close[direction], scale)
            + gain[:, directions == direction] @ _products(
                shapes[directions == direction], driven[directions == direction])
            for direction in (0, 1)])
        ports = self.shapes.shape[1]
        whirls, forced = ((own[:, :, None] * orbits[directions, None]).reshape(-1, 2 * ports)
                          for own, orbits in ((shapes, ORBITS), (driven, ORBITS.conj())))
        return PortReceptance(receptances.reshape(2, len(omega), ports, ports),
                              whirls[nearest].transpose(0, 2, 1), forced[nearest],
                              np.take_along_axis(stiffness, nearest, axis=1))

    def _series(self, direction: int, far: BoolArray, scale: float) -> ComplexArray:
        """Return the receptance of far modes as a power series, (terms, p^2)."""
        ratio = scale * self.inverse[direction, far]
        powers = np.vander(ratio, _TERMS, increasing=True)
        return np.asarray(powers.T @ _products(self.shapes[direction][:, far].T,
                                               self.driven[direction][:, far].T))


def _modes(mass: FloatArray, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return 1 / omega^2 and the shapes of all modes, of unit strain energy."""
    try:
        inverse, shapes = scipy.linalg.eigh(mass, stiffness)
    except scipy.linalg.LinAlgError as error:
        raise NotSolvedError(_LOOSE) from error
    return inverse, shapes


@dataclass(frozen=True, slots=True)
class PortReceptance:
    """
    Receptance of the rotor on its springs: a regular part and the modes close to resonance.

    The motion under port forces F is X = regular F + shapes p, where the amplitudes p of the
    nearly resonant modes obey stiffness p = driven F.

    Attributes
    ----------
    regular : (2, n, p, p) float or complex array
        Receptance of all other modes in forward and in backward whirl [m/N].
    shapes : (n, 2 p, k) complex array
        Shapes of the k modes kept apart, over (x, z) of each port.
    driven : (n, k, 2 p) complex array
        How much forces over (x, z) of each port drive them.
    stiffness : (n, k) float or complex array
        Their dynamic stiffness, 1 - omega^2 / omega_k^2; it may be zero.

    """

    regular: AnyArray
    shapes: ComplexArray
    driven: ComplexArray
    stiffness: AnyArray

    def motion(self, forces: ComplexArray) -> ComplexArray:
        """
        Return the motion of all ports by the regular part.

        Parameters
        ----------
        forces : (n, 2 q, k) or (2 q, k) complex array
            Over (x, z) of the first q ports [N].

        Returns
        -------
        (n, 2 p, k) complex array
            Over (x, z) of each port [m].

        """
        _, length, ports, _ = self.regular.shape
        count, columns = forces.shape[-2] // 2, forces.shape[-1]
        # One set of forces for all frequencies, or one for each.
        sets = forces.shape[0] if forces.ndim == 3 else 1
        turned = (forces.reshape(sets, count, 2, columns).swapaxes(1, 2).reshape(sets, 2, -1)
                  .swapaxes(0, 1).reshape(2, -1))
        whirls = (ORBITS.conj() @ turned).reshape(2, sets, count, columns)
        if np.iscomplexobj(self.regular):
            answers = (self.regular[..., :count] @ whirls).reshape(2, -1)
        else:
            # Real, as nothing is lost: as pairs of real numbers it needs no complex copy.
            pairs = self.regular[..., :count] @ whirls.view(float)
            answers = pairs.view(complex).reshape(2, -1)
        motion = (ORBITS.T @ answers).reshape(2, length, ports, columns)
        return np.asarray(np.moveaxis(motion, 0, 2).reshape(length, 2 * ports, columns))

    def between(self, count: int) -> ComplexArray:
        """Return the regular receptance between the first ports, (n, 2 q, 2 q)."""
        forward, backward = self.regular[..., :count, :count]
        total = np.empty((len(forward), count, 2, count, 2), dtype=complex)
        total[:, :, 0, :, 0] = total[:, :, 1, :, 1] = 0.5 * (forward + backward)
        total[:, :, 0, :, 1] = -0.5j * (forward - backward)
        total[:, :, 1, :, 0] = 0.5j * (forward - backward)
        return total.reshape(-1, 2 * count, 2 * count)


def _products(shapes: ComplexArray, driven: ComplexArray) -> ComplexArray:
    """Return the products of two values of each mode at two ports, (m, p) to (m, p^2)."""
    return (shapes[:, :, None] * driven[:, None]).reshape(-1, shapes.shape[1] ** 2)


def held(rotor: Rotor, springs: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return stiffness, mass and polar inertia in one plane, springs in place of bearings."""
    stiffness, mass, polar = rotor.plane_matrices
    stiffness = stiffness.copy()
    for bearing, spring in zip(rotor.bearings, springs, strict=True):
        row = 2 * rotor.node_of(bearing.position)
        stiffness[row, row] += spring
    return stiffness, mass, polar


def spinning(mass: FloatArray, polar: FloatArray, speed: FloatArray) -> FloatArray:
    """
    Return the symmetric matrix whose eigenvalues are 1 / omega of forward whirl.

    Parameters
    ----------
    mass : (r,) float array
        Diagonal of the mass matrix in coordinates of unit stiffness [s^2].
    polar : (r, r) float array
        Polar inertia in them [s^2].
    speed : (n,) float array
        Fixed rotor speeds [rad/s].

    Returns
    -------
    (n, 2 r, 2 r) float array
        With b = omega sqrt(m) a the problem (1 + omega speed J - omega^2 m) a = 0 is symmetric
        and linear in 1 / omega, whatever has no mass.

    """
    count = len(mass)
    matrix = np.zeros((len(speed), 2 * count, 2 * count))
    matrix[:, :count, :count] = -speed[:, None, None] * polar
    matrix[:, range(count), range(count, 2 * count)] = np.sqrt(mass)
    matrix[:, range(count, 2 * count), range(count)] = np.sqrt(mass)
    return matrix
