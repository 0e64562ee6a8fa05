"""Which files of a case say what its bearings or blocks stand on."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

from rotorsoil_ros.case import schema, stiffness_file
from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.flexible import receptance
from rotorsoil_ros.ground.table import ComplianceTable
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance

# Supports that a file tells: the ground below each block, or blocks and ground together.
TABLE, RECEPTANCE = 'table', 'receptance'
FILED = (TABLE, RECEPTANCE)

# Files that were read last and may be asked for again.
_KEPT = 4

Tables: TypeAlias = tuple[ComplianceTable, ...] | tuple[SeatReceptance]


@dataclass(frozen=True)
class SupportFiles:
    """
    Reads the files of the support and says at which key one was refused.

    Attributes
    ----------
    faults : Faults
        Of the case.
    files : dict of str to str
        What files say that came with the document, and those that are read here.

    """

    faults: Faults
    files: dict[str, str]

    def refuse_unused(self) -> None:
        """Raise an InputError at a file that the support does not take."""
        entries = self.faults.entries
        model = entries.support.model
        named = [(('support', 'file'), entries.support.file, FILED),
                 (('support', 'cut_offs_hz'), entries.support.cut_offs_hz, (TABLE,)),
                 *((('foundations', index, 'stiffness_file'), block.stiffness_file, (TABLE,))
                   for index, block in enumerate(entries.foundations))]
        for place, given, takes in named:
            if given is not None and model not in takes:
                raise self.faults.error(*place, problem=(
                    f'belongs to the support model {" or ".join(takes)}, got {model}'))

    def tables(self, speed_range: tuple[float, float]) -> Tables | None:
        """Return what blocks or bearings stand on by a file, or None where one is at fault."""
        entries = self.faults.entries
        if entries.support.model == RECEPTANCE:
            return self.faults.attempt(lambda: (self._seats(speed_range),))
        if entries.support.model != TABLE:
            return ()

        def table(_: int, block: schema.FoundationEntry) -> ComplianceTable:
            file = block.stiffness_file or entries.support.file
            return _ground(self.faults.path.parent / self._named(file), self._text(file),
                           speed_range, tuple(entries.support.cut_offs_hz or ()))

        return self.faults.attempt_each(table, entries.foundations)

    def _seats(self, speed_range: tuple[float, float]) -> SeatReceptance:
        file, bearings = self.faults.entries.support.file, self.faults.entries.rotor.bearings
        seats = self.faults.seats or tuple(
            bearing.seat or bearing.name for bearing in bearings)
        return _receptance(self.faults.path.parent / self._named(file), self._text(file), seats,
                           speed_range)

    def _named(self, file: str | None) -> str:
        if file is None:
            raise self.faults.error('support', 'file', problem=(
                f'is missing; the support model {self.faults.entries.support.model} needs it'))
        return file

    def _text(self, file: str | None) -> str:
        name = self._named(file)
        if name not in self.files:
            # A path means the same wherever the program is called.
            self.files[name] = stiffness_file.text_of(self.faults.path.parent / name)
        return self.files[name]


# A case with a fault is read some hundred times, one key after the other mended, and its files
# take tenths of a second each.
@lru_cache(maxsize=_KEPT)
def _ground(
    path: Path, text: str, speed_range: tuple[float, float], cut_offs: tuple[float, ...],
) -> ComplianceTable:
    return stiffness_file.read(path, speed_range, text=text, cut_offs_hz=cut_offs)


@lru_cache(maxsize=_KEPT)
def _receptance(
    path: Path, text: str, seats: tuple[str, ...], speed_range: tuple[float, float],
) -> SeatReceptance:
    return receptance.read(path, text, seats, speed_range)
