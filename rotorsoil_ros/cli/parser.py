"""What may stand behind `rotorsoil`."""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import get_close_matches
import math
from pathlib import Path
from typing import Any, NoReturn, TypeAlias

import rotorsoil_ros

PLANT, SI = 'plant', 'si'
_LONGEST_SWEEP = 10_000_000
_SPEED_UNITS = ('rad_s', 'rpm', 'hz', 'deg_s')  # of `units`, which to import takes long


class _OneLineParser(argparse.ArgumentParser):
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


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """Return what a command line asks for, or leave with one line that says what is wrong."""
    top = parser()
    arguments, unknown = top.parse_known_args(argv)
    if unknown:
        near = get_close_matches(unknown[0].partition('=')[0], arguments.options, n=1)
        advice = f'; did you mean {near[0]}?' if near else ''
        top.error(f'unrecognized arguments: {" ".join(unknown)}{advice}')
    return arguments


@dataclass(frozen=True, slots=True)
class Sweep:
    """Evenly spaced values `start:stop:count`, ends included."""

    start: float
    stop: float
    count: int

    @classmethod
    def parse(cls, text: str) -> 'Sweep':
        """Return the sweep that a command line asks for."""
        try:
            start, stop, count = text.split(':')
            sweep = cls(float(start), float(stop), int(count))
        except ValueError as error:
            raise argparse.ArgumentTypeError(
                f'must be start:stop:count, ends included, got {text!r}') from error
        if not (0.0 <= sweep.start <= sweep.stop < math.inf):
            raise argparse.ArgumentTypeError(
                f'must rise from start >= 0 to a finite stop, got {text!r}')
        if not 1 <= sweep.count <= _LONGEST_SWEEP:
            raise argparse.ArgumentTypeError(
                f'must have 1 to {_LONGEST_SWEEP} values, got {text!r}')
        return sweep


def _rpm(text: str) -> float:
    try:
        speed = float(text)
    except ValueError:
        speed = math.nan
    if not 0.0 <= speed < math.inf:
        raise argparse.ArgumentTypeError(f'must be a speed >= 0 rpm, got {text!r}')
    return speed


def _order(text: str) -> float:
    try:
        order = float(text)
    except ValueError:
        order = math.nan
    if not 0.0 < order < math.inf:
        raise argparse.ArgumentTypeError(f'must be a multiple > 0 of the speed, got {text!r}')
    return order


def _modes(text: str) -> int:
    if not (text.isascii() and text.isdigit() and int(text[:4]) >= 1 and len(text) <= 3):
        raise argparse.ArgumentTypeError(f'must be 1 to 999 modes, got {text!r}')
    return int(text)


def _rate(text: str) -> float:
    try:
        rate = float(text)
    except ValueError:
        rate = math.nan
    if not 0.0 < rate < math.inf:
        raise argparse.ArgumentTypeError(f'must be a factor > 0, got {text!r}')
    return rate


def parser() -> argparse.ArgumentParser:
    """Return the parser of all verbs; each sets `run` to `module:function` of this package."""
    top = _OneLineParser(
        prog='rotorsoil', description='What a rotor on real soil should vibrate like.')
    top.add_argument('--version', action='version', version=rotorsoil_ros.__version__)
    verbs = top.add_subparsers(metavar='VERB', required=True)
    _add_case_verbs(verbs)
    _add_import_verbs(verbs)
    _add_live_verbs(verbs)
    completion = _verb(verbs, 'completion', 'completion:completion',
                       'print what lets a shell complete verbs and options', case=False)
    completion.add_argument('shell', choices=('bash', 'zsh', 'fish'))
    for verb in verbs.choices.values():
        verb.set_defaults(options=list(verb._option_string_actions))
    return top


_Verbs: TypeAlias = 'argparse._SubParsersAction[_OneLineParser]'


def _verb(
    verbs: _Verbs, name: str, run: str, says: str, *, case: bool = True,
) -> argparse.ArgumentParser:
    """Add one verb; those that take a case share its options."""
    verb = verbs.add_parser(name, help=says, description=f'{says[0].upper()}{says[1:]}.')
    verb.set_defaults(run=run, replace=False, outputs=())
    how_loud = verb.add_mutually_exclusive_group()
    how_loud.add_argument('-q', '--quiet', action='store_true',
                          help='neither warnings nor progress, only results and errors')
    how_loud.add_argument('-v', '--verbose', action='store_true', help='say what is being done')
    if case:
        verb.add_argument('case', metavar='CASE', type=Path, help='case file (YAML)')
        verb.add_argument('--set', metavar='KEY.PATH=VALUE', dest='overrides', action='append',
                          default=[], help='override the case file, as in '
                                           'foundations.0.mass=420; may be repeated')
        verb.add_argument('--cache', metavar='DIR', type=Path,
                          help='directory of computed tables (else $ROTORSOIL_CACHE, else the '
                               "user's cache directory)")
    return verb


