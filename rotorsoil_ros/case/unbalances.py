"""Which unbalance the entries of a case file put on a rotor."""

from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.case import schema
from rotorsoil_ros.case.faults import Faults
from rotorsoil_ros.physics.arrays import ComplexArray
from rotorsoil_ros.physics.balance import permissible_unbalance
from rotorsoil_ros.physics.rotor import Rotor
from rotorsoil_ros.physics.units import rpm_to_rad_s


@dataclass(frozen=True)
class Unbalances:
    """Adds up the unbalance of each disc and says at which key it was refused."""

    faults: Faults
    rotor: Rotor

    def couples(self) -> tuple[str, ...]:
        """Return the discs that have a couple, in the order of the rotor."""
        named = {entry.disc for entry in self.faults.entries.unbalances
                 if entry.couple is not None}
        return tuple(disc.name for disc in self.rotor.discs if disc.name in named)

    def total(self) -> ComplexArray:
        """Return moments of all discs [kg m], then of the couples [kg m^2], with their phase."""
        discs, couples = [disc.name for disc in self.rotor.discs], self.couples()
        total = np.zeros(len(discs) + len(couples), dtype=complex)
        for index, entry in enumerate(self.faults.entries.unbalances):
            if entry.disc not in discs:
                raise self.faults.error(
                    'unbalances', index, 'disc',
                    problem=f'must be one of {", ".join(discs)}, got {entry.disc}')
            total[discs.index(entry.disc)] += (
                self._moment(index, entry) * np.exp(1j * entry.phase))
            if entry.couple is not None:
                plane = len(discs) + couples.index(entry.disc)
                total[plane] += entry.couple * np.exp(1j * entry.couple_phase)
        return total

    def _moment(self, index: int, entry: schema.Unbalance) -> float:
        place = ('unbalances', index)
        if entry.moment is not None and entry.grade is not None:
            raise self.faults.error(*place, problem='needs either moment or grade, got both')
        if entry.grade is None:
            for key in ('rated_speed_rpm', 'share'):
                if key in entry.model_fields_set:
                    raise self.faults.error(*place, key, problem='belongs to a grade, which is '
                                                                 'missing')
        if entry.grade is not None:
            return self._permissible(index, entry, entry.grade)
        if entry.moment is None and entry.couple is None:
            raise self.faults.error(*place, 'moment', problem='is missing, and so are grade and '
                                                              'couple')
        return 0.0 if entry.moment is None else entry.moment

    def _permissible(self, index: int, entry: schema.Unbalance, grade: float) -> float:
        """Return the disc's share of what the grade permits the whole rotor."""
        place = ('unbalances', index)
        rated = entry.rated_speed_rpm
        if rated is None:
            raise self.faults.error(*place, 'rated_speed_rpm', problem='is missing; a grade '
                                                                       'needs it')
        if not rated > 0.0:
            raise self.faults.error(*place, 'rated_speed_rpm',
                                    problem=f'must be > 0 rpm, got {rated:g}')
        if not 0.0 < entry.share <= 1.0:
            raise self.faults.error(*place, 'share', problem=f'must be in (0, 1], '
                                                             f'got {entry.share:g}')
        with self.faults.at(*place, entry=entry):
            return entry.share * permissible_unbalance(
                grade=grade, mass=self.rotor.mass, speed=rpm_to_rad_s(rated))
