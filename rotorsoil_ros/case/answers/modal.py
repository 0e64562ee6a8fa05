"""How a machine vibrates on its own, whether it is stable, and what damps it."""

from abc import ABC, abstractmethod

from rotorsoil_ros.arrays import FloatArray, Numbers, numbers
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.summary import undecided
from rotorsoil_ros.errors import InputError, NotSolvedError
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.damping import DampingSplit, DampingSplitter
from rotorsoil_ros.machine.modes.campbell import Campbell, campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds, CriticalSpeed
from rotorsoil_ros.machine.modes.stability import Stability, stability
from rotorsoil_ros.units import rpm_to_rad_s

MODES = 8  # of a Campbell diagram, unless somebody asks for more


class ModalAnswers(ABC):
    """What a machine answers of its free vibrations; whoever has a case and its model has it."""

    case: Case

    @property
    @abstractmethod
    def model(self) -> CoupledModel:
        """Rotor, blocks and soil as one system of equations."""

    def stability(self, *, rpm_range: tuple[float, float] | None = None) -> Stability:
        """
        Find every mode that grows on its own, and what feeds it.

        Parameters
        ----------
        rpm_range : tuple of two floats or None
            Between which speeds [rpm], as far as tables of bearings go; None from rest to the
            end of the speed range of the case.

        Raises
        ------
        InputError
            If what is known of the support does not determine the modes.

        """
        low, high = ((0.0, self.case.speed_range[1]) if rpm_range is None
                     else rpm_to_rad_s(numbers('rpm_range', rpm_range)).tolist())
        try:
            return stability(self.model, (low, high))
        except NotSolvedError as error:
            raise self._undecided(error) from error

    def _growth(self, speed: FloatArray) -> Stability:
        """Return where a mode grows among speeds (n,) [rad/s]."""
        if not len(speed):
            return Stability((0.0, 0.0), (), 0.0)
        return stability(self.model, (float(speed.min()), float(speed.max())))

    def campbell(self, *, rpm: Numbers, modes: int = MODES) -> Campbell:
        """
        Return the lowest modes at each speed.

        Parameters
        ----------
        rpm : float or (n,) floats
            Rotor speeds, rising for the branches to make sense [rpm].
        modes : int
            How many at each speed; fewer where the machine has no more.

        Returns
        -------
        Campbell
            Frequencies [rad/s], damping ratios [-], whirl and branches, (n, modes) each.

        Raises
        ------
        InputError
            If what is known of the support does not determine the modes.

        """
        speed = rpm_to_rad_s(numbers('rpm', rpm))
        try:
            return campbell(self.model, speed, modes)
        except NotSolvedError as error:
            raise self._undecided(error) from error

    def critical_speeds(
        self, *, rpm_range: tuple[float, float] | None = None,
    ) -> tuple[CriticalSpeed, ...]:
        """
        Find the speeds that excite a mode with its own frequency, rising.

        Parameters
        ----------
        rpm_range : tuple of two floats or None
            Between which speeds [rpm]; None for the speed range of the case.

        Raises
        ------
        InputError
            If what is known of the support does not determine the modes.

        """
        low, high = (self.case.speed_range if rpm_range is None
                     else rpm_to_rad_s(numbers('rpm_range', rpm_range)).tolist())
        try:
            return critical_speeds(self.model, (low, high))
        except NotSolvedError as error:
            raise self._undecided(error) from error

    def damping_split(self, *, rpm: Numbers) -> DampingSplit:
        """
        Return where the energy of the unbalance goes: bearings, soil material, radiation.

        Parameters
        ----------
        rpm : float or (n,) floats
            Rotor speeds [rpm].

        Returns
        -------
        DampingSplit
            Work of every part [J] per cycle; NaN where the machine is unstable.

        """
        speed = rpm_to_rad_s(numbers('rpm', rpm))
        found = DampingSplitter(self.model).forced(speed, self.case.unbalance)
        return found.where(self._growth(speed).holds(speed))

    def _undecided(self, error: NotSolvedError) -> InputError:
        """Return the same error with the key of the case that is to blame."""
        return InputError(f'{self.case.path}: {undecided(self.case, error)}')
