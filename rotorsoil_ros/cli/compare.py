"""Predicted against measured: what a vibration engineer acts on."""

from argparse import Namespace
import math
from pathlib import Path
from typing import TYPE_CHECKING

from rotorsoil_ros.case.config import Case, load
from rotorsoil_ros.case.zone_limits import ISO_10816_3
from rotorsoil_ros.cli.arguments.options import SI
from rotorsoil_ros.cli.bags import speed_source
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.figures.report import (
    channel_table,
    exclusions,
    ground_tables,
    peak_table,
    PLANT_SCALE,
    Scale,
    SI_SCALE,
    write_report,
    zone_table,
)
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.rules import Matching
from rotorsoil_ros.monitor.verdict import Verdict
from rotorsoil_ros.units import rpm_to_rad_s

if TYPE_CHECKING:
    from rotorsoil_ros.monitor.identification.case import Identification

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
    found, lines = _identification(arguments, comparison)
    out: Path = arguments.output
    out.mkdir(parents=True, exist_ok=True)
    _print(comparison, SI_SCALE if arguments.units == SI else PLANT_SCALE)
    for line in lines:
        print(line)
    with progress('drawing') as _:
        write_report(comparison, out, source=str(arguments.log), identification=lines,
                     found=found)
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


def _identification(
    arguments: Namespace, comparison: Comparison,
) -> 'tuple[Identification | None, list[str]]':
    """Return what explains the run, and that in words; nothing where nobody asked."""
    if not (arguments.identify or arguments.identify_unbalance):
        if arguments.write_case is not None:
            raise InputError('--write-case: needs --identify or --identify-unbalance')
        return None, []
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
            return None, [f'identification refused: {error}']
    lines = list(describe(found))
    if arguments.write_case is not None:
        write_case(found, arguments.write_case)
        lines.append(f'updated case {arguments.write_case}')
    return found, lines


def _print(comparison: Comparison, scale: Scale) -> None:
    for header, lines in (channel_table(comparison, scale), peak_table(comparison, scale),
                          zone_table(comparison, scale),
                          *ground_tables(comparison, scale)):
        if lines:
            widths = [max(map(len, column)) for column in zip(header, *lines, strict=True)]
            for line in (header, *lines):
                print('  '.join(cell.ljust(width) for cell, width in zip(
                    line, widths, strict=True)).rstrip())
            print()
    print(*exclusions(comparison), *(f'note: {remark}' for remark in comparison.remarks),
          *(f'fails: {failure}' for failure in comparison.failures), sep='\n')
