"""What may stand behind `rotorsoil`."""

import argparse
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path

import rotorsoil_ros
from rotorsoil_ros.cli.arguments.feeds import add_feeds
from rotorsoil_ros.cli.arguments.options import (
    add_output,
    add_speed,
    add_table_output,
    add_units,
    add_verb,
    choices,
    MULTIPLE,
    number_of,
    OneLineParser,
    RATE,
    RPM,
    SIZE,
    Sweep,
    sweep_or_one,
    Verbs,
)


def parse(argv: Sequence[str] | None) -> argparse.Namespace:
    """Return what a command line asks for, or leave with one line that says what is wrong."""
    top = parser()
    arguments, unknown = top.parse_known_args(argv)
    if unknown:
        near = get_close_matches(unknown[0].partition('=')[0], arguments.options, n=1)
        advice = f'; did you mean {near[0]}?' if near else ''
        top.error(f'unrecognized arguments: {" ".join(unknown)}{advice}')
    return arguments


def parser() -> argparse.ArgumentParser:
    """Return the parser of all verbs; each sets `run` to `module:function` of this package."""
    top = OneLineParser(
        prog='rotorsoil', description='What a rotor on real soil should vibrate like.')
    top.add_argument('--version', action='version', version=rotorsoil_ros.__version__)
    verbs = top.add_subparsers(metavar='VERB', required=True)
    _add_case_verbs(verbs)
    _add_import_verbs(verbs)
    _add_live_verbs(verbs)
    add_feeds(verbs)
    completion = add_verb(verbs, 'completion', 'arguments.completion:completion',
                       'print what lets a shell complete verbs and options', case=False)
    completion.add_argument('shell', choices=('bash', 'zsh', 'fish'))
    for verb in verbs.choices.values():
        verb.set_defaults(options=list(verb._option_string_actions))
    return top


def _add_new(verbs: Verbs) -> None:
    new = add_verb(verbs, 'new', 'new:new', 'write the case of a machine from what a plant knows',
                case=False)
    new.add_argument('kind', metavar='KIND', nargs='?',
                     help='fan, pump, motor_driven or turbine')
    new.add_argument('--answer', metavar='KEY=VALUE', dest='answers', action='append', default=[],
                     help='what is known, as in rpm=990; may be repeated (default: asked for on a '
                          'terminal)')
    new.add_argument('--questions', action='store_true', help='list what may be answered')
    add_output(new, 'CASE.yaml', 'case file to write', default='-')


def _add_case_verbs(verbs: Verbs) -> None:
    _add_new(verbs)
    add_units(add_verb(verbs, 'check', 'report:check',
                       'validate a case; print its derived quantities and warnings'),
              printed=True)
    report = add_verb(verbs, 'report', 'report:report',
                   'judge on one page whether the foundation is right for the machine')
    report.add_argument('--rpm', metavar='R', type=RPM, required=True,
                        help='running speed [rpm]')
    add_output(report, 'DIR', 'directory for report.html and report.json', default='report')
    add_verb(verbs, 'tabulate', 'report:tabulate', 'compute or load the tables of a case')
    compliance = add_verb(verbs, 'compliance', 'sweeps:compliance',
                       'write the compliance of the soil under a block as CSV')
    sweep = compliance.add_mutually_exclusive_group(required=True)
    sweep.add_argument('--a0', metavar='A:B:N', type=Sweep.parse,
                       help='dimensionless frequency, omega b / c_s or omega r0 / c_s')
    sweep.add_argument('--hz', metavar='A:B:N', type=Sweep.parse, help='frequency [Hz]')
    compliance.add_argument('--foundation', metavar='NAME', help='which block, if several')
    add_table_output(compliance)
    seats = add_verb(verbs, 'seats', 'sweeps:seats',
                     'write how what the bearings stand on moves by forces there, as CSV')
    seats.add_argument('--hz', metavar='A:B:N', type=Sweep.parse, required=True,
                       help='frequency [Hz]')
    add_table_output(seats)
    response = add_verb(verbs, 'response', 'sweeps:response',
                     'write the unbalance response of every channel as CSV')
    sweep = response.add_mutually_exclusive_group(required=True)
    sweep.add_argument('--rpm', metavar='A:B:N', type=Sweep.parse, help='rotor speed [rpm]')
    sweep.add_argument('--hz', metavar='A:B:N', type=Sweep.parse, help='rotor speed [turns/s]')
    response.add_argument('--order', metavar='N', type=MULTIPLE,
                          help='a force of 1 N at N times the speed instead of the unbalance; '
                               'needs --force CHANNEL')
    add_table_output(response, acts=True)
    bearings = add_verb(verbs, 'bearings', 'sweeps:bearings',
                        'write coefficients and oil films of all bearings as CSV')
    bearings.add_argument('--rpm', metavar='A:B:N', type=Sweep.parse, required=True,
                          help='rotor speed [rpm]')
    add_table_output(bearings)
    _add_study(verbs)
    _add_modal_verbs(verbs)
    plot = add_verb(verbs, 'plot', 'pictures:plot', 'draw every picture of a case')
    add_output(plot, 'DIR', 'directory for the PNG files')
    figures = add_verb(verbs, 'figures', 'pictures:figures',
                    "compute the seed paper's figures 6, 8 and 9", case=False)
    add_output(figures, 'DIR', 'directory for PNG and CSV files')
    figures.add_argument('--cache', metavar='DIR', type=Path, help='directory of computed tables')


