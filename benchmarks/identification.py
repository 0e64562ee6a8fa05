"""
Does what identification says of its own accuracy hold? Coverage over seeds of noise and error.

For each kind of error: in how many runs the truth lies inside what is printed as +-, for the
case as described and within tolerances, and how wide that is. The fan, G at 0.7 of its case,
0.05 kg m on the wheel, 60 speeds and four housings.

    python -m benchmarks.identification [--seeds N] [--only ROW]
"""

import argparse
from collections.abc import Callable
from functools import cache
import math
from pathlib import Path
import tempfile
import time

import numpy as np

from rotorsoil_ros.case import models
from rotorsoil_ros.case.config import load
from rotorsoil_ros.monitor.identification.case import identify_vectors, Wanted
from rotorsoil_ros.monitor.identification.used import UsedVectors
from rotorsoil_ros.monitor.identification.words import widening
from rotorsoil_ros.units import rpm_to_rad_s

CASE = Path(__file__).resolve().parents[1] / 'config' / 'plant_fan.yaml'
NO_CACHE = Path('no cache is needed for cones')
SCALAR, PLANE = 'soil.shear_modulus', 'wheel'
TRUE_FACTOR, TRUE_MOMENT = 0.7, 0.05 * np.exp(0.6j)
SPEED = np.asarray(rpm_to_rad_s(np.linspace(400.0, 1750.0, 60)))
HOUSINGS = tuple(f'{end}_housing_{axis}' for end in ('drive_end', 'fan_end') for axis in 'xz')
TOLERANCES = {'foundations.0.mass': 0.05, 'foundations.0.inertia': 0.10, 'soil.loss_factor': 0.5,
              'rotor.bearings.0.stiffness': 0.3, 'rotor.bearings.1.stiffness': 0.3,
              'rotor.shaft_height': 0.03, 'soil.density': 0.1,
              'foundations.0.centre_of_gravity_height': 0.03}


def exact(settings: list[str], unnamed: complex = 0.0) -> np.ndarray:
    """Return the vectors of a fan with settings, (n, c) [m]."""
    case = load(CASE, [f'{SCALAR}={TRUE_FACTOR * 100e6}', *settings])
    with tempfile.TemporaryDirectory() as directory:  # cones need none
        model = models.coupled_model(case, Path(directory))
    rows = [model.channels.index(name) for name in HOUSINGS]
    return model.unbalance_response(SPEED, np.array([unnamed, TRUE_MOMENT])).displacement[:, rows]


