"""Natural frequencies and critical speeds, as CSV."""

from argparse import Namespace
import math
import sys

from rotorsoil_ros.case.design.margins import separation_margins
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.summary import clipped, stability_doubts, unstable
from rotorsoil_ros.cli.arguments.options import PLANT
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.cli.sweeps import machine_of, values
from rotorsoil_ros.cli.table import units_of, write_table
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.machine.damping import DAMPERS, DampingSplit, DampingSplitter
from rotorsoil_ros.machine.modes.critical import asked
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, rpm_to_rad_s


def campbell(arguments: Namespace) -> int:
    """Write every mode at every speed, or the speeds that excite one."""
    machine = machine_of(arguments)
    if arguments.criticals:
        return _criticals(arguments, machine)
    if arguments.rpm is None:
        raise InputError('--rpm is missing; only --criticals has the speed range of the case')
    if arguments.running is not None:
        raise InputError('--running needs --criticals')
    if arguments.damping:
        raise InputError('--damping needs --criticals')
    with progress('solving') as _:
        given = {} if arguments.modes is None else {'modes': arguments.modes}
        found = machine.campbell(rpm=values(arguments.rpm), **given)
    for at, omega in zip(found.speed_rpm.tolist(), found.untold.tolist(), strict=True):
        if omega < math.inf:
            print(f'{machine.case.path}: at {at:g} rpm a mode near {rad_s_to_hz(omega):.4g} Hz is '
                  'missing: the support does not determine it', file=sys.stderr)
    _tell_unstable(machine, float(found.speed_rpm.max()))
    plant = units_of(arguments) == PLANT
    header = (['speed_rpm', 'mode', 'frequency_hz'] if plant
              else ['speed_rad_s', 'mode', 'omega_rad_s'])
    speed = found.speed_rpm if plant else found.speed
    frequency = found.frequency_hz if plant else found.omega
    # A speed may have fewer modes than wanted.
    rows = [(at, mode + 1, *numbers, *_neighbour(machine, owner)) for at, owners, *of_speed in zip(
                speed.tolist(), found.owner.tolist(), frequency.tolist(),
                found.damping_ratio.tolist(), found.whirl.tolist(), strict=True)
            for mode, (owner, *numbers) in enumerate(zip(owners, *of_speed, strict=True))
            if numbers[2] != 0]
    write_table(arguments.output, [*header, 'damping_ratio', 'whirl', *_of_plant(machine)], rows)
    return 0


def _of_plant(machine: Machine) -> list[str]:
    """Return the column that says of a machine among others whose modes are whose."""
    return ['neighbour'] if len(machine.model.machines) > 1 else []


def _neighbour(machine: Machine, owner: int) -> list[str]:
    """Return the neighbour that a mode is of, if it has a column."""
    return [machine.model.machines[owner - 1] if owner else '' for _ in _of_plant(machine)]


def _tell_unstable(machine: Machine, highest_rpm: float) -> None:
    """Say on standard error which modes grow on their own up to a speed."""
    found = machine.stability(rpm_range=(0.0, highest_rpm))
    for text in (*unstable(found), *stability_doubts(found)):
        print(f'{machine.case.path}: {text}', file=sys.stderr)


def _criticals(arguments: Namespace, machine: Machine) -> int:
    low, high = _range_of(arguments, machine)
    with progress('solving') as _:
        criticals = machine.critical_speeds(rpm_range=(low, high))
    plant = units_of(arguments) == PLANT
    header = ['speed_rpm' if plant else 'speed_rad_s', 'whirl', 'damping_ratio',
              *_of_plant(machine)]
    rows: list[tuple[float | str, ...]] = [
        (critical.speed_rpm if plant else critical.speed, critical.whirl, critical.damping_ratio,
         *_neighbour(machine, critical.owner)) for critical in criticals]
    if arguments.running is not None:
        header += ['amplification_factor', 'separation_margin', 'required_margin',
                   'half_power_factor', 'name']
        running = rpm_to_rad_s(arguments.running)
        rows = [(*row, one.critical.amplification_factor, one.margin, one.required,
                 one.half_power_factor, one.name) for row, one in zip(
            rows, separation_margins(machine.model, criticals, running), strict=True)]
    if arguments.damping:
        header += [f'{kind.replace(" ", "_")}_share' for kind in DAMPERS]
        rows = [(*row, *_shares(split)) for row, split in zip(
            rows, DampingSplitter(machine.model).of_modes(criticals), strict=True)]
    _tell_unstable(machine, high)
    if not rows:
        print(f'{machine.case.path}: no critical speed from {low:g} up to {high:g} rpm',
              file=sys.stderr)
    write_table(arguments.output, header, rows)
    return 0


def _shares(split: DampingSplit | None) -> list[float | str]:
    """Return the share of every kind; nothing where a mode has none, or hardly swings."""
    return ['' if split is None or kind not in split.kinds else float(split.share(kind)[0])
            for kind in DAMPERS]


def _range_of(arguments: Namespace, machine: Machine) -> tuple[float, float]:
    """Return between which speeds [rpm] to look: with margins as far as one can be missed."""
    low, high = (rad_s_to_rpm(speed) for speed in machine.case.speed_range)
    if arguments.rpm is not None:
        low, high = arguments.rpm.start, arguments.rpm.stop
        if not low < high:
            raise InputError(f'--rpm must rise with --criticals, got {low:g} to {high:g} rpm')
    running = arguments.running
    if running is None:
        return low, high
    if not running > 0.0:
        raise InputError(f'--running must be > 0 rpm, got {running:g}')
    least, most = asked(rpm_to_rad_s(running))
    wanted = min(least, rpm_to_rad_s(low)), max(most, rpm_to_rad_s(high))
    span = machine.model.support.within(machine.model.bearings.within_tables(wanted))
    for text in clipped(machine.model, span, wanted):
        print(f'{text}; margins beyond are not known', file=sys.stderr)
    return rad_s_to_rpm(span[0]), rad_s_to_rpm(span[1])
