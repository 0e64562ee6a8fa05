"""Is what was put into synthetic signals found again? A comparison that needs no plant."""

from importlib.resources import as_file, files
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from rotorsoil_ros.bags.comparison import compare
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.synthetic import profile, Truth, write_synthetic
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.figures.report import write_report
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.identification.case import Identification, identify_case, Wanted
from rotorsoil_ros.monitor.identification.words import describe
from rotorsoil_ros.screen import recorder

CASE, PLANE, SOIL = 'plant_fan', 'wheel', 'soil.shear_modulus'
SYNTHETIC_FAN = f'synthetic_{CASE}'  # its name in every topic and on the screen

# Softer ground than the case has, and in a time lapse a wheel on which dust settles.
_TRUTH = Truth(shear_modulus_factor=0.7, growth=6.0, noise=0.05, ramp_s=20.0, dwell_s=6.0,
               rate_hz=800.0)
_WANTED = Wanted(scalars=[SOIL], planes=[PLANE], growth=True)


def demonstrate_comparison(out: Path, directory: Path, *, start_ns: int) -> None:
    """
    Make signals by integration in time, answer them, compare them, and print what was found.

    Parameters
    ----------
    out, directory : Path
        Where everything is left, and the cache of tables.
    start_ns : int
        Stamp of the first sample [ns].

    """
    out.mkdir(exist_ok=True)
    signals, log = out / 'signals.mcap', out / f'{SYNTHETIC_FAN}.mcap'
    recording = out / f'{SYNTHETIC_FAN}.rrd' if find_spec('rerun') else None
    with as_file(files('rotorsoil_ros') / 'config' / f'{CASE}.yaml') as path:
        with progress('integrating the equations of motion') as _:
            machine = Machine.load(path, cache_directory=directory)
            write_synthetic(signals, SYNTHETIC_FAN, machine.model, machine.case.unbalance,
                            truth=_TRUTH, start_ns=start_ns)
        with progress('answering') as report:
            predict(machine, signals, log, progress=report,
                    screen=recorder(recording, machine) if recording else None)
        with progress('comparing') as report:
            comparison = compare(log, cache_directory=directory, progress=report)
        with progress('identifying') as _:
            found = identify_case(comparison, _WANTED)
        with progress('drawing') as _:
            write_report(comparison, out, source=str(log), identification=list(describe(found)),
                         found=found)
    _print(found, comparison, start_ns=start_ns)
    print(f'verdict   {_verdict(comparison)}')
    print(f'report    {out / "report.html"}')
    if recording is not None:
        print(f'recording {recording}   (rerun {recording})')


def _verdict(comparison: Comparison) -> str:
    said, failures = str(comparison.verdict), comparison.failures
    if failures:
        said += f': {failures[-1]}'
    return said + (f' (and {len(failures) - 1} more)' if len(failures) > 1 else '')


def put_in(comparison: Comparison, moment: float, *, start_ns: int) -> tuple[float, float]:
    """Return the true unbalance at the first and at the last vector that is used [kg m]."""
    used = np.concatenate([points.stamp_ns[points.used] for points in comparison.points])
    time, _ = profile(_TRUTH)
    first, last = (moment * (1.0 + _TRUTH.growth * (stamp - start_ns) / NANOSECONDS / time[-1])
                   for stamp in (int(used.min()), int(used.max())))
    return first, last


def _print(found: Identification, comparison: Comparison, *, start_ns: int) -> None:
    case = comparison.expectation.case
    given = float(np.abs(case.unbalance[comparison.expectation.table.planes.index(PLANE)]))
    first, last = put_in(comparison, given, start_ns=start_ns)
    start, growth = (complex(found.moment[found.columns.index(name)])
                     for name in (PLANE, f'growth of {PLANE}'))
    print(f'{CASE}: SYNTHETIC sensors of {comparison.run.time[-1]:.0f} s, '
          'compared with the case')
    print(f'  {"":44s} {"put in":>8s} {"found":>8s}')
    for name, truth, value in (
            ('G of the ground over that of the case', _TRUTH.shear_modulus_factor,
             float(found.factor[0])),
            (f'unbalance of the {PLANE}, first vector [kg m]', first, abs(start)),
            (f'unbalance of the {PLANE}, last vector [kg m]', last, abs(start + growth))):
        print(f'  {name:44s} {truth:8.4f} {value:8.4f}')
