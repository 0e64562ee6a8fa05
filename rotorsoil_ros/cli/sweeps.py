"""What a case answers over a range, as CSV."""

from argparse import Namespace
from collections.abc import Callable
import math
import sys

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case.flexible.words import beyond_modes
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.together import Plant, sources_of
from rotorsoil_ros.case.summary import unstable
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.cli.arguments.options import PLANT, Sweep
from rotorsoil_ros.cli.table import (
    complex_columns,
    complex_names,
    units_of,
    write_responses,
    write_sweep,
    write_table,
)
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.soil import OneOfBlocks
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.transmissibility import ALONG
from rotorsoil_ros.prediction import Response
from rotorsoil_ros.rotor.journal.states import JournalStates
from rotorsoil_ros.units import hz_to_rad_s, rad_s_to_hz, rad_s_to_rpm, rpm_to_rad_s


def machine_of(arguments: Namespace) -> Machine:
    """Return the machine that a verb is about."""
    return Machine.load(
        arguments.case, cache_directory=arguments.cache, overrides=arguments.overrides)


def compliance(arguments: Namespace) -> int:
    """Write frequency, a0 and every compliance that is not zero."""
    machine = machine_of(arguments)
    case = machine.case
    foundation, model, others = _contact(machine, arguments.foundation)
    per_a0 = (np.nan if case.soil is None else
              case.soil.shear_wave_speed / foundation.contact.characteristic_length)
    if arguments.a0 is not None and case.soil is None:
        raise InputError(f'{case.path}: soil: is missing; --a0 needs its c_s, --hz does not')
    omega = (hz_to_rad_s(values(arguments.hz)) if arguments.a0 is None
             else per_a0 * values(arguments.a0))
    moving = np.any(model(omega) != 0.0, axis=0)
    # Under loads on its own and then on the other blocks.
    loads = [*DOFS, *(f'__{Channel(other, "", dof)}' for other in others for dof in DOFS)]
    names = [DOFS[i] + loads[j] for i, j in zip(*np.nonzero(moving), strict=True)]
    # A compliance has no unit of its own in a plant: only its frequency has.
    plant = units_of(arguments) == PLANT

    def rows(part: FloatArray) -> FloatArray:
        key = rad_s_to_hz(part) if plant else part
        found = complex_columns(model(part)[:, moving])
        return np.concatenate([np.stack([key, part / per_a0], axis=1), found], axis=1)

    header = ['frequency_hz' if plant else 'omega_rad_s', 'a0', *complex_names(names)]
    write_sweep(arguments.output, header, omega, rows)
    return 0


def seats(arguments: Namespace) -> int:
    """Write the receptance of what the bearings stand on, all of a plant, without rotors."""
    standing: Machine | Plant = machine_of(arguments) if not sources_of(
        arguments.case, arguments.overrides) else Plant.load(
        arguments.case, cache_directory=arguments.cache, overrides=arguments.overrides)
    names = standing.seats
    plant = units_of(arguments) == PLANT

    def rows(omega: FloatArray) -> FloatArray:
        found = standing.seat_receptance(hz=rad_s_to_hz(omega))
        key = rad_s_to_hz(omega) if plant else omega
        return np.concatenate([key[:, None], complex_columns(
            found.reshape(len(omega), len(names) ** 2))], axis=1)

    header = ['frequency_hz' if plant else 'omega_rad_s', *complex_names(
        f'{response}__{force}' for response in names for force in names)]
    omega = hz_to_rad_s(values(arguments.hz))
    write_sweep(arguments.output, header, omega, rows)
    _doubted(next(iter(standing.machines.values())) if isinstance(standing, Plant) else standing,
             omega)
    return 0


def _doubted(machine: Machine, omega: FloatArray) -> None:
    """Say which foundations are known too little for the highest frequency."""
    for text in beyond_modes(machine.case, float(omega.max())):
        print(f'{machine.case.path}: {text}', file=sys.stderr)


def _contact(
    machine: Machine, name: str | None,
) -> tuple[Foundation, Callable[[FloatArray], ComplexArray], list[str]]:
    """
    Return the block of that name, or the only one, how it gives way, and who moves it too.

    How it gives way are six rows under loads on itself and on those that share its ground.
    """
    model = machine.model
    grounded = [block for block in model.foundations if block.on is None]
    names = [block.name for block in grounded]
    if name is None and len(names) == 1:
        [name] = names
    if name is None or name not in names:
        raise InputError(f'{machine.case.path}: foundations: --foundation must be one of '
                         f'{", ".join(names) or "none, there is no block"}, got {name}')
    index = names.index(name)
    block = grounded[index]
    soil = model.support.soils[list(model.foundations).index(block)]
    if not isinstance(soil, OneOfBlocks):
        return block, soil.compliance, []
    own, ground = slice(6 * index, 6 * index + 6), soil.ground

    def rows(omega: FloatArray) -> ComplexArray:
        found = ground.compliance(omega)[:, own]
        return np.concatenate([found[..., own], found[..., :own.start], found[..., own.stop:]],
                              axis=-1)

    return block, rows, names[:index] + names[index + 1:]