def white(random: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
    """Return complex noise of unit power."""
    return (random.normal(size=shape) + 1j * random.normal(size=shape)) / math.sqrt(2.0)


def slow(random: np.random.Generator, shape: tuple[int, int], correlation: float) -> np.ndarray:
    """Return noise of unit power whose successive rows are correlated."""
    noise = white(random, shape)
    for row in range(1, shape[0]):
        noise[row] = (correlation * noise[row - 1]
                      + math.sqrt(1.0 - correlation**2) * noise[row])
    return noise


def size(values: np.ndarray) -> np.ndarray:
    """Return the root mean square of each channel."""
    return np.sqrt(np.mean(np.abs(values) ** 2, axis=0))


def gains(random: np.random.Generator) -> np.ndarray:
    """Return errors of four transducers: 3 % and 2 degrees."""
    return np.exp(random.normal(scale=0.03, size=4)
                  + 1j * random.normal(scale=math.radians(2.0), size=4))


def mixed(values: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Add transducer errors, a drift, common and own noise."""
    shape = values.shape
    own = 0.03 * slow(random, shape, 0.9) + 0.02 * white(random, shape)
    common = 0.02 * white(random, (shape[0], 1))
    return values * gains(random) + size(values) * (own + common)


def within_tolerances(random: np.random.Generator) -> list[str]:
    """Return settings of a case drawn from what a case may be off by."""
    case = load(CASE)
    settings = []
    for path, spread in TOLERANCES.items():
        factor = math.exp(random.normal(scale=spread))
        value = case.content
        for step in path.split('.'):
            value = value[int(step)] if isinstance(value, list) else value[step]
        for key, number in (value.items() if isinstance(value, dict) else enumerate(
                value) if isinstance(value, list) else [('', value)]):
            place = f'{path}.{key}' if key != '' else path
            settings.append(f'{place}={number * factor!r}')
    return settings


Row = Callable[[np.random.Generator], np.ndarray]
Error = Callable[[np.ndarray, np.random.Generator], np.ndarray]


def white_of_rms(values: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Add noise of 5 % of each channel's size."""
    return values + 0.05 * size(values) * white(random, values.shape)


def white_of_each(values: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Add noise of 5 % of each vector."""
    return values * (1.0 + 0.05 * white(random, values.shape))


def common(values: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Add noise of 5 % that all channels share."""
    return values * (1.0 + 0.05 * white(random, (len(values), 1)))


def drift(values: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Add noise of 5 % that is correlated in time."""
    return values + 0.05 * size(values) * slow(random, values.shape, 0.9)


def plain(values: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Add noise of 2 %."""
    return values + 0.02 * size(values) * white(random, values.shape)


def transducers(values: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Add errors of transducers, and noise of 2 % of what they should have told."""
    return values * gains(random) + 0.02 * size(values) * white(random, values.shape)


def row(error: Error, *settings: str, unnamed: complex = 0.0) -> Row:
    """Return what measures a machine with settings, with one kind of error."""
    truth = cache(lambda: exact(list(settings), unnamed=unnamed))
    return lambda random: error(truth(), random)


def of_random_case(random: np.random.Generator) -> np.ndarray:
    """Measure a machine that is drawn from what its case may be off by."""
    return mixed(exact(within_tolerances(random)), random)


ROWS: dict[str, Row] = {
    'white, 5 % of rms': row(white_of_rms),
    '5 % of each vector': row(white_of_each),
    '5 % common to channels': row(common),
    'correlated 0.9 in time': row(drift),
    'gain 3 %, 2 deg': row(transducers),
    'all of these': row(mixed),
    'case within tolerances, all': of_random_case,
    'mass +5 %, eta 0.08': row(mixed, 'foundations.0.mass=20559', 'soil.loss_factor=0.08'),
    'truth infinite elements': row(mixed, 'support.model=infinite_elements'),
    'unnamed plane 0.01 kg m': row(plain, unnamed=0.01 * np.exp(-1.0j)),
    'mass +15 %': row(mixed, 'foundations.0.mass=22517'),
}


def covered(measure: Row, seeds: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Return shares that cover (G, U; described, tolerant), widths in %, and seconds a fit."""
    case = load(CASE)
    model = models.coupled_model(case, NO_CACHE)
    channels = tuple(name for name in model.channels if name in HOUSINGS)
    order = [HOUSINGS.index(name) for name in channels]
    wanted = Wanted(scalars=[SCALAR], planes=[PLANE])
    hits, widths, spent = np.zeros((2, 3)), [], 0.0
    for seed in range(seeds):
        measured = measure(np.random.default_rng(seed))[:, order]
        run = UsedVectors(channels, np.linspace(0.0, 1.0, len(SPEED)), SPEED, measured,
                      np.zeros(len(SPEED), dtype=int))
        start = time.process_time()
        found = identify_vectors(case, model, run, wanted)
        spent += time.process_time() - start
        own = []
        for number, fit in enumerate((found.described, found.tolerant)):
            wide = widening(fit) if number else 1.0
            width = wide * fit.log_width[0]
            hits[number, 0] += abs(fit.state.logs[0] - math.log(TRUE_FACTOR)) <= width
            moment = fit.state.columns[0] - TRUE_MOMENT
            part = wide * fit.column_width(0, key_angle=0.0)
            hits[number, 1:] += np.abs([moment.real, moment.imag]) <= part
            own += [100.0 * width, 100.0 * part / abs(TRUE_MOMENT)]
        widths.append(own)
    return hits / seeds, np.median(widths, axis=0), spent / seeds


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--seeds', type=int, default=50)
    parser.add_argument('--only', default='', help='rows whose names hold this')
    arguments = parser.parse_args()
    print(f'{"":30s} as described           within tolerances      s a fit')
    print(f'{"kind of error":30s} G    U    +-G   +-U %   G    U    +-G   +-U %')
    for name, measure in ROWS.items():
        if arguments.only not in name:
            continue
        hits, width, seconds = covered(measure, arguments.seeds)
        print(f'{name:30s} ' + '   '.join(
            f'{hits[number, 0]:.2f} {hits[number, 1:].mean():.2f} {width[2 * number]:5.1f} '
            f'{width[2 * number + 1]:5.1f}' for number in (0, 1)) + f'   {seconds:.2f}',
            flush=True)


if __name__ == '__main__':
    main()
