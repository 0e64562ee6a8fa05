"""
Boundary elements: how long they take, how exact they are, what neighbours do to each other.

`--layers` tells the same of sites on layers: seconds from nothing, pieces, solves, the error that
the table states, the least loss, the error against finer elements, and how far the discs of thin
layers are from them.

    python -m benchmarks.shapes [--layers]
"""

import argparse
import csv
from pathlib import Path
import time

import numpy as np

from rotorsoil_ros.ground.boundary import waves
from rotorsoil_ros.ground.boundary.layered_model import LayeredSiteModel
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.boundary.reflections import LayeredWaves
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.boundary.tabulate import SiteSolver
from rotorsoil_ros.ground.layers.model import ThinLayerModel
from rotorsoil_ros.ground.plan import Part, Plan
from rotorsoil_ros.ground.soil import Contact, Rectangle, Soil

from benchmarks.ground import ground_of

REFERENCE = Path(__file__).parents[1] / 'test' / 'reference' / 'contact' / 'rectangles.csv'
ENTRIES = {'xx': (0, 0), 'yy': (1, 1), 'zz': (2, 2), 'rxrx': (3, 3), 'ryry': (4, 4),
           'rzrz': (5, 5), 'x_ry': (0, 4), 'y_rx': (1, 3)}
SHAPES = ((1.0, 4.0), (1.0, 6.0), (2.0, 4.0), (2.0, 6.0), (3.0, 6.0), (5.0, 4.0), (5.0, 6.0))
GAPS = (0.25, 1.0, 4.0, 16.0)
LOOKUPS = 300


# Sites on layers: half sides, centres, and the highest a0 of the slowest soil.
SITES: dict[str, tuple[tuple[Contact, ...], tuple[tuple[float, float], ...], float]] = {
    'square': ((Rectangle(1.0, 1.0),), ((0.0, 0.0),), 4.0),
    '1 : 1.5': ((Rectangle(1.0, 1.5),), ((0.0, 0.0),), 4.0),
    '1 : 3': ((Rectangle(1.0, 3.0),), ((0.0, 0.0),), 4.0),
    '1 : 5': ((Rectangle(1.0, 5.0),), ((0.0, 0.0),), 2.0),
    'L': ((Plan((Part(1.0, 2.0, 0.0, 0.0), Part(1.0, 1.0, 2.0, -1.0))),), ((0.0, 0.0),), 2.0),
    'two squares': ((Rectangle(1.0, 1.0), Rectangle(1.0, 1.0)), ((0.0, 0.0), (3.0, 0.0)), 2.0)}
ON = ('layer of 1 radius on rock', 'layer of 2 radii on rock', 'crust on soft half-space',
      'three layers on half-space')
# How much finer elements are in the check, and at how many frequencies.
FINER, FREQUENCIES = 2.0, 5


def main() -> None:
    """Print three tables."""
    parser = argparse.ArgumentParser(description='Boundary elements: cost and error.')
    parser.add_argument('--layers', action='store_true')
    if parser.parse_args().layers:
        on_layers()
        return
    print('rectangle  a0     cold s  solves  300 look-ups ms  smallest loss')
    for ratio, highest in SHAPES:
        waves._tabulated.cache_clear()  # a first start has no Green's functions either
        start = time.perf_counter()
        model = BoundaryElementModel.solved(Soil(1.0, 1.0 / 3.0, 1.0), Rectangle(1.0, ratio),
                                            omega_max=highest)
        cold = time.perf_counter() - start
        omega = np.linspace(0.0, highest, LOOKUPS)
        start = time.perf_counter()
        values = model.compliance(omega)
        look = time.perf_counter() - start
        print(f'1 : {ratio:<6g} {highest:<6g} {cold:6.2f}  {model.tables[0].solves:6d}  '
              f'{1e3 * look:15.2f}  {_least_loss(values[1:]):.1e}')
    print('\nlargest error against rigorous rectangles, % of sqrt(N_ii N_jj), a0 up to 4')
    for (ratio, poisson), error in _errors().items():
        print(f'1 : {ratio:g}, nu {poisson:.3g}: {100.0 * error:.2f}')
    print('\ntwo squares at a0 = 2, gap in half-widths: largest |N12| / sqrt(N11 N22); change of '
          'N11')
    alone = _squares(()).compliance(np.array([2.0]))[0]
    for gap in GAPS:
        start = time.perf_counter()
        both = _squares((2.0 + gap,)).compliance(np.array([2.0]))[0]
        own = np.sqrt(np.abs(np.diagonal(both)))
        share = (np.abs(both) / np.outer(own, own))[:6, 6:].max()
        change = (np.abs(both[:6, :6] - alone) / np.outer(own[:6], own[:6])).max()
        print(f'{gap:5g}: {share:.2f}; {change:.3f}  ({time.perf_counter() - start:.1f} s)')


