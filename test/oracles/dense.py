"""What the plain assembled system says: the oracle of the fast solves."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.machine.coupled import CoupledModel, UNBALANCE_FORCE
from rotorsoil_ros.prediction import Prediction, Response
from rotorsoil_ros.rotor.assembly import Rotor


def rotor_matrices(rotor: Rotor) -> tuple[FloatArray, FloatArray, FloatArray]:
    """
    Return stiffness, mass and gyroscopic matrices of shaft and discs.

    Returns
    -------
    three (4 k, 4 k) float arrays
        Over (x, z, rx, rz) of every node; the gyroscopic matrix is per unit speed [kg m^2].

    References
    ----------
    Lalanne & Ferraris (1998), eqs. of ch. 1 and 2: damping is C + Omega G.

    """
    stiffness, mass, polar = rotor.plane_matrices
    return alike(rotor, stiffness), alike(rotor, mass), across(rotor, polar)


def planes(rotor: Rotor) -> tuple[FloatArray, FloatArray]:
    """Return plane dofs (deflection, slope) in node dofs: x and -rz, z and +rx."""
    count = np.eye(len(rotor.node_positions))
    return (np.kron(count, np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0]])),
            np.kron(count, np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]])))


def alike(rotor: Rotor, plane: FloatArray) -> FloatArray:
    """Return a matrix that is the same in both planes, over all dofs."""
    in_x, in_z = planes(rotor)
    return np.asarray(in_x.T @ plane @ in_x + in_z.T @ plane @ in_z)


def across(rotor: Rotor, plane: FloatArray) -> FloatArray:
    """Return a matrix by which x acts on z, and z on x with the other sign, over all dofs."""
    in_x, in_z = planes(rotor)
    return np.asarray(in_z.T @ plane @ in_x - in_x.T @ plane @ in_z)


def shaft_forces(rotor: Rotor, omega: FloatArray, speed: FloatArray) -> ComplexArray:
    """
    Return what the shaft exerts besides stiffness and mass, (n, 4 k, 4 k).

    Notes
    -----
    The material loses in the frame of the rotor: on z + i x it exerts V (d/dt - i Omega) of it,
    and H i sign(w - Omega) of its forward, H i of its backward part. The torque T exerts
    T B x on z and -T B z on x.

    """
    losses = rotor.losses
    if losses is None:
        return np.zeros((len(omega), *2 * (4 * len(rotor.node_positions),)), dtype=complex)
    w, turn = omega[:, None, None], speed[:, None, None]
    sign = np.sign(w - turn)
    return np.asarray(
        1j * w * alike(rotor, losses.viscous + losses.fixed)
        + turn * across(rotor, losses.viscous) + across(rotor, losses.torsion)
        + 1j * w * across(rotor, losses.coupled)
        + 0.5j * (1.0 + sign) * alike(rotor, losses.hysteretic)
        + 0.5 * (1.0 - sign) * across(rotor, losses.hysteretic))


def dense_response(
    model: CoupledModel, speed: FloatArray, unbalance: ComplexArray,
) -> Prediction:
    """
    Solve for the response to unbalance as `CoupledModel.unbalance_response` does.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    speed : (n,) float array
        Rotor speed [rad/s].
    unbalance : (p,) complex array
        moment * exp(i phase) of every disc [kg m], then of couples [kg m^2].

    """
    rotor = model.rotor
    places = {disc.name: 4 * rotor.node_of(disc.position) for disc in rotor.discs}
    system = _System.of(model, speed, speed)
    load = np.zeros(system.matrix.shape[:2], dtype=complex)
    square = speed[:, None] ** 2
    for disc, moment in zip(rotor.discs, unbalance, strict=False):
        node = places[disc.name]
        load[:, node:node + 2] += moment * square * UNBALANCE_FORCE
    for name, couple in zip(model.couples, unbalance[len(rotor.discs):], strict=True):
        # Forces F and -F an arm d apart along y exert M = r x F = d (F_z, 0, -F_x).
        x, z = UNBALANCE_FORCE * couple
        load[:, places[name] + 2:places[name] + 4] += square * np.array([z, -x])
    return Prediction(speed, *system.solve(load))


def dense_forced(
    model: CoupledModel, omega: FloatArray, speed: FloatArray, channel: str,
) -> Response:
    """
    Solve for the response to a unit force at a channel.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    omega, speed : (n,) float arrays
        Excitation frequency and rotor speed [rad/s].
    channel : str
        Where the force acts; a housing needs a pedestal of its own.

    """
    system = _System.of(model, omega, speed)
    # A unit force does unit work on the motion that it drives.
    place = system.channels[model.channels.index(channel)]
    load = np.repeat(place[None].astype(complex), len(omega), axis=0)
    blocks = slice(system.rotor_size, system.rotor_size + 6 * len(model.foundations))
    load[:, blocks] = (system.compliances @ load[:, blocks, None])[..., 0]
    displacement, force = system.solve(load)
    first = 4 * len(model.rotor.bearings) + 2 * (len(model.rotor.discs) + len(model.rotor.probes))
    force[:, first:] += place[blocks]
    return Response(model.channels, speed, omega, displacement, force)


def dense_eigenvalues(
    model: CoupledModel, speed: float, *, stiffness: FloatArray, damping: FloatArray,
) -> ComplexArray:
    """
    Return all eigenvalues that vibrate, of a support of springs and dashpots.

    Parameters
    ----------
    model : CoupledModel
        The machine; its soil models are not asked.
    speed : float
        Rotor speed [rad/s].
    stiffness, damping : (s, s) float array
        Of the support over `Support.motion_rows`: springs [N/m], dashpots [N s/m].

    Returns
    -------
    (m,) complex array
        lambda with positive imaginary part, rising with it [rad/s].

    """
    rotor, support = model.rotor, model.support
    shaft, mass, gyroscopic = rotor_matrices(rotor)
    journals = _System.journals_of(rotor)
    relative = np.concatenate([journals, -support.motion_rows], axis=1)
    springs, dampers, inertia = (part[0] for part in model.bearings.coefficients(
        *2 * (np.array([speed]),)))
    if rotor.losses is not None:
        held = shaft_forces(rotor, np.zeros(1), np.array([speed]))[0]
        rate = shaft_forces(rotor, np.ones(1), np.array([speed]))[0] - held
        shaft, gyroscopic = shaft + held, gyroscopic + rate / (1j * speed)
    k = scipy.linalg.block_diag(shaft, stiffness) + relative.T @ springs @ relative
    c = scipy.linalg.block_diag(speed * gyroscopic, damping) + relative.T @ dampers @ relative
    m = scipy.linalg.block_diag(mass, support.motion_mass) + relative.T @ inertia @ relative
    return eigenvalues_of(k, c, m)


def eigenvalues_of(k: FloatArray, c: FloatArray, m: FloatArray) -> ComplexArray:
    """Return lambda with positive imaginary part of stiffness, damping and mass, rising."""
    # In units of time in which stiffness and mass are alike: digits.
    unit = np.sqrt(np.linalg.norm(k) / np.linalg.norm(m)) ** 0.5
    size, one = len(k), np.eye(len(k))
    with np.errstate(invalid='ignore'):  # what has no mass has infinite eigenvalues
        values = unit * scipy.linalg.eigvals(
            np.block([[np.zeros((size, size)), one], [-k / unit**2, -c / unit]]),
            scipy.linalg.block_diag(one, m))
    values = values[np.isfinite(values) & (values.imag > 1e-9 * np.abs(values))]
    return np.asarray(values[np.argsort(values.imag)])


@dataclass(frozen=True)
class _System:
    """
    Assembled equations at some frequencies.

    Unknowns are all rotor dofs X, the motion q of each block and that of each housing on a
    pedestal. The rows of q read (I - omega^2 N M) q - N T^T f = 0, so that a rigid soil (N = 0)
    needs no case of its own.
    """

    model: CoupledModel
    omega: FloatArray
    matrix: ComplexArray
    through: ComplexArray
    into_seats: ComplexArray
    housings: FloatArray
    compliances: ComplexArray

    @staticmethod
    def journals_of(rotor: Rotor) -> FloatArray:
        """Return the rows that pick (x, z) of every journal out of the rotor's dofs."""
        rows = np.zeros((2 * len(rotor.bearings), 4 * len(rotor.node_positions)))
        for index, bearing in enumerate(rotor.bearings):
            for axis in range(2):
                rows[2 * index + axis, 4 * rotor.node_of(bearing.position) + axis] = 1.0
        return rows

    @property
    def rotor_size(self) -> int:
        """Number of dofs of the rotor."""
        return 4 * len(self.model.rotor.node_positions)

    @classmethod
    def of(cls, model: CoupledModel, omega: FloatArray, speed: FloatArray) -> '_System':
        """Assemble."""
        rotor, support = model.rotor, model.support
        stiffness, mass, gyroscopic = rotor_matrices(rotor)
        size, blocks = len(stiffness), 6 * len(model.foundations)
        own = [index for index, bearing in enumerate(rotor.bearings) if bearing.pedestal]
        total = size + blocks + 2 * len(own)
        journals = np.concatenate([cls.journals_of(rotor), np.zeros((2 * len(rotor.bearings),
                                                                     total - size))], axis=1)
        seats = np.zeros_like(journals)
        seats[:, size:size + blocks] = support.block_rows
        housings = seats.copy()
        for place, index in enumerate(own):
            housings[2 * index:2 * index + 2] = 0.0
            for axis in range(2):
                housings[2 * index + axis, size + blocks + 2 * place + axis] = 1.0

        square = omega[:, None, None] ** 2
        through = model.bearings.dynamic_stiffness(omega, speed) @ (journals - housings)
        into_seats = through.copy()
        matrix = np.zeros((len(omega), total, total), dtype=complex)
        matrix[:, :size, :size] = (stiffness - square * mass
                                   + 1j * (omega * speed)[:, None, None] * gyroscopic
                                   + shaft_forces(rotor, omega, speed))
        matrix += journals.T @ through
        for place, index in enumerate(own):
            pedestal, pair = rotor.bearings[index].pedestal, slice(2 * index, 2 * index + 2)
            assert pedestal is not None
            spring = pedestal.stiffness + 1j * omega[:, None, None] * pedestal.damping
            into_seats[:, pair] = spring @ (housings - seats)[pair]
            row = slice(size + blocks + 2 * place, size + blocks + 2 * place + 2)
            matrix[:, row] += into_seats[:, pair] - through[:, pair]
            matrix[:, row, row] -= square * pedestal.mass
        compliances = np.zeros((len(omega), blocks, blocks), dtype=complex)
        for index, soil in enumerate(model.soil_models):
            # A ground below all blocks fills the whole matrix.
            part = slice(6 * index, 6 * index + 6) if len(model.soil_models) > 1 else slice(blocks)
            compliances[:, part, part] = soil.compliance(omega)
        rows = slice(size, size + blocks)
        mass = np.zeros((blocks, blocks))
        for index, foundation in enumerate(model.foundations):
            part = slice(6 * index, 6 * index + 6)
            mass[part, part] = foundation.mass_matrix
        matrix[:, rows, rows] += np.eye(blocks) - square * (compliances @ mass)
        matrix[:, rows] -= compliances @ seats[:, rows].T @ into_seats
        return cls(model, omega, matrix, through, into_seats, housings, compliances)

    @property
    def channels(self) -> FloatArray:
        """Rows that pick the channels out of the unknowns."""
        rotor, size, total = self.model.rotor, self.rotor_size, self.matrix.shape[1]
        unit = np.eye(total)
        rows: list[FloatArray] = []
        for index, bearing in enumerate(rotor.bearings):
            node = 4 * rotor.node_of(bearing.position)
            rows += [unit[node:node + 2], self.housings[2 * index:2 * index + 2]]
        for station in rotor.stations[len(rotor.bearings):]:
            node = 4 * rotor.node_of(station.position)
            rows.append(unit[node:node + 2])
        rows.append(unit[size:size + 6 * len(self.model.foundations)])
        return np.concatenate(rows)

    def solve(self, load: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return displacement and force of every channel, (n, c) each."""
        model = self.model
        motion = np.linalg.solve(self.matrix, load[..., None])
        through, seats = (self.through @ motion)[..., 0], (self.into_seats @ motion)[..., 0]
        blocks = motion[:, self.rotor_size:, 0]
        both = np.repeat(through.reshape(len(load), -1, 1, 2), 2, axis=2)
        forces = [both.reshape(len(load), -1)]
        others = 2 * (len(model.rotor.discs) + len(model.rotor.probes))
        forces.append(np.full((len(load), others), complex(np.nan, np.nan)))
        for index, foundation in enumerate(model.foundations):
            own = blocks[:, 6 * index:6 * index + 6]
            forces.append(seats @ model.support.block_rows[:, 6 * index:6 * index + 6]
                          + self.omega[:, None] ** 2 * (own @ foundation.mass_matrix))
        return ((self.channels @ motion)[..., 0], np.concatenate(forces, axis=1))
