"""Natural frequencies and critical speeds, as CSV."""

from argparse import Namespace
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
import csv
import math
import sys

from rotorsoil_ros.case import cache, models
from rotorsoil_ros.case.config import Case, load
from rotorsoil_ros.case.summary import clipped, stability_doubts, undecided, unstable
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.cli.sweeps import opened, values
from rotorsoil_ros.errors import InputError, NotSolvedError
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.margins import asked, half_power_factors
from rotorsoil_ros.machine.mode_names import ModeNames
from rotorsoil_ros.machine.modes import campbell as campbell_of, critical_speeds, CriticalSpeed
from rotorsoil_ros.machine.stability import stability
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, rpm_to_rad_s


def campbell(arguments: Namespace) -> int:
    """Write every mode at every speed, or the speeds that excite one."""
    case = load(arguments.case, arguments.overrides)
    model = models.coupled_model(case, cache.directory(arguments.cache))
    if arguments.criticals:
        with _naming(case):
            return _criticals(arguments, case, model)
    if arguments.rpm is None:
        raise InputError('--rpm is missing; only --criticals has the speed range of the case')
    if arguments.running is not None:
        raise InputError('--running needs --criticals')
    speed = rpm_to_rad_s(values(arguments.rpm))
    with _naming(case), progress('solving') as _:
        found = campbell_of(model, speed, arguments.modes)
    for at, omega in zip(speed.tolist(), found.untold.tolist(), strict=True):
        if omega < math.inf:
            print(f'{case.path}: at {rad_s_to_rpm(at):g} rpm a mode near {rad_s_to_hz(omega):.4g} '
                  'Hz is missing: the support does not determine it', file=sys.stderr)
    _tell_unstable(case, model, float(speed.max()))
    # A speed may have fewer modes than wanted.
    rows = [(at, mode + 1, *numbers) for at, *of_speed in zip(
                speed.tolist(), found.omega.tolist(), found.damping_ratio.tolist(),
                found.whirl.tolist(), strict=True)
            for mode, numbers in enumerate(zip(*of_speed, strict=True)) if numbers[2] != 0]
    _write(arguments.output, ['speed_rad_s', 'mode', 'omega_rad_s', 'damping_ratio', 'whirl'],
           rows)
    return 0


def _tell_unstable(case: Case, model: CoupledModel, highest: float) -> None:
    """Say on standard error which modes grow on their own up to a speed [rad/s]."""
    with _naming(case):
        found = stability(model, (0.0, highest))
    for text in (*unstable(found), *stability_doubts(found)):
        print(f'{case.path}: {text}', file=sys.stderr)


@contextmanager
def _naming(case: Case) -> Iterator[None]:
    """Say which key of a case is to blame where modes cannot be found."""
    try:
        yield
    except NotSolvedError as error:
        raise InputError(f'{case.path}: {undecided(case, error)}') from error


def _criticals(arguments: Namespace, case: Case, model: CoupledModel) -> int:
    speed_range = case.speed_range
    if arguments.rpm is not None:
        low, high = arguments.rpm.start, arguments.rpm.stop
        if not low < high:
            raise InputError(f'--rpm must rise with --criticals, got {low:g} to {high:g} rpm')
        speed_range = rpm_to_rad_s(low), rpm_to_rad_s(high)
    running = None if arguments.running is None else rpm_to_rad_s(arguments.running)
    if running is not None:
        if not running > 0.0:
            raise InputError(f'--running must be > 0 rpm, got {arguments.running:g}')
        speed_range = _as_far_as_margins_ask(model, speed_range, running)
    with progress('solving') as _:
        criticals = critical_speeds(model, speed_range)
        names = ModeNames(model)
        sharp = half_power_factors(model, criticals)
    rows: list[tuple[float | str, ...]] = [
        (*_row(critical, factor, running), names.of_critical(critical))
        for critical, factor in zip(criticals, sharp, strict=True)]
    _tell_unstable(case, model, speed_range[1])
    header = ['speed_rad_s', 'whirl', 'damping_ratio']
    if running is not None:
        header += ['amplification_factor', 'separation_margin', 'required_margin',
                   'half_power_factor']
    if not rows:
        low, high = (rad_s_to_rpm(speed) for speed in speed_range)
        print(f'{case.path}: no critical speed from {low:g} up to {high:g} rpm', file=sys.stderr)
    _write(arguments.output, [*header, 'name'], rows)
    return 0


def _as_far_as_margins_ask(
    model: CoupledModel, speed_range: tuple[float, float], running: float,
) -> tuple[float, float]:
    """Widen a range of speeds [rad/s] to where a margin could be missed; say if tables end."""
    low, high = asked(running)
    wanted = min(low, speed_range[0]), max(high, speed_range[1])
    span = model.within_tables(wanted)
    for text in clipped(span, wanted):
        print(f'{text}; margins beyond are not known', file=sys.stderr)
    return span


def _row(critical: CriticalSpeed, half_power: float, running: float | None) -> tuple[float, ...]:
    row: tuple[float, ...] = critical.speed, critical.whirl, critical.damping_ratio
    if running is None:
        return row
    return (*row, critical.amplification_factor, critical.separation_margin(running),
            critical.required_margin(running, half_power=half_power), half_power)


def _write(target: str, header: Iterable[str], rows: Iterable[tuple[float | str, ...]]) -> None:
    with opened(target) as stream:
        table = csv.writer(stream, lineterminator='\n')
        table.writerow(header)
        table.writerows(rows)
