"""Machines of other programs, brought over as case files."""

from argparse import Namespace
import sys

from rotorsoil_ros.case import config, document, ross, writer
from rotorsoil_ros.cli.sweeps import opened


def import_ross(arguments: Namespace) -> int:
    """Write the case of a rotor that ROSS saved, and tell what was assumed and what was lost."""
    sweep = arguments.rpm
    found = ross.read(arguments.rotor, None if sweep is None else (sweep.start, sweep.stop))
    lost = found.lost or ['nothing']
    comments = [f'Imported by rotorsoil import-ross from {arguments.rotor.name}.',
                'ROSS x (horizontal) is our -x, its y (vertical) our z, its axis our y.',
                'Assumed:', *(f'  {line}' for line in found.assumed),
                'Not carried over:', *(f'  {line}' for line in lost)]
    text = writer.text_of(found.content, comments)
    # What is written has to load; a fault is told with the name of the source.
    config.case_of(arguments.rotor, document.parse(text, source=str(arguments.rotor)))
    with opened(arguments.output) as stream:
        stream.write(text)
    for kind, lines in (('assumed', found.assumed), ('not carried over', lost)):
        for line in lines:
            print(f'{kind}: {line}', file=sys.stderr)
    return 0
