"""The machine's own vibration over speed: the diagram of Campbell."""

from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import RotorSoilError, solved
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.following import assigned
from rotorsoil_ros.machine.modes.spectrum import Spectrum, SpectrumSolver
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm

# A mode continues a curve if its shape is more alike than its frequency is apart by this much.
_ALIKE = 0.1


@dataclass(frozen=True)
class Campbell:
    """
    Free vibration over rotor speed, modes sorted by frequency.

    Attributes
    ----------
    speed : (n,) float array
        Rotor speed [rad/s].
    eigenvalue : (n, m) complex array
        lambda of exp(lambda t) [rad/s]; NaN where a speed has fewer modes.
    whirl : (n, m) int array
        +1 forward, -1 backward, 0 where there is no mode.
    owner : (n, m) int array
        Number of the neighbour, from 1 in the order of all machines, whose rotor has most of the
        kinetic energy, and which turns at its own speed whatever this one does; 0 where none has.
    branch : (n, m) int array
        Which curve a mode belongs to, followed across speed by its shape; -1 where there is no
        mode.
    untold : (n,) float array
        Lowest frequency of a light vibration that is missing, because what is known of the
        support does not determine it [rad/s]; infinite where there is none.

    """

    speed: FloatArray
    eigenvalue: ComplexArray
    whirl: IntArray
    owner: IntArray
    branch: IntArray
    untold: FloatArray

    @property
    def speed_rpm(self) -> FloatArray:
        """Rotor speed, (n,) [rpm]."""
        return rad_s_to_rpm(self.speed)

    @property
    def frequency_hz(self) -> FloatArray:
        """Damped frequency, (n, m) [Hz]."""
        return rad_s_to_hz(self.omega)

    @property
    def omega(self) -> FloatArray:
        """Damped frequency abs(Im lambda), (n, m) [rad/s]."""
        return np.abs(self.eigenvalue.imag)

    @property
    def damping_ratio(self) -> FloatArray:
        """-Re lambda / abs(lambda), (n, m) [-]; negative is unstable."""
        return np.asarray(-self.eigenvalue.real / np.abs(self.eigenvalue))


@solved('the modes of this machine')
def campbell(model: CoupledModel, speeds: FloatArray, count: int) -> Campbell:
    """
    Return the lowest modes at each speed.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    speeds : (n,) float array
        Rotor speeds, rising for the branches to make sense [rad/s].
    count : int
        Modes wanted at each speed. Fewer are returned where the machine has no more, or where
        the table of a soil ends below them.

    Notes
    -----
    Every mode obeys the compliance of the soil at its own frequency, continued from real
    frequencies to its decaying vibration, S(lambda / i). What is overdamped has no frequency
    and is left out.

    References
    ----------
    Theory manual, modes; API 684 for the use of the diagram.

    """
    speeds = np.atleast_1d(np.asarray(speeds, dtype=float))
    if not (len(speeds) and np.all(np.isfinite(speeds)) and np.all(speeds >= 0.0)):
        raise RotorSoilError(f'speeds must be >= 0 rad/s and finite, got {speeds}')
    if not count >= 1:
        raise RotorSoilError(f'count must be at least 1 mode, got {count}')
    found = SpectrumSolver.lowest(model, speeds, count)
    return Campbell(speeds, 1j * found.frequency, found.whirl, found.owner, follow(found),
                    found.untold)


def follow(found: Spectrum) -> IntArray:
    """Give a mode the number of the curve whose shape and frequency come closest."""
    exists = np.isfinite(found.frequency)
    shape = unit_shapes(found.shape)
    branch = np.full(exists.shape, -1)
    branch[0, exists[0]] = np.arange(exists[0].sum())
    free = int(exists[0].sum())
    for index in range(1, len(branch)):
        old, new = np.flatnonzero(exists[index - 1]), np.flatnonzero(exists[index])
        likeness = np.abs(shape[index - 1, old].conj() @ shape[index, new].T)
        before, after = found.frequency[index - 1, old, None], found.frequency[index, new]
        gap = np.abs(after - before) / np.abs(after + before)
        ends, starts = assigned(gap - likeness)
        alike = (likeness - gap)[ends, starts] > _ALIKE
        branch[index, new[starts[alike]]] = branch[index - 1, old[ends[alike]]]
        fresh = new[branch[index, new] < 0]
        branch[index, fresh] = free + np.arange(len(fresh))
        free += len(fresh)
    return branch


def unit_shapes(shape: ComplexArray) -> ComplexArray:
    """Return shapes (..., d) of length one; those of length zero stay."""
    length = np.linalg.norm(shape, axis=-1, keepdims=True)
    return np.asarray(shape / np.where(length > 0.0, length, 1.0))
