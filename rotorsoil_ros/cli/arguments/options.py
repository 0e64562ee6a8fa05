"""What options of `rotorsoil` are made of: numbers, sweeps, outputs, units, and speeds."""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from difflib import get_close_matches
import math
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

PLANT, SI = 'plant', 'si'
LONGEST_SWEEP = 10_000_000
UNITS_OF_SPEED = ('rad_s', 'rpm', 'hz', 'deg_s')  # of `units`, which to import takes long


class OneLineParser(argparse.ArgumentParser):
    """Parser that says what is wrong in one line, and what was probably meant."""

    def error(self, message: str) -> NoReturn:
        """Leave with one line on standard error and status 2."""
        self.exit(2, f'{self.prog}: {message} (see {self.prog} --help)\n')

    def _check_value(self, action: argparse.Action, value: Any) -> None:
        if action.choices is not None and value not in action.choices:
            known = [str(choice) for choice in action.choices]
            near = get_close_matches(str(value), known, n=1)
            advice = (f'did you mean {near[0]}?' if near else
                      f'it must be one of {", ".join(known)}')
            raise argparse.ArgumentError(action, f'{value!r} is not known; {advice}')


class _Force(argparse.Action):
    """`--force` replaces an output; where a force may act, `--force CHANNEL` says where."""

    def __call__(self, parser: object, namespace: argparse.Namespace, values: Any,
                 option_string: str | None = None) -> None:
        """Take the option in, with a channel or without."""
        if values:
            namespace.acting_at = values
        else:
            namespace.replace = True


@dataclass(frozen=True, slots=True)
class Sweep:
    """Evenly spaced values `start:stop:count`, ends included; or one number."""

    start: float
    stop: float
    count: int

    @classmethod
    def parse(cls, text: str, *, lowest: float = 0.0) -> 'Sweep':
        """Return the sweep that a command line asks for, from a lowest value on."""
        try:
            # One number stands for itself.
            start, stop, count = text.split(':') if ':' in text else (text, text, '1')
            sweep = cls(float(start), float(stop), int(count))
        except ValueError as error:
            raise argparse.ArgumentTypeError(
                f'must be start:stop:count, ends included, got {text!r}') from error
        if not (lowest <= sweep.start <= sweep.stop < math.inf and sweep.start > -math.inf):
            least = f' >= {lowest:g}' if lowest > -math.inf else ''
            raise argparse.ArgumentTypeError(
                f'must rise from start{least} to a finite stop, got {text!r}')
        if not 1 <= sweep.count <= LONGEST_SWEEP:
            raise argparse.ArgumentTypeError(
                f'must have 1 to {LONGEST_SWEEP} values, got {text!r}')
        return sweep


