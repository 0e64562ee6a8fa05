"""
Boundary elements: how long they take, how exact they are, what neighbours do to each other.

    python -m benchmarks.shapes
"""

import csv
from pathlib import Path
import time

import numpy as np

from rotorsoil_ros.ground.boundary import waves
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.soil import Rectangle, Soil

REFERENCE = Path(__file__).parents[1] / 'test' / 'reference' / 'contact' / 'rectangles.csv'
ENTRIES = {'xx': (0, 0), 'yy': (1, 1), 'zz': (2, 2), 'rxrx': (3, 3), 'ryry': (4, 4),
           'rzrz': (5, 5), 'x_ry': (0, 4), 'y_rx': (1, 3)}
SHAPES = ((1.0, 4.0), (1.0, 6.0), (2.0, 4.0), (2.0, 6.0), (3.0, 6.0), (5.0, 4.0), (5.0, 6.0))
GAPS = (0.25, 1.0, 4.0, 16.0)
LOOKUPS = 300


def main() -> None:
    """Print three tables."""
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
