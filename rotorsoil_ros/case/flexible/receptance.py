"""What a file of seat receptances says: foundation and ground as somebody computed or tested."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rotorsoil_ros.case import stiffness_file
from rotorsoil_ros.channel import across, Channel
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance


def read(
    path: Path, text: str, names: Sequence[str], covering: tuple[float, float],
) -> SeatReceptance:
    """
    Read how seats move under forces on them.

    Parameters
    ----------
    path : Path
        CSV as the verb `seats` writes it: `omega_rad_s`, `hz` or `frequency_hz`, then
        `<seat>_<x or z>__<seat>_<x or z>_re,_im` [m/N], response first. Of two entries that
        mirror each other one is enough; a pair of which neither is there does not move each other.
    text : str
        What it says.
    names : sequence of str
        Of the seats that bearings stand on; two may stand on one.
    covering : tuple of two floats
        Frequencies that it has to know [rad/s].

    Raises
    ------
    InputError
        One line with file and place.

    """
    seats = [channel for name in dict.fromkeys(names) for channel in across(name)]
    entries = {f'{response}__{force}': (i, j) for i, response in enumerate(seats)
               for j, force in enumerate(seats)}
    columns = stiffness_file.columns_of(path, text, entries, example=(
        f'{seats[0]}__{seats[0]}_re and _im of the seats {", ".join(names)}'))
    omega = stiffness_file.frequencies_of(path, columns, covering)
    values, known = np.zeros((len(omega), len(seats), len(seats)), dtype=complex), set()
    for name, (i, j) in entries.items():
        found = stiffness_file.entry_of(path, columns, name)
        if found is not None:
            values[:, i, j] = found
            known.add((i, j))
    for i, j in known:
        if (j, i) not in known:
            values[:, j, i] = values[:, i, j]
    _require_own(path, seats, known)
    pairs = [(i, j) for i in range(len(seats)) for j in range(i)]
    try:
        return SeatReceptance.of(seats, omega, values, apart=sum(
            (i, j) not in known and (j, i) not in known for i, j in pairs))
    except RotorSoilError as error:
        raise InputError(f'{path}: {error}') from error


def _require_own(path: Path, seats: Sequence[Channel], known: set[tuple[int, int]]) -> None:
    """Raise an InputError where nobody says how a seat moves under a force on itself."""
    missing = [f'{one}__{one}' for i, one in enumerate(seats) if (i, i) not in known]
    if missing:
        raise InputError(f'{path}: {", ".join(missing)} must be given, as zeros where a seat does '
                         'not move, got none')