def number(what: str, *, above_zero: bool = False) -> Callable[[str], float]:
    """Return what reads a finite number at least or above zero; `what` says so in words."""
    def read(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not (0.0 < value < math.inf or (value == 0.0 and not above_zero)):
            raise argparse.ArgumentTypeError(f'must be {what}, got {text!r}')
        return value

    return read


def sweep_or_one(text: str) -> Sweep:
    """Return a sweep, of one value where only one is given."""
    return Sweep.parse(text if ':' in text else f'{text}:{text}:1')


def choices(text: str) -> tuple[str, list[float]]:
    """Return a key path and what is tried there, from `KEY=A:B:N` or `KEY=V,V,V`."""
    key, _, told = text.partition('=')
    try:
        if told.count(':') == 2:
            sweep = Sweep.parse(told, lowest=-math.inf)
            step = (sweep.stop - sweep.start) / max(sweep.count - 1, 1)
            values = [sweep.start + step * index for index in range(sweep.count)]
        else:
            values = [float(value) for value in told.split(',')]
    except ValueError:
        values = []
    if not key or not values:
        raise argparse.ArgumentTypeError(
            f'must be KEY.PATH=start:stop:count or KEY.PATH=value,value, got {text!r}')
    return key, values


RPM = number('a speed >= 0 rpm')
MULTIPLE = number('a multiple > 0 of the speed', above_zero=True)
RATE = number('a factor > 0', above_zero=True)
SIZE = number('a number >= 0')


def number_of(what: str) -> Callable[[str], int]:
    """Return what reads how many of something are wanted."""
    def read(text: str) -> int:
        if not (text.isascii() and text.isdigit() and int(text[:4]) >= 1 and len(text) <= 3):
            raise argparse.ArgumentTypeError(f'must be 1 to 999 {what}, got {text!r}')
        return int(text)

    return read


Verbs: TypeAlias = 'argparse._SubParsersAction[OneLineParser]'


def add_verb(
    verbs: Verbs, name: str, run: str, says: str, *, case: bool = True,
) -> argparse.ArgumentParser:
    """Add one verb; those that take a case share its options."""
    verb = verbs.add_parser(name, help=says, description=f'{says[0].upper()}{says[1:]}.')
    verb.set_defaults(run=run, replace=False, outputs=())
    how_loud = verb.add_mutually_exclusive_group()
    how_loud.add_argument('-q', '--quiet', action='store_true',
                          help='neither warnings nor progress, only results and errors')
    how_loud.add_argument('-v', '--verbose', action='store_true', help='say what is being done')
    if case:
        verb.add_argument('case', metavar='CASE', type=Path,
                          help='case file (YAML), or the name of a shipped case')
        verb.add_argument('--set', metavar='KEY.PATH=VALUE', dest='overrides', action='append',
                          default=[], help='override the case file, as in '
                                           'foundations.0.mass=420; may be repeated')
        verb.add_argument('--cache', metavar='DIR', type=Path,
                          help='directory of computed tables (else $ROTORSOIL_CACHE, else the '
                               "user's cache directory)")
    return verb


def add_output(
    verb: argparse.ArgumentParser, metavar: str, says: str, *, default: str | None = None,
    acts: bool = False, required: bool = True,
) -> None:
    """Add an output that is refused if it exists, and what replaces it."""
    if default == '-':
        verb.add_argument('-o', '--output', metavar=metavar, default='-',
                          help=f'{says}; - is standard output (default)')
    else:
        verb.add_argument('-o', '--output', metavar=metavar, type=Path,
                          default=default and Path(default),
                          required=required and default is None,
                          help=says + (f' (default: {default})' if default else ''))
    verb.set_defaults(outputs=('output',), makes_directory=metavar == 'DIR', acting_at=None)
    if acts:
        verb.add_argument('--force', metavar='CHANNEL', nargs='?', action=_Force,
                          help='where a force acts, as in disc_1_z (a block that turns, as in '
                               'block_ry: 1 N m); without CHANNEL: replace what exists')
    else:
        verb.add_argument('--force', nargs=0, action=_Force, help='replace what exists')


def add_table_output(verb: argparse.ArgumentParser, *, acts: bool = False) -> None:
    """Add the output and the units of a table."""
    add_output(verb, 'FILE', 'CSV file to write', default='-', acts=acts)
    add_units(verb)


def add_units(verb: argparse.ArgumentParser, *, printed: bool = False) -> None:
    """Add the units of a table, or of what is printed for people."""
    one, other = (' (default)', '') if printed else (' (default on a terminal)',
                                                    ' (default in files)')
    verb.add_argument('--units', choices=(PLANT, SI),
                      help=f'plant: um peak-to-peak, mm/s rms, rpm, Hz, degrees of lag{one}; '
                           f'si: m, rad, rad/s{other}')


def add_speed(verb: argparse.ArgumentParser) -> None:
    """Add where the speed is told, and how; None: as usual."""
    add = verb.add_argument_group('how the plant tells the speed').add_argument
    add('--speed-topic', metavar='T', help='topic (default: joint_states and rotor/speed of the '
                                           'machine)')
    add('--speed-type', metavar='TYPE', help='type of its messages, if the topic has several')
    add('--speed-field', metavar='PATH', help='number in the message, as in twist.angular.z or '
        "velocity[2] (default: the joint's velocity, or the only number)")
    add('--speed-unit', choices=UNITS_OF_SPEED, help='unit of the number (default: rad_s)')
    add('--speed-ratio', metavar='Q', type=float,
        help='turns of the rotor for one turn of what is told, negative where it counts '
             'backwards (default: 1)')
    add('--joint', '--rotor-joint', metavar='NAME', dest='speed_joint',
        help='joint of a JointState (default: rotor)')