def _add_study(verbs: Verbs) -> None:
    study = add_verb(verbs, 'study', 'study:study',
                     'write the response with all values of some keys of a case as CSV')
    add = study.add_argument
    add('--vary', metavar='KEY.PATH=A:B:N', type=choices, action='append', required=True,
        help='key of the case, as in soil.shear_modulus, and what is tried: A to B in N steps, '
             'or V,V,V; may be repeated')
    add('--rpm', metavar='A:B:N', type=sweep_or_one, required=True, help='rotor speed [rpm]')
    add_table_output(study)
    add('--picture', metavar='X.png', type=Path,
        help='highest velocity of a housing over the one or two keys')
    add('--jobs', metavar='N', type=number_of('processes'), default=1,
        help='processes (default: 1)')
    study.set_defaults(outputs=('output', 'picture'))


def _add_modal_verbs(verbs: Verbs) -> None:
    frf = add_verb(verbs, 'frf', 'sweeps:frf',
                'write the response of every channel to a harmonic force of 1 N as CSV')
    frf.add_argument('--rpm', metavar='R', type=RPM, required=True,
                     help='rotor speed [rpm]; 0 is an impact test at rest')
    frf.add_argument('--hz', metavar='A:B:N', type=Sweep.parse, required=True,
                     help='frequency of the force [Hz]')
    add_table_output(frf, acts=True)
    ground = add_verb(verbs, 'transmissibility', 'sweeps:transmissibility',
                      'write the motion of every channel per motion of the ground as CSV')
    ground.add_argument('--hz', metavar='A:B:N', type=Sweep.parse, required=True,
                        help='frequency at which the ground moves [Hz]')
    ground.add_argument('--rpm', metavar='R', type=RPM, default=0.0,
                        help='rotor speed [rpm] (default: the machine stands)')
    add_table_output(ground)
    campbell = add_verb(verbs, 'campbell', 'modal:campbell',
                     'write natural frequencies, damping and whirl over the speed as CSV')
    campbell.add_argument('--rpm', metavar='A:B:N', type=Sweep.parse,
                          help='rotor speed [rpm] (with --criticals: A to B; default: the speed '
                               'range of the case)')
    campbell.add_argument('--modes', metavar='K', type=number_of('modes'),
                          help='how many modes at each speed, the lowest (default: eight)')
    campbell.add_argument('--criticals', action='store_true',
                          help='write the critical speeds instead')
    campbell.add_argument('--running', metavar='R', type=RPM,
                          help='with --criticals: running speed [rpm], from which separation '
                               'margins (API 617) are written too')
    campbell.add_argument('--damping', action='store_true',
                          help='with --criticals: also which share of the damping is of the '
                               'bearings, pedestals, radiation, material of the soil')
    add_table_output(campbell)


def _add_import_verbs(verbs: Verbs) -> None:
    table = add_verb(verbs, 'import', 'bags:import_table',
                  'turn a measured table (CSV, Excel, UFF 58) into a bag with speed and vectors',
                  case=False)
    table.add_argument('table', metavar='TABLE', type=Path, help='CSV, .xlsx, or .uff')
    add_output(table, 'BAG', 'MCAP file to write, or a new bag directory')
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
    export = add_verb(verbs, 'export', 'bags:export',
                   'write speed, predicted, measured, residual and zone of a log as a long table',
                   case=False)
    export.add_argument('log', metavar='LOG', type=Path, help='MCAP file or bag')
    add_output(export, 'X.parquet or X.csv', 'table to write')
    add_units(export)
    export.add_argument('--machine', metavar='NAME', help='which machine (default: all)')
    ross = add_verb(verbs, 'import-ross', 'bags:import_ross',
                 'write the case of a rotor that ROSS saved as TOML or JSON', case=False)
    ross.add_argument('rotor', metavar='ROTOR', type=Path, help='what Rotor.save wrote')
    add_output(ross, 'CASE.yaml', 'case file to write', default='-')
    ross.add_argument('--rpm', metavar='A:B:N', type=Sweep.parse,
                      help='speed range of the case, A to B (default: what the tables of the '
                           'bearings cover)')