def _add_output(
    verb: argparse.ArgumentParser, metavar: str, says: str, *, default: str | None = None,
    acts: bool = False,
) -> None:
    """Add an output that is refused if it exists, and what replaces it."""
    if default == '-':
        verb.add_argument('-o', '--output', metavar=metavar, default='-',
                          help=f'{says}; - is standard output (default)')
    else:
        verb.add_argument('-o', '--output', metavar=metavar, type=Path,
                          default=default and Path(default), required=default is None,
                          help=says + (f' (default: {default})' if default else ''))
    verb.set_defaults(outputs=('output',), makes_directory=metavar == 'DIR', acting_at=None)
    if acts:
        verb.add_argument('--force', metavar='CHANNEL', nargs='?', action=_Force,
                          help='where a force acts, as in disc_1_z (a block that turns, as in '
                               'block_ry: 1 N m); without CHANNEL: replace what exists')
    else:
        verb.add_argument('--force', nargs=0, action=_Force, help='replace what exists')


def _add_table_output(verb: argparse.ArgumentParser, *, acts: bool = False) -> None:
    """Add the output and the units of a table."""
    _add_output(verb, 'FILE', 'CSV file to write', default='-', acts=acts)
    _add_units(verb)


def _add_units(verb: argparse.ArgumentParser) -> None:
    verb.add_argument('--units', choices=(PLANT, SI),
                      help='plant: um peak-to-peak, mm/s rms, rpm, Hz, degrees of lag (default on '
                           'a terminal); si: m, rad, rad/s (default in files)')


def _add_new(verbs: _Verbs) -> None:
    new = _verb(verbs, 'new', 'new:new', 'write the case of a machine from what a plant knows',
                case=False)
    new.add_argument('kind', metavar='KIND', nargs='?',
                     help='fan, pump, motor_driven or turbine')
    new.add_argument('--answer', metavar='KEY=VALUE', dest='answers', action='append', default=[],
                     help='what is known, as in rpm=990; may be repeated (default: asked for on a '
                          'terminal)')
    new.add_argument('--questions', action='store_true', help='list what may be answered')
    _add_output(new, 'CASE.yaml', 'case file to write', default='-')


def _add_case_verbs(verbs: _Verbs) -> None:
    _add_new(verbs)
    _verb(verbs, 'check', 'report:check',
          'validate a case; print its derived quantities and warnings')
    report = _verb(verbs, 'report', 'report:report',
                   'judge on one page whether the foundation is right for the machine')
    report.add_argument('--rpm', metavar='R', type=_rpm, required=True,
                        help='running speed [rpm]')
    _add_output(report, 'DIR', 'directory for report.html and report.json', default='report')
    _verb(verbs, 'tabulate', 'report:tabulate', 'compute or load the tables of a case')
    compliance = _verb(verbs, 'compliance', 'sweeps:compliance',
                       'write the compliance of the soil under a block as CSV')
    sweep = compliance.add_mutually_exclusive_group(required=True)
    sweep.add_argument('--a0', metavar='A:B:N', type=Sweep.parse,
                       help='dimensionless frequency, omega b / c_s or omega r0 / c_s')
    sweep.add_argument('--hz', metavar='A:B:N', type=Sweep.parse, help='frequency [Hz]')
    compliance.add_argument('--foundation', metavar='NAME', help='which block, if several')
    _add_table_output(compliance)
    response = _verb(verbs, 'response', 'sweeps:response',
                     'write the unbalance response of every channel as CSV')
    sweep = response.add_mutually_exclusive_group(required=True)
    sweep.add_argument('--rpm', metavar='A:B:N', type=Sweep.parse, help='rotor speed [rpm]')
    sweep.add_argument('--hz', metavar='A:B:N', type=Sweep.parse, help='rotor speed [turns/s]')
    response.add_argument('--order', metavar='N', type=_order,
                          help='a force of 1 N at N times the speed instead of the unbalance; '
                               'needs --force CHANNEL')
    _add_table_output(response, acts=True)
    bearings = _verb(verbs, 'bearings', 'sweeps:bearings',
                     'write coefficients and oil films of all bearings as CSV')
    bearings.add_argument('--rpm', metavar='A:B:N', type=Sweep.parse, required=True,
                          help='rotor speed [rpm]')
    _add_table_output(bearings)
    _add_modal_verbs(verbs)
    plot = _verb(verbs, 'plot', 'pictures:plot', 'draw every picture of a case')
    _add_output(plot, 'DIR', 'directory for the PNG files')
    figures = _verb(verbs, 'figures', 'pictures:figures',
                    "compute the seed paper's figures 6, 8 and 9", case=False)
    _add_output(figures, 'DIR', 'directory for PNG and CSV files')
    figures.add_argument('--cache', metavar='DIR', type=Path, help='directory of computed tables')