def response(arguments: Namespace) -> int:
    """Write the displacement of every channel, solved at every speed."""
    machine = machine_of(arguments)
    order, channel = arguments.order, arguments.acting_at
    if (order is None) is not (channel is None):
        raise InputError('--order and --force belong together: the unbalance of a case excites '
                         'the speed itself')
    _require_channel(machine, channel)
    speed = (values(arguments.rpm) if arguments.hz is None
             else rad_s_to_rpm(hz_to_rad_s(values(arguments.hz))))

    def solve(part: FloatArray) -> Response:
        if order is None:
            return machine.response(rpm=part)
        return machine.order_response(order=order, force=channel, rpm=part)

    write_responses(arguments, machine.model.channels, speed, solve, per_force=False)
    _doubted(machine, (order or 1.0) * rpm_to_rad_s(speed))
    return _told(machine, rpm_to_rad_s(speed), float(speed.max()))


def _told(machine: Machine, speed: FloatArray, highest_rpm: float) -> int:
    """Say why rows have no numbers; return 1 if no row has any: nothing was answered."""
    growth = machine.stability(rpm_range=(0.0, highest_rpm))
    stable = growth.holds(speed)
    if stable.all():
        return 0
    for text in unstable(growth):
        print(f'{machine.case.path}: {text}: no steady response, NaN', file=sys.stderr)
    return 0 if stable.any() else 1


def bearings(arguments: Namespace) -> int:
    """Write stiffness, damping and inertia of every bearing, and where each journal floats."""
    machine, speed = machine_of(arguments), values(arguments.rpm)
    plant = units_of(arguments) == PLANT
    found = machine.bearings(rpm=speed)
    keys = speed if plant else rpm_to_rad_s(speed)
    kinds = ['stiffness', 'damping'] + ['inertia'] * any(one.inertia.any() for one in found)
    matrices = [f'{kind}_{pair}' for kind in kinds for pair in ('xx', 'xz', 'zx', 'zz')]
    header = ['speed_rpm' if plant else 'speed_rad_s', 'bearing', 'load', 'sommerfeld',
              'eccentricity', 'attitude_deg' if plant else 'attitude',
              'least_film_um' if plant else 'least_film', *matrices]
    write_table(arguments.output, header, (
        [key, one.name, *_film(one.film, row, plant=plant),
         *(value for kind in kinds for value in getattr(one, kind)[row].ravel().tolist())]
        for row, key in enumerate(keys.tolist()) for one in found))
    return 0


def _film(film: JournalStates | None, row: int, *, plant: bool) -> list[float | str]:
    """Return what the film of a journal is at one speed; nothing where there is none."""
    if film is None:
        return [''] * 5
    attitude, least = float(film.attitude[row]), float(film.least[row])
    return [film.carried, float(film.sommerfeld[row]), float(film.eccentricity[row]),
            math.degrees(attitude) if plant else attitude, 1e6 * least if plant else least]


def frf(arguments: Namespace) -> int:
    """Write the displacement of every channel per unit force, at one speed of the rotor."""
    machine = machine_of(arguments)
    if arguments.acting_at is None:
        raise InputError('--force CHANNEL is missing: where the force acts')
    _require_channel(machine, arguments.acting_at)

    def solve(part: FloatArray) -> Response:
        return machine.frf(force=arguments.acting_at, hz=part, rpm=arguments.rpm)

    write_responses(arguments, machine.model.channels, values(arguments.hz), solve,
                    per_force=True)
    _doubted(machine, hz_to_rad_s(values(arguments.hz)))
    return _told(machine, rpm_to_rad_s(np.array([arguments.rpm])), arguments.rpm)


def transmissibility(arguments: Namespace) -> int:
    """Write the motion of every channel per motion of the ground along x, y and z."""
    machine, plant = machine_of(arguments), units_of(arguments) == PLANT
    _ = machine.model.support.follow_rows  # what does not tell it says so before a file is begun
    names = [f'{channel}__ground_{axis}' for channel in machine.model.channels for axis in ALONG]
    header = ['frequency_hz', *(f'{name}{kind}' for name in names for kind in ('', '_lag_deg'))
              ] if plant else ['omega_rad_s', *complex_names(names)]

    def rows(part: FloatArray) -> FloatArray:
        found = machine.transmissibility(hz=part, rpm=arguments.rpm)
        if plant:
            both = np.stack([found.amplitude, found.phase_lag_deg()], axis=3)
            return np.concatenate([part[:, None], both.reshape(len(part), -1)], axis=1)
        return np.concatenate([found.omega[:, None], complex_columns(
            found.ratio.reshape(len(part), -1))], axis=1)

    write_sweep(arguments.output, header, values(arguments.hz), rows)
    _doubted(machine, hz_to_rad_s(values(arguments.hz)))
    return _told(machine, rpm_to_rad_s(np.array([arguments.rpm])), arguments.rpm)


def _require_channel(machine: Machine, channel: str | None) -> None:
    """Refuse a wrong channel before a file is begun."""
    if channel is not None and channel not in machine.model.channels:
        raise InputError(f'--force must be one of {", ".join(machine.model.channels)}, '
                         f'got {channel}')


def values(sweep: Sweep) -> FloatArray:
    """Return the values of a sweep, (count,)."""
    return np.linspace(sweep.start, sweep.stop, sweep.count)
