"""What a case is, and what has been computed of it, in words."""

from argparse import Namespace
from collections.abc import Iterable
import time

from rotorsoil_ros.case import cache
from rotorsoil_ros.case.config import Case, load
from rotorsoil_ros.case.peaks import resonances
from rotorsoil_ros.case.summary import derived_quantities, warnings
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.physics.response import ResponseTable
from rotorsoil_ros.physics.units import rad_s_to_rpm


def check(arguments: Namespace) -> int:
    """Print what follows from a case, where it resonates, and what looks odd."""
    case = load(arguments.case, arguments.overrides)
    _print_table(derived_quantities(case))
    with progress('solving') as _:
        table = cache.response_table(case, cache.directory(arguments.cache))
    _print_table(_peaks(case, table))
    for warning in warnings(case):
        print(f'warning: {warning}')
    return 0


def tabulate(arguments: Namespace) -> int:
    """Compute the tables of a case, or find them, and tell which."""
    case = load(arguments.case, arguments.overrides)
    directory = cache.directory(arguments.cache)
    start = time.perf_counter()
    table = cache.stored_response_table(case, directory)
    how = 'loaded'
    if table is None:
        how = 'computed'
        with progress('solving') as _:
            table = cache.response_table(case, directory)
    seconds = time.perf_counter() - start
    low, high = table.speed_range
    _print_table([
        ('compliance table', f'none needed: the model {case.support.model} is a closed form'),
        ('response table', f'{how} in {seconds:.3g} s'),
        ('covers', f'{rad_s_to_rpm(low):g} to {rad_s_to_rpm(high):g} rpm, '
                   f'{len(table.channels)} channels, {len(table.planes)} unbalance planes'),
        ('pieces', f'{len(table.pieces.resolved)} polynomials'),
        ('largest error', f'{table.accuracy:.2g} of the local amplitude, at unseen speeds'),
        *(('gap', f'{rad_s_to_rpm(left):.10g} to {rad_s_to_rpm(right):.10g} rpm: resonance '
                  'without damping') for left, right in table.gaps),
        ('file', str(cache.Cache(directory).path('response', table.key))),
    ])
    return 0


def _peaks(case: Case, table: ResponseTable) -> Iterable[tuple[str, str]]:
    moved = tuple(name for name in table.channels if name.rpartition('_')[2] in 'xyz')
    peaks = resonances(table.predictor(case.unbalance), moved)
    for peak in peaks:
        yield (f'peak at {rad_s_to_rpm(peak.speed):.6g} rpm',
               f'{1e6 * peak.amplitude:.4g} um zero-to-peak at {peak.channel}')
    if not peaks:
        yield 'peaks', 'none in the speed range'


def _print_table(lines: Iterable[tuple[str, str]]) -> None:
    for name, value in lines:
        print(f'{name:40s} {value}')