def on_layers() -> None:
    """Print what sites on layers cost, and how wrong they are."""
    print('site, ground'.ljust(44), 'a0  cpu s  pieces solves  stated  least loss  finer  discs %')
    for name, (contacts, centres, highest) in SITES.items():
        for ground_name in ON:
            ground, _ = ground_of(ground_name)
            slowest = min(soil.shear_wave_speed for soil in ground.soils)
            site = Site.of(contacts, centres)
            start = time.process_time()
            model = LayeredSiteModel.solved(ground, site, omega_max=highest * slowest)
            cpu = time.process_time() - start
            omega = np.linspace(0.1, 1.0, FREQUENCIES) * highest * slowest
            values, functions = model.compliance(omega), model.table.functions
            disc = ThinLayerModel.solved(ground, contacts[0], omega_max=highest * slowest)
            own = values[:, :6, :6]
            discs = np.abs(np.diagonal(disc.compliance(omega) - own, axis1=1, axis2=2)
                           / np.diagonal(own, axis1=1, axis2=2)).max()
            print(f'{name}, {ground_name}'.ljust(44), f'{highest:g} {cpu:6.2f}  '
                  f'{len(functions.pieces):6d} {functions.solves:6d} '
                  f'{functions.measured_error:.1e}     {_least_loss(values):.1e}  '
                  f'{_finer(model, omega, values):.1e}  {100.0 * discs:.0f}', flush=True)


def _finer(model: LayeredSiteModel, omega: np.ndarray, values: np.ndarray) -> float:
    """Return the largest deviation from elements that are as much finer, of the diagonals."""
    of, worst = model.table.of, 0.0
    waves = LayeredWaves.of(of.ground, of.site.extent, lowest=0.02, highest=of.a0_max)
    better = SiteSolver.of(of.site, waves, FINER * of.shortest)
    length = model.site.length
    unit = np.tile([1.0] * 3 + [length] * 3, model.blocks)
    for one, found in zip(omega.tolist(), values, strict=True):
        exact = better.solve(one / model.unit)
        own = np.sqrt(np.abs(np.diagonal(exact)))
        here = found * np.outer(unit, unit) * model.material.shear_modulus * length
        worst = max(worst, float((np.abs(here - exact) / np.outer(own, own)).max()))
    return worst


def _squares(distances: tuple[float, ...]) -> BoundaryElementModel:
    centres = ((0.0, 0.0), *((distance, 0.0) for distance in distances))
    site = Site.of(tuple(Rectangle(1.0, 1.0) for _ in centres), centres)
    return BoundaryElementModel.solved_together(Soil(1.0, 0.25, 1.0), site, omega_max=2.0)


def _least_loss(values: np.ndarray) -> float:
    own = np.sqrt(np.abs(np.diagonal(values, axis1=1, axis2=2)))
    return float(np.linalg.eigvalsh(-values.imag / (own[:, :, None] * own[:, None])).min())


def _errors() -> dict[tuple[float, float], float]:
    with REFERENCE.open() as stream:
        rows = [row for row in csv.DictReader(stream)
                if row['contact'] == 'bonded' and float(row['eta']) == 0.0]
    found = {}
    for kind in sorted({(float(row['L_over_B']), float(row['nu'])) for row in rows}):
        own = [row for row in rows if (float(row['L_over_B']), float(row['nu'])) == kind]
        model = BoundaryElementModel.solved(Soil(1.0, kind[1], 1.0), Rectangle(1.0, kind[0]),
                                            omega_max=4.0)
        values = model.compliance(np.array([float(row['a0']) for row in own]))
        found[kind] = max(
            float((np.abs(values[:, i, j] - np.array([
                complex(float(row[f're_{name}']), float(row[f'im_{name}'])) for row in own]))
                / np.sqrt(np.abs(values[:, i, i] * values[:, j, j]))).max())
            for name, (i, j) in ENTRIES.items())
    return found


if __name__ == '__main__':
    main()
