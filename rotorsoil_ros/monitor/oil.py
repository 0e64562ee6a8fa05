"""From which of its tables is a machine on oil films answered? That of the nearest temperature."""

from collections.abc import Mapping
from dataclasses import dataclass
import math
from typing import TypeAlias

from rotorsoil_ros.machine.response import ResponseTable

# Tables of one machine, by the mean temperature of its films [deg C].
Oils: TypeAlias = Mapping[float, ResponseTable]

# Share of the distance of two tables by which a temperature has to be past their middle: one that
# lies there and is noisy does not go to and fro.
_PAST = 0.1


@dataclass(slots=True)
class OilTables:
    """
    Chooses among tables that have been computed before.

    Attributes
    ----------
    tables : mapping of float to ResponseTable
        By temperature [deg C]; empty where a machine has one table for all of them.
    at : float
        Temperature of the table that is in use; NaN before the first message.

    Notes
    -----
    The same temperatures in the same order choose the same tables, live and out of a log: what is
    chosen depends on nothing else. Temperatures beyond the ends take the last table.

    """

    tables: Oils
    at: float = math.nan

    def chosen(self, celsius: float) -> ResponseTable | None:
        """
        Return the table to be answered from now on.

        Parameters
        ----------
        celsius : float
            What was measured [deg C]; NaN is no temperature.

        Returns
        -------
        ResponseTable or None
            None where it stays as it is.

        """
        if not self.tables or not math.isfinite(celsius):
            return None
        nearest = min(self.tables, key=lambda one: (abs(one - celsius), one))
        if nearest == self.at:
            return None
        if math.isfinite(self.at):
            gain = abs(self.at - celsius) - abs(nearest - celsius)
            if gain < 2.0 * _PAST * abs(nearest - self.at):
                return None
        self.at = nearest
        return self.tables[nearest]

    def words(self, celsius: float) -> str:
        """Return what to say when a temperature [deg C] has changed the table."""
        return f'oil of {celsius:.1f} deg C: answered from the tables of {self.at:g} deg C'
