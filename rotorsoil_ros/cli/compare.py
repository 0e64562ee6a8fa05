"""Predicted against measured: what a vibration engineer acts on."""

from argparse import Namespace
from collections.abc import Iterator
import math
from pathlib import Path

from rotorsoil_ros.case.config import Case, load
from rotorsoil_ros.case.zone_limits import ISO_10816_3
from rotorsoil_ros.cli.bags import speed_source
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.figures.report import (
    channel_table,
    exclusions,
    peak_table,
    write_report,
    zone_table,
)
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.rules import Matching
from rotorsoil_ros.monitor.verdict import Verdict
from rotorsoil_ros.units import rpm_to_rad_s

_VERDICT_FAILS = 1


def compare(arguments: Namespace) -> int:
    """Hold a log against its prediction; write tables, pictures and a report; print a verdict."""
    from rotorsoil_ros.bags.comparison import compare as judged, Wish

    slow_roll = arguments.slow_roll_rpm
    wish = Wish(
        machine=arguments.machine or '', speed=speed_source(arguments),
        matching=Matching(
            tolerance=arguments.tolerance_s,
            slow_roll_speed=math.nan if slow_roll is None else rpm_to_rad_s(slow_roll),
            noise=1e-6 * arguments.noise_um),
        amplitude_margin=arguments.margin, soil_factor=arguments.soil_factor,
        zones=None if arguments.zone_group is None else ISO_10816_3[arguments.zone_group])
    with progress('comparing') as report:
        comparison = judged(arguments.log, _case(arguments), wish,
                            cache_directory=arguments.cache, progress=report)
    lines = list(_identification(arguments, comparison))
    out: Path = arguments.output
    out.mkdir(parents=True, exist_ok=True)
    _print(comparison)
    for line in lines:
        print(line)
    with progress('drawing') as _:
        write_report(comparison, out, source=str(arguments.log), identification=lines)
    print(f'report    {out / "report.html"}')
    print(f'verdict   {comparison.verdict}')
    return 0 if comparison.verdict == Verdict.PASSES else _VERDICT_FAILS


def _case(arguments: Namespace) -> Case | None:
    """Return the case that is given; None: the log carries its own."""
    if arguments.case is not None:
        return load(arguments.case, arguments.overrides, cache_directory=arguments.cache)
    if arguments.overrides:
        raise InputError('--set: needs the CASE that it overrides')
    return None


def _identification(arguments: Namespace, comparison: Comparison) -> Iterator[str]:
    if not (arguments.identify or arguments.identify_unbalance):
        if arguments.write_case is not None:
            raise InputError('--write-case: needs --identify or --identify-unbalance')
        return
    from rotorsoil_ros.monitor.identification.case import identify_case, Wanted
    from rotorsoil_ros.monitor.identification.words import describe, write_case

    wanted = Wanted(
        scalars=arguments.identify, planes=arguments.plane,
        growth=arguments.identify_growth, runout=arguments.identify_runout,
        with_transients=arguments.with_transients)
    with progress('identifying') as _:
        try:
            found = identify_case(comparison, wanted)
        except RotorSoilError as error:
            if isinstance(error, InputError):
                raise
            yield f'identification refused: {error}'
            return
    yield from describe(found)
    if arguments.write_case is not None:
        write_case(found, arguments.write_case)
        yield f'updated case {arguments.write_case}'


def _print(comparison: Comparison) -> None:
    for header, lines in (channel_table(comparison), peak_table(comparison),
                          zone_table(comparison)):
        if lines:
            widths = [max(map(len, column)) for column in zip(header, *lines, strict=True)]
            for line in (header, *lines):
                print('  '.join(cell.ljust(width) for cell, width in zip(
                    line, widths, strict=True)).rstrip())
            print()
    print(*exclusions(comparison), *(f'note: {remark}' for remark in comparison.remarks),
          *(f'fails: {failure}' for failure in comparison.failures), sep='\n')
