"""Recorded profiles, answered or sent into the graph; measured tables in, logs out as tables."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
import sys
from typing import Any, TYPE_CHECKING

from rotorsoil_ros.case import config, document, ross
from rotorsoil_ros.case.zone_limits import support_class, zone, ZoneLimits
from rotorsoil_ros.cli.archive import is_archive, predict_archive
from rotorsoil_ros.cli.arguments.options import PLANT, SI
from rotorsoil_ros.cli.outputs import replacing
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.cli.table import opened
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.units import rad_s_to_rpm, Units

if TYPE_CHECKING:
    from rotorsoil_ros.bags.predict import Answered
    from rotorsoil_ros.wire.speeds import SpeedSource


def speed_source(arguments: Namespace) -> 'SpeedSource':
    """Return what was said of how the plant tells the speed."""
    from rotorsoil_ros.wire.speeds import SpeedSource

    said = {name: value for name in SpeedSource.__slots__
            if (value := getattr(arguments, f'speed_{name}')) is not None}
    return SpeedSource(**said)


def predict(arguments: Namespace) -> int:
    """Answer every speed of a profile and log it as the node would."""
    from rotorsoil_ros.bags.predict import predict as answer
    from rotorsoil_ros.case.machine import Machine
    from rotorsoil_ros.screen import recorder

    machine = Machine.load(
        arguments.case, cache_directory=arguments.cache, overrides=arguments.overrides)
    if is_archive(arguments):
        return predict_archive(arguments, machine, speed_source(arguments))
    if arguments.output is None:
        raise InputError('-o OUT is missing: the log to write')
    [profile] = arguments.profiles
    with ExitStack() as stack:
        report = stack.enter_context(progress('predicting'))
        rrd = arguments.rrd and stack.enter_context(replacing(arguments.rrd))
        answered = answer(machine, profile, arguments.output, progress=report,
                          speed=speed_source(arguments),
                          screen=recorder(rrd, machine) if rrd else None)
        if answered.failure and rrd:
            rrd.unlink(missing_ok=True)
    for remark in answered.remarks:
        print(remark, file=sys.stderr)
    if answered.failure:
        print(f'{profile}: {answered.failure}', file=sys.stderr)
        return 1
    counts = {reason: number for reason, number in answered.counts.items() if number}
    told = ', '.join(f'{number} {reason}' for reason, number in counts.items())
    print(f'{arguments.output}: {answered.machine}: {told}')
    for line in _found(answered, machine.case.zones, Units(arguments.units != SI)):
        print(line)
    return 1 if answered.counts['unstable'] else 0


def _found(answered: 'Answered', zones: ZoneLimits, units: Units) -> Iterator[str]:
    """Yield what was answered with most, and in which zones the housings are."""
    largest = answered.largest
    if largest is None or largest.displacement is None:
        return
    low, high = largest.speeds
    yield f'speeds           {units.speed(low)} to {units.speed(high)}'
    most = largest.displacement
    yield (f'largest answer   {units.displacement(most.amplitude)} at {most.channel}, '
           f'{units.speed(most.speed)}')
    for channel, own in largest.housings.items():
        if not own.amplitude > 0.0:
            continue  # on rigid ground a housing does not move
        support = support_class(answered.natural_speeds[channel.axis], own.speed)
        yield (f'largest velocity {units.velocity(own.velocity)} at {channel}, '
               f'{units.speed(own.speed)}: zone '
               f'{zone(own.velocity, zones.of(support, own.speed))} ({support} support)')


def replay(arguments: Namespace) -> int:
    """Publish a recorded profile at its own timing, or faster or slower."""
    from rotorsoil_ros.node.replay import replay as publish

    with progress('replaying') as report:
        published = publish(arguments.profile, rate=arguments.rate, progress=report,
                            speed=speed_source(arguments), machine=arguments.machine or '')
    print(f'{arguments.profile}: {published} messages published')
    return 0


def recover(arguments: Namespace) -> int:
    """Save everything readable of a log whose writer was killed."""
    from rotorsoil_ros.bags.recover import recover as save

    with replacing(arguments.output) as aside, progress('recovering') as report:
        saved = save(arguments.broken, aside, progress=report)
    print(f'{arguments.output}: {saved}')
    return 0


def import_ross(arguments: Namespace) -> int:
    """Write the case of a rotor that ROSS saved, and tell what was assumed and what was lost."""
    sweep = arguments.rpm
    found = ross.read(arguments.rotor, None if sweep is None else (sweep.start, sweep.stop))
    lost = found.lost or ['nothing']
    comments = [f'Imported by rotorsoil import-ross from {arguments.rotor.name}.',
                'ROSS x (horizontal) is our -x, its y (vertical) our z, its axis our y.',
                'Assumed:', *(f'  {line}' for line in found.assumed),
                'Not carried over:', *(f'  {line}' for line in lost)]
    text = document.text_of(found.content, comments)
    # What is written has to load; a fault is told with the name of the source.
    config.case_of(arguments.rotor, document.parse(text, source=str(arguments.rotor)))
    with opened(arguments.output) as stream:
        stream.write(text)
    for kind, lines in (('assumed', found.assumed), ('not carried over', lost)):
        for line in lines:
            print(f'{kind}: {line}', file=sys.stderr)
    return 0


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
                          plant=arguments.units == PLANT, progress=report)
    print(f'{output}: {rows} rows')
    return 0
