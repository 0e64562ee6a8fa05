"""Recorded profiles, answered offline or sent into the graph."""

from argparse import Namespace
import os
from pathlib import Path
import sys
from typing import TYPE_CHECKING

from rotorsoil_ros.case import config, document, ross
from rotorsoil_ros.cli.archive import is_archive, predict_archive
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.cli.table import opened
from rotorsoil_ros.errors import InputError

if TYPE_CHECKING:
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
    with progress('predicting') as report:
        answered = answer(machine, profile, arguments.output, progress=report,
                          speed=speed_source(arguments),
                          screen=arguments.rrd and recorder(arguments.rrd, machine))
    for remark in answered.remarks:
        print(remark, file=sys.stderr)
    if answered.failure:
        print(f'{profile}: {answered.failure}', file=sys.stderr)
        return 1
    counts = ', '.join(f'{number} {reason}' for reason, number in answered.counts.items())
    print(f'{arguments.output}: {answered.machine}: {counts}')
    return 0


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

    # What is replaced stays until the new one is complete.
    out: Path = arguments.output
    aside = out.with_name(f'.{out.name}.{os.getpid()}') if out.exists() else out
    try:
        with progress('recovering') as report:
            saved = save(arguments.broken, aside, progress=report)
        aside.replace(out)
    finally:
        if aside != out:
            aside.unlink(missing_ok=True)
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
