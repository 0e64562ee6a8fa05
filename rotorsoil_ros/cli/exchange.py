"""Measured tables in, logs out as tables."""

from argparse import Namespace
from pathlib import Path
import sys
from typing import Any

from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.units import rad_s_to_rpm


def import_table(arguments: Namespace) -> int:
    """Turn a measured table into a bag."""
    from rotorsoil_ros.bags.tables import imported, mapping

    options = _options(arguments)
    if arguments.map is not None and options:
        raise InputError('--map: already says what the options say')
    if arguments.map is None and not options:
        raise InputError(f'{arguments.table}: which column is what must be said, by --map '
                         f'MAP.yaml or by options; a map reads\n{mapping.EXAMPLE}')
    found = (imported.import_table(arguments.table, arguments.map, arguments.output)
             if options is None else
             imported.import_with_options(arguments.table, options, arguments.output))
    for remark in found.remarks:
        print(f'{arguments.table}: {remark}', file=sys.stderr)
    span = (found.stamp_ns[-1] - found.stamp_ns[0]) * 1e-9
    rpm = rad_s_to_rpm(found.speed)
    print(f'{arguments.output}: {found.machine}: {len(rpm)} rows in {span:.1f} s, '
          f'{rpm[0]:.0f} to {rpm[-1]:.0f} rpm, {", ".join(found.channels)}')
    return 0


def _options(arguments: Namespace) -> dict[str, Any] | None:
    """Return what the options say as a map would, None where they say nothing."""
    def group(name: str, *keys: str) -> dict[str, Any]:
        column = getattr(arguments, name)
        said = {'column': int(column) if column and column.isdigit() else column}
        said |= {key: getattr(arguments, f'{name}_{key}') for key in keys}
        return {key: value for key, value in said.items() if value is not None}

    time = group('time', 'unit', 'format', 'every', 'start')
    if time.get('every', 'turn') != 'turn':
        time['every'] = _seconds(time['every'])
    parts = {'amplitude': group('amplitude', 'unit'), 'phase': group('phase', 'unit', 'sense')}
    said = {'machine': arguments.machine, 'time': time or None, 'speed': group('speed', 'unit')}
    if not any(said.values()) and not any(parts.values()) and not arguments.channel:
        return None
    channel = {name: part for name, part in parts.items() if part or name == 'amplitude'}
    return {**{key: value for key, value in said.items() if value is not None},
            'channels': {arguments.channel: channel} if arguments.channel else {}}


def _seconds(text: str) -> float:
    try:
        return float(text)
    except ValueError as error:
        raise InputError(f'--time-every: must be turn or a number of seconds, got {text!r}'
                         ) from error


def export(arguments: Namespace) -> int:
    """Write a log as a long table."""
    from rotorsoil_ros.bags.tables.exported import export_log

    output: Path = arguments.output
    with progress('exporting') as report:
        rows = export_log(arguments.log, output, machine=arguments.machine or '',
                          progress=report)
    print(f'{output}: {rows} rows')
    return 0
