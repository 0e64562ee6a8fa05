"""What does the plain assembled system say? The oracle of the fast solve."""

import numpy as np

from rotorsoil_ros.physics.arrays import ComplexArray, FloatArray
from rotorsoil_ros.physics.coupled import UNBALANCE_FORCE, CoupledModel
from rotorsoil_ros.physics.prediction import Prediction
from rotorsoil_ros.physics.rotor import Rotor


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
    count = len(rotor.node_positions)
    # Plane dofs (deflection, slope) in node dofs: x and -rz, z and +rx.
    in_x = np.kron(np.eye(count), np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0]]))
    in_z = np.kron(np.eye(count), np.array([[0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]))

    def both(plane: FloatArray) -> FloatArray:
        return np.asarray(in_x.T @ plane @ in_x + in_z.T @ plane @ in_z)

    gyroscopic = in_z.T @ polar @ in_x - in_x.T @ polar @ in_z
    return both(stiffness), both(mass), gyroscopic


def dense_response(
    model: CoupledModel, speed: FloatArray, unbalance: ComplexArray,
) -> Prediction:
    """
    Assemble rotor and blocks and solve at every speed: slow, and easy to believe.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    speed : (n,) float array
        Rotor speed [rad/s].
    unbalance : (p,) complex array
        moment * exp(i phase) of every plane [kg m].

    Returns
    -------
    Prediction
        As `CoupledModel.unbalance_response`.

    Notes
    -----
    Unknowns are all rotor dofs X and, for each block, its motion q. The rows of q read
    (I - omega^2 N M) q - N T^T f = 0, so that a rigid soil (N = 0) needs no case of its own.

    """
    rotor, support = model.rotor, model.support
    stiffness, mass, gyroscopic = rotor_matrices(rotor)
    size, blocks = len(stiffness), 6 * len(model.foundations)
    journals = np.zeros((2 * len(rotor.bearings), size))
    for index, bearing in enumerate(rotor.bearings):
        for axis in range(2):
            journals[2 * index + axis, 4 * rotor.node_of(bearing.position) + axis] = 1.0
    seats = support.seat_rows.transpose(1, 0, 2).reshape(-1, blocks)
    relative = np.concatenate([journals, -seats], axis=1)

    omega = speed[:, None, None]
    through = model.bearing_stiffness(speed, speed) @ relative
    system = np.zeros((len(speed), size + blocks, size + blocks), dtype=complex)
    system[:, :size, :size] = stiffness - omega**2 * mass + 1j * omega**2 * gyroscopic
    system[:, :size] += journals.T @ through
    for index, (foundation, soil) in enumerate(
            zip(model.foundations, model.soil_models, strict=True)):
        rows = slice(size + 6 * index, size + 6 * index + 6)
        compliance = soil.compliance(speed)
        system[:, rows, rows] = np.eye(6) - omega**2 * (compliance @ foundation.mass_matrix)
        own_seats = seats[:, 6 * index:6 * index + 6]
        system[:, rows] -= compliance @ own_seats.T @ through

    load = np.zeros((len(speed), size + blocks), dtype=complex)
    for disc, moment in zip(rotor.discs, unbalance, strict=True):
        node = 4 * rotor.node_of(disc.position)
        load[:, node:node + 2] += moment * speed[:, None] ** 2 * UNBALANCE_FORCE
    motion = np.linalg.solve(system, load[..., None])[..., 0]
    return _channels_of(model, speed, motion, through, seats)


def _channels_of(
    model: CoupledModel, speed: FloatArray, motion: ComplexArray, through: ComplexArray,
    seats: FloatArray,
) -> Prediction:
    """Pick the channels out of the solution of the assembled system."""
    rotor = model.rotor
    size = motion.shape[1] - seats.shape[1]
    block = motion[:, size:]
    forces = (through @ motion[..., None])[..., 0]
    housings = block @ seats.T
    displacement, force = [], []
    for index, bearing in enumerate(rotor.bearings):
        node = 4 * rotor.node_of(bearing.position)
        pair = slice(2 * index, 2 * index + 2)
        displacement += [motion[:, node:node + 2], housings[:, pair]]
        force += [forces[:, pair], forces[:, pair]]
    for station in rotor.stations[len(rotor.bearings):]:
        node = 4 * rotor.node_of(station.position)
        displacement.append(motion[:, node:node + 2])
        force.append(np.full((len(speed), 2), complex(np.nan, np.nan)))
    into_soil = forces @ seats
    for index, foundation in enumerate(model.foundations):
        rows = slice(6 * index, 6 * index + 6)
        displacement.append(block[:, rows])
        force.append(into_soil[:, rows]
                     + speed[:, None] ** 2 * (block[:, rows] @ foundation.mass_matrix))
    return Prediction(speed, np.concatenate(displacement, axis=1), np.concatenate(force, axis=1))