def _add_predict(verbs: Verbs) -> None:
    predict = add_verb(verbs, 'predict', 'bags:predict',
                    'answer every speed of recorded profiles, without a ROS graph')
    add = predict.add_argument
    add('profiles', metavar='PROFILE', type=Path, nargs='+', help='MCAP file or bag')
    add_output(predict, 'OUT', 'log to write; of several profiles a directory, in which only '
                'what is new or has changed is answered again', required=False)
    add_units(predict, printed=True)
    add('--rrd', metavar='OUT.rrd', type=Path, help='recording for the rerun viewer')
    add('--statistics', metavar='X.parquet', type=Path,
        help='table to write of every minute and channel, .parquet or .csv; without -o '
             'predictions are not kept')
    add('--jobs', metavar='N', type=number_of('processes'), help='processes (default: 1)')
    add('--dask', metavar='ADDRESS', help='scheduler of a Dask cluster, instead of --jobs')
    predict.set_defaults(outputs=('output', 'rrd', 'statistics'))
    add_speed(predict)


def _add_live_verbs(verbs: Verbs) -> None:
    _add_predict(verbs)
    replay = add_verb(verbs, 'replay', 'bags:replay',
                   'publish a recorded profile into the ROS graph', case=False)
    replay.add_argument('profile', metavar='PROFILE', type=Path, help='MCAP file or bag')
    replay.add_argument('--rate', metavar='R', type=RATE, default=1.0,
                        help='speed of replay (default: 1, as recorded)')
    replay.add_argument('--machine', metavar='NAME', help='whose speed it is, if no topic says')
    add_speed(replay)
    recover = add_verb(verbs, 'recover', 'bags:recover',
                    'save everything readable of a log whose writer was killed', case=False)
    recover.add_argument('broken', metavar='BROKEN.mcap', type=Path, help='MCAP file')
    add_output(recover, 'FIXED.mcap', 'file to write')
    _add_compare(verbs)
    demo = add_verb(verbs, 'demo', 'demo:demo',
                 'run up, dwell and coast down a machine before a live node', case=False)
    add_output(demo, 'DIR', 'directory for log, recording and plots', default='demo_output')


def _add_compare(verbs: Verbs) -> None:
    compare = add_verb(verbs, 'compare', 'compare:compare',
                    'hold a log of measured vibration against its prediction', case=False)
    add = compare.add_argument
    add('log', metavar='LOG', type=Path, help='MCAP file or bag with speed and measured topics')
    add('case', metavar='CASE', type=Path, nargs='?',
        help='case file (YAML); needed for band, critical speeds and zones, unless the log was '
             'answered with a case of this package')
    add_output(compare, 'DIR', 'directory for tables, pictures and report',
                default='comparison')
    compare.set_defaults(outputs=('output', 'write_case'))
    add_units(compare, printed=True)
    add('--set', metavar='KEY.PATH=VALUE', dest='overrides', action='append', default=[],
        help='override the case file; may be repeated')
    add('--cache', metavar='DIR', type=Path, help='directory of computed tables')
    add('--machine', metavar='NAME',
        help='which machine, if the log tells of several; of a plant MACHINE or PLANT/MACHINE')
    add_speed(compare)
    add('--tolerance-s', metavar='S', type=SIZE, default=0.05,
        help='largest distance of stamps that belong together [s] (default: %(default)s)')
    add('--slow-roll-rpm', metavar='R', type=SIZE,
        help='speed whose vector is runout and is subtracted [rpm]')
    add('--noise-um', metavar='A', type=SIZE, default=0.0,
        help='amplitude below which nothing is compared [um] (default: %(default)s)')
    add('--soil-factor', metavar='F', type=SIZE,
        help='G lies within this factor of the case (default: what the case says, or 2)')
    add('--margin', metavar='M', type=SIZE, default=0.10,
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