def _add_modal_verbs(verbs: _Verbs) -> None:
    frf = _verb(verbs, 'frf', 'sweeps:frf',
                'write the response of every channel to a harmonic force of 1 N as CSV')
    frf.add_argument('--rpm', metavar='R', type=_rpm, required=True,
                     help='rotor speed [rpm]; 0 is an impact test at rest')
    frf.add_argument('--hz', metavar='A:B:N', type=Sweep.parse, required=True,
                     help='frequency of the force [Hz]')
    _add_table_output(frf, acts=True)
    campbell = _verb(verbs, 'campbell', 'modal:campbell',
                     'write natural frequencies, damping and whirl over the speed as CSV')
    campbell.add_argument('--rpm', metavar='A:B:N', type=Sweep.parse,
                          help='rotor speed [rpm] (with --criticals: A to B; default: the speed '
                               'range of the case)')
    campbell.add_argument('--modes', metavar='K', type=_modes,
                          help='how many modes at each speed, the lowest (default: eight)')
    campbell.add_argument('--criticals', action='store_true',
                          help='write the critical speeds instead')
    campbell.add_argument('--running', metavar='R', type=_rpm,
                          help='with --criticals: running speed [rpm], from which separation '
                               'margins (API 617) are written too')
    campbell.add_argument('--damping', action='store_true',
                          help='with --criticals: also which share of the damping is of the '
                               'bearings, pedestals, radiation, material of the soil')
    _add_table_output(campbell)


def _add_import_verbs(verbs: _Verbs) -> None:
    table = _verb(verbs, 'import', 'exchange:import_table',
                  'turn a measured table (CSV, Excel, UFF 58) into a bag with speed and vectors',
                  case=False)
    table.add_argument('table', metavar='TABLE', type=Path, help='CSV, .xlsx, or .uff')
    _add_output(table, 'BAG', 'MCAP file to write, or a new bag directory')
    table.add_argument('--map', metavar='MAP.yaml', type=Path, help='which column is what')
    add = table.add_argument_group('instead of a map, for a table with one channel').add_argument
    for name, says in (
            ('machine', 'name of the machine'), ('channel', 'where it was measured, as in '
             'drive_end_housing_x'), ('time', 'column of the time'),
            ('time-unit', 's, ms, min...'),
            ('time-format', 'iso, or as in %%d.%%m.%%Y %%H:%%M:%%S'),
            ('time-every', 'without a column: turn, or seconds between rows'),
            ('time-start', 'date at which times begin'), ('speed', 'column of the speed'),
            ('speed-unit', 'rpm, Hz, rad/s or deg/s'), ('amplitude', 'column of the amplitude'),
            ('amplitude-unit', 'as in um p-p, mm/s rms, mil 0-p'),
            ('phase', 'column of the phase'), ('phase-unit', 'deg or rad'),
            ('phase-sense', 'lag or lead')):
        add(f'--{name}', metavar=name.split('-')[-1].upper(), help=says)
    export = _verb(verbs, 'export', 'exchange:export',
                   'write speed, predicted, measured, residual and zone of a log as a long table',
                   case=False)
    export.add_argument('log', metavar='LOG', type=Path, help='MCAP file or bag')
    _add_output(export, 'X.parquet or X.csv', 'table to write')
    export.add_argument('--machine', metavar='NAME', help='which machine (default: all)')
    ross = _verb(verbs, 'import-ross', 'bags:import_ross',
                 'write the case of a rotor that ROSS saved as TOML or JSON', case=False)
    ross.add_argument('rotor', metavar='ROTOR', type=Path, help='what Rotor.save wrote')
    _add_output(ross, 'CASE.yaml', 'case file to write', default='-')
    ross.add_argument('--rpm', metavar='A:B:N', type=Sweep.parse,
                      help='speed range of the case, A to B (default: what the tables of the '
                           'bearings cover)')


