"""What a case answers over a range, as CSV."""

from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
import sys
from typing import TextIO

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray
from rotorsoil_ros.case import cache, models
from rotorsoil_ros.case.config import Case, load
from rotorsoil_ros.case.summary import unstable
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.cli.parser import Sweep
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.soil import SoilModel
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.stability import Stability, stability
from rotorsoil_ros.units import hz_to_rad_s, rpm_to_rad_s

# Rows computed together: bounds memory however long the sweep.
_CHUNK = 4096


def compliance(arguments: Namespace) -> int:
    """Write omega, a0 and every compliance that is not zero."""
    case = load(arguments.case, arguments.overrides)
    foundation, model = _contact(case, arguments.foundation, _model(case, arguments))
    per_a0 = (np.nan if case.soil is None else
              case.soil.shear_wave_speed / foundation.contact.characteristic_length)
    if arguments.a0 is not None and case.soil is None:
        raise InputError(f'{case.path}: soil: is missing; --a0 needs its c_s, --hz does not')
    omega = (hz_to_rad_s(values(arguments.hz)) if arguments.a0 is None
             else per_a0 * values(arguments.a0))
    moving = np.any(model.compliance(omega) != 0.0, axis=0)
    names = [DOFS[i] + DOFS[j] for i, j in zip(*np.nonzero(moving), strict=True)]

    def rows(part: FloatArray) -> tuple[FloatArray, ComplexArray]:
        return np.stack([part, part / per_a0], axis=1), model.compliance(part)[:, moving]

    _write(arguments.output, ['omega_rad_s', 'a0'], names, omega, rows)
    return 0


def _model(case: Case, arguments: Namespace) -> CoupledModel:
    return models.coupled_model(case, cache.directory(arguments.cache))


def _contact(
    case: Case, name: str | None, model: CoupledModel,
) -> tuple[Foundation, SoilModel]:
    """Return the block of that name, or the only one, and what it stands on."""
    contacts = {foundation.name: (foundation, soil) for foundation, soil
                in zip(model.foundations, model.soil_models, strict=True)}
    if name is None and len(contacts) == 1:
        name = next(iter(contacts))
    if name is None or name not in contacts:
        raise InputError(f'{case.path}: foundations: --foundation must be one of '
                         f'{", ".join(contacts) or "none, there is no block"}, got {name}')
    return contacts[name]


def response(arguments: Namespace) -> int:
    """Write the displacement of every channel, solved at every speed."""
    case = load(arguments.case, arguments.overrides)
    model = _model(case, arguments)
    order, channel = arguments.order, arguments.force
    if (order is None) is not (channel is None):
        raise InputError('--order and --force belong together: the unbalance of a case excites '
                         'the speed itself')
    _require_channel(model, channel)
    speed = (rpm_to_rad_s(values(arguments.rpm)) if arguments.hz is None
             else hz_to_rad_s(values(arguments.hz)))

    growth = stability(model, (0.0, float(speed.max())))

    def rows(part: FloatArray) -> tuple[FloatArray, ComplexArray]:
        stable = growth.holds(part)
        if order is None:
            found = model.unbalance_response(part[stable], case.unbalance).displacement
        else:
            found = model.harmonic_response(
                part[stable], order=order, channel=channel).displacement
        answers = np.full((len(part), len(model.channels)), complex(np.nan, np.nan))
        answers[stable] = found
        return part[:, None], answers

    _write(arguments.output, ['speed_rad_s'], model.channels, speed, rows)
    return _told(case, growth, growth.holds(speed))


def _told(case: Case, growth: Stability, stable: BoolArray) -> int:
    """Say why rows have no numbers; return 1 if no row has any: nothing was answered."""
    if stable.all():
        return 0
    for text in unstable(growth):
        print(f'{case.path}: {text}: no steady response, NaN', file=sys.stderr)
    return 0 if stable.any() else 1


def frf(arguments: Namespace) -> int:
    """Write the displacement of every channel per unit force, at one speed of the rotor."""
    case = load(arguments.case, arguments.overrides)
    model = _model(case, arguments)
    _require_channel(model, arguments.force)
    speed = rpm_to_rad_s(arguments.rpm)
    growth = stability(model, (speed, speed))
    stable = growth.holds(np.array([speed]))

    def rows(part: FloatArray) -> tuple[FloatArray, ComplexArray]:
        if not stable.all():
            return part[:, None], np.full((len(part), len(model.channels)),
                                          complex(np.nan, np.nan))
        found = model.frequency_response(part, speed=speed, channel=arguments.force)
        return part[:, None], found.displacement

    _write(arguments.output, ['omega_rad_s'], model.channels,
           hz_to_rad_s(values(arguments.hz)), rows)
    return _told(case, growth, stable)


def _require_channel(model: CoupledModel, channel: str | None) -> None:
    """Refuse a wrong channel before a file is begun."""
    if channel is not None and channel not in model.channels:
        raise InputError(f'--force must be one of {", ".join(model.channels)}, got {channel}')


def values(sweep: Sweep) -> FloatArray:
    """Return the values of a sweep, (count,)."""
    return np.linspace(sweep.start, sweep.stop, sweep.count)


def _write(
    target: str, real: Iterable[str], complexes: Iterable[str], sweep: FloatArray,
    rows: Callable[[FloatArray], tuple[FloatArray, ComplexArray]],
) -> None:
    """Write a header and, chunk by chunk, real and complex columns in full precision."""
    header = [*real, *(f'{name}_{part}' for name in complexes for part in ('re', 'im'))]
    with opened(target) as stream, progress('solving') as report:
        stream.write(','.join(header) + '\n')
        for start in range(0, len(sweep), _CHUNK):
            keys, values = rows(sweep[start:start + _CHUNK])
            table = np.concatenate([keys, np.ascontiguousarray(values).view(float)], axis=1)
            stream.writelines(','.join(map(repr, row)) + '\n' for row in table.tolist())
            report(start + len(keys), len(sweep))


@contextmanager
def opened(target: str) -> Iterator[TextIO]:
    """Open a file for writing; `-` is standard output."""
    if target == '-':
        yield sys.stdout
        return
    try:
        with open(target, 'w', encoding='utf-8') as stream:
            yield stream
    except OSError as error:
        error.filename = target  # a full disk does not say which file
        raise
