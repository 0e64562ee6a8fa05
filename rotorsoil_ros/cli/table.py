"""One way to write numbers: CSV in SI for programs, in the units of a plant for people."""

from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
import csv
from pathlib import Path
import sys
from typing import TextIO

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.cli.arguments.options import PLANT, SI
from rotorsoil_ros.cli.outputs import replacing
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.prediction import Response

# Rows computed together: bounds memory however long the sweep.
_CHUNK = 4096


def units_of(arguments: Namespace) -> str:
    """Return the units that were asked for: else SI in files, those of a plant on a terminal."""
    if arguments.units is not None:
        return str(arguments.units)
    return PLANT if arguments.output == '-' and sys.stdout.isatty() else SI


def write_responses(
    arguments: Namespace, channels: Sequence[Channel], sweep: FloatArray,
    solve: Callable[[FloatArray], Response], *, per_force: bool,
) -> None:
    """
    Write the response of every channel over a sweep, in the units that were asked for.

    Parameters
    ----------
    arguments : Namespace
        `output` and `units`.
    channels : sequence of Channel
        What `solve` answers.
    sweep : (n,) float array
        What it is asked, some at a time.
    solve : callable
        From a part of the sweep to its response.
    per_force : bool
        Whether the answer is per unit force over its frequency, and not over the speed.

    """
    plant = units_of(arguments) == PLANT
    if plant:
        key = 'frequency_hz' if per_force else 'speed_rpm'
        header = [key, *(name for channel in channels for name in _plant_names(
            channel, per_force=per_force))]
    else:
        header = ['omega_rad_s' if per_force else 'speed_rad_s', *complex_names(channels)]

    def rows(part: FloatArray) -> FloatArray:
        found = solve(part)
        return _plant_rows(found, per_force=per_force) if plant else np.concatenate(
            [(found.omega if per_force else found.speed)[:, None],
             complex_columns(found.displacement)], axis=1)

    write_sweep(arguments.output, header, sweep, rows)


def complex_names(names: Iterable[str]) -> list[str]:
    """Return the names of the real and the imaginary part of each."""
    return [f'{name}_{part}' for name in names for part in ('re', 'im')]


def complex_columns(values: np.ndarray) -> FloatArray:
    """Return real and imaginary parts of (n, c) side by side, (n, 2 c)."""
    return np.ascontiguousarray(values).view(float)


def _plant_names(channel: Channel, *, per_force: bool) -> list[str]:
    micro, milli = ('urad', 'mrad') if channel.is_rotation else ('um', 'mm')
    sizes = [f'{micro}_per_n'] if per_force else [f'{micro}_pp', f'{milli}_s_rms']
    return [f'{channel}_{quantity}' for quantity in (*sizes, 'lag_deg')]


def _plant_rows(found: Response, *, per_force: bool) -> FloatArray:
    sizes = [1e6 * found.amplitude] if per_force else [
        found.displacement_um_pp(), found.velocity_mm_s_rms()]
    columns = np.stack([*sizes, found.phase_lag_deg()], axis=2).reshape(len(found), -1)
    key = found.frequency_hz if per_force else found.speed_rpm
    return np.concatenate([key[:, None], columns], axis=1)


def write_sweep(
    target: str, header: Sequence[str], sweep: FloatArray,
    rows: Callable[[FloatArray], FloatArray],
) -> None:
    """Write a header and, some at a time, the rows (n, columns) of a sweep (n,)."""
    with opened(target) as stream, progress('solving') as report:
        table = csv.writer(stream, lineterminator='\n')
        table.writerow(header)
        for start in range(0, len(sweep), _CHUNK):
            part = sweep[start:start + _CHUNK]
            table.writerows(rows(part).tolist())
            report(start + len(part), len(sweep))


def write_table(target: str, header: Sequence[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a header and rows; numbers in full precision."""
    with opened(target) as stream:
        table = csv.writer(stream, lineterminator='\n')
        table.writerow(header)
        table.writerows(rows)


@contextmanager
def opened(target: str) -> Iterator[TextIO]:
    """Open a file for writing; `-` is standard output."""
    if target == '-':
        yield sys.stdout
        return
    try:
        with replacing(Path(target)) as aside, open(aside, 'w', encoding='utf-8') as stream:
            yield stream
    except OSError as error:
        error.filename = target  # a full disk does not say which file
        raise