def _add_live_verbs(verbs: _Verbs) -> None:
    predict = _verb(verbs, 'predict', 'bags:predict',
                    'answer every speed of a recorded profile, without a ROS graph')
    predict.add_argument('profile', metavar='PROFILE', type=Path, help='MCAP file or bag')
    _add_output(predict, 'OUT.mcap', 'log to write')
    predict.add_argument('--rrd', metavar='OUT.rrd', type=Path,
                         help='recording for the rerun viewer')
    predict.set_defaults(outputs=('output', 'rrd'))
    _add_speed(predict)
    replay = _verb(verbs, 'replay', 'bags:replay',
                   'publish a recorded profile into the ROS graph', case=False)
    replay.add_argument('profile', metavar='PROFILE', type=Path, help='MCAP file or bag')
    replay.add_argument('--rate', metavar='R', type=_rate, default=1.0,
                        help='speed of replay (default: 1, as recorded)')
    replay.add_argument('--machine', metavar='NAME', help='whose speed it is, if no topic says')
    _add_speed(replay)
    recover = _verb(verbs, 'recover', 'bags:recover',
                    'save everything readable of a log whose writer was killed', case=False)
    recover.add_argument('broken', metavar='BROKEN.mcap', type=Path, help='MCAP file')
    _add_output(recover, 'FIXED.mcap', 'file to write')
    _add_compare(verbs)
    demo = _verb(verbs, 'demo', 'demo:demo',
                 'run up, dwell and coast down a machine before a live node', case=False)
    _add_output(demo, 'DIR', 'directory for log, recording and plots', default='demo_output')


def _add_speed(verb: argparse.ArgumentParser) -> None:
    """Add where the speed is told, and how; None: as usual."""
    add = verb.add_argument_group('how the plant tells the speed').add_argument
    add('--speed-topic', metavar='T', help='topic (default: joint_states and rotor/speed of the '
                                           'machine)')
    add('--speed-type', metavar='TYPE', help='type of its messages, if the topic has several')
    add('--speed-field', metavar='PATH', help='number in the message, as in twist.angular.z or '
        "velocity[2] (default: the joint's velocity, or the only number)")
    add('--speed-unit', choices=_SPEED_UNITS, help='unit of the number (default: rad_s)')
    add('--speed-ratio', metavar='Q', type=float,
        help='turns of the rotor for one turn of what is told, negative where it counts '
             'backwards (default: 1)')
    add('--joint', '--rotor-joint', metavar='NAME', dest='speed_joint',
        help='joint of a JointState (default: rotor)')


def _add_compare(verbs: _Verbs) -> None:
    compare = _verb(verbs, 'compare', 'compare:compare',
                    'hold a log of measured vibration against its prediction', case=False)
    add = compare.add_argument
    add('log', metavar='LOG', type=Path, help='MCAP file or bag with speed and measured topics')
    add('case', metavar='CASE', type=Path, nargs='?',
        help='case file (YAML); needed for band, critical speeds and zones, unless the log was '
             'answered with a case of this package')
    _add_output(compare, 'DIR', 'directory for tables, pictures and report',
                default='comparison')
    compare.set_defaults(outputs=('output', 'write_case'))
    add('--set', metavar='KEY.PATH=VALUE', dest='overrides', action='append', default=[],
        help='override the case file; may be repeated')
    add('--cache', metavar='DIR', type=Path, help='directory of computed tables')
    add('--machine', metavar='NAME', help='which machine, if the log tells of several')
    _add_speed(compare)
    add('--tolerance-s', metavar='S', type=_positive, default=0.05,
        help='largest distance of stamps that belong together [s] (default: %(default)s)')
    add('--slow-roll-rpm', metavar='R', type=_positive,
        help='speed whose vector is runout and is subtracted [rpm]')
    add('--noise-um', metavar='A', type=_positive, default=0.0,
        help='amplitude below which nothing is compared [um] (default: %(default)s)')
    add('--soil-factor', metavar='F', type=_positive,
        help='G lies within this factor of the case (default: what the case says, or 2)')
    add('--margin', metavar='M', type=_positive, default=0.10,
        help='share by which an amplitude may leave the band (default: %(default)s)')
    add('--zone-group', type=int, choices=(1, 2),
        help='group of ISO 10816-3:2009, 1 above 300 kW (default: what the case says, or 2)')
    add('--identify-unbalance', action='store_true',
        help='print the unbalance that explains the run best')
    add('--identify', metavar='KEY.PATH', action='append', default=[],
        help='with it, a scalar of the case, as in soil.shear_modulus or '
             'rotor.bearings.*.stiffness; may be repeated')
    add('--plane', metavar='DISC', action='append', default=[],
        help='with it, whose unbalance is unknown (default: of every disc); may be repeated')
    add('--identify-growth', action='store_true',
        help='with it, by how much the unbalance grows over the run')
    add('--identify-runout', action='store_true',
        help='with it, a constant vector of every channel')
    add('--with-transients', action='store_true',
        help='identify from points that are not quasi-static too')
    add('--write-case', metavar='FILE', type=Path, help='write the case as identified')


def _positive(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value < math.inf:
        raise argparse.ArgumentTypeError(f'must be a number >= 0, got {text!r}')
    return value
