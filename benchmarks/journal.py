"""
Time oil films, and hold them against printed and fine-grid tables: `python -m benchmarks.journal`.

One core, one BLAS thread, processor time for each speed of a table, the best of several runs. What
tilting pads cost once for their shape is told apart.
"""

import math
import os
from pathlib import Path

os.environ['OMP_NUM_THREADS'] = '1'

import time

import numpy as np

from rotorsoil_ros.rotor.journal.fixed import FixedPads
from rotorsoil_ros.rotor.journal.geometry import JournalBearing
from rotorsoil_ros.rotor.journal.oil import Viscosity
from rotorsoil_ros.rotor.journal.states import tabulated
from rotorsoil_ros.rotor.journal.tilting import tilting_pad

TABLES = Path(__file__).resolve().parents[1] / 'test' / 'reference' / 'bearing'
SPAN = 50.0, 2000.0  # rad/s
RUNS = 5
DIAMETER, CLEARANCE = 0.1, 1e-4


def bore(kind: str, slenderness: float, **more: float) -> JournalBearing:
    """Return a bearing of 100 mm and some L / D."""
    return JournalBearing(kind, DIAMETER, slenderness * DIAMETER, CLEARANCE, **more)


BORES = {
    'plain': bore('plain', 0.5), 'axial groove': bore('axial_groove', 0.5),
    'elliptic, m = 0.5': bore('elliptic', 0.5, preload=0.5),
    'five tilting pads': bore('tilting_pad', 0.5, arc=math.radians(60.0), preload=0.5),
}
PUBLISHED = {
    'published_lund_thomsen_two_axial_ld0.5': BORES['axial groove'],
    'two_axial_ld0.5': BORES['axial groove'], 'two_axial_ld1': bore('axial_groove', 1.0),
    'plain_ld0.5': BORES['plain'], 'plain_ld1': bore('plain', 1.0),
    'lemon_m0.5_ld0.5': BORES['elliptic, m = 0.5'],
}


def measure(bearing: JournalBearing, weight: float) -> tuple[float, int]:
    """Return seconds for each speed of a table, and how many speeds it has."""
    best, count = math.inf, 0
    for _ in range(RUNS):
        start = time.process_time()
        found = tabulated(bearing, Viscosity.constant(0.02), np.array([0.0, -weight]), SPAN)
        count = len(found.speed)
        best = min(best, (time.process_time() - start) / count)
    return best, count


def errors(name: str, bearing: JournalBearing) -> np.ndarray:
    """Return the errors of the eight coefficients of a table, as shares of the largest."""
    search, off = FixedPads.of(bearing), []
    for row in np.loadtxt(TABLES / f'{name}.csv', delimiter=','):
        load = 1.0 / (math.pi * row[0])
        _, film = search.settle(np.array([0.0, -load]))
        for matrix, printed in ((film.stiffness, row[3:7]), (film.damping, row[7:11])):
            off.append(np.abs(matrix.ravel() / load - printed) / np.abs(printed).max())
    return np.concatenate(off)


def main() -> None:
    """Print both tables."""
    start = time.process_time()
    low, high = tilting_pad(BORES['five tilting pads']).reach
    once = time.process_time() - start
    print(f'a pad that tilts, once for its shape: {1e3 * once:.0f} ms ({low:.2f} to {high:.2f} '
          'clearances towards its pivot)')
    print(f'{"bearing":22s} {"load":>8s} {"speeds":>7s} {"each":>10s}')
    for name, bearing in BORES.items():
        for weight in (500.0, 5000.0):
            seconds, count = measure(bearing, weight)
            print(f'{name:22s} {weight:6.0f} N {count:7d} {1e3 * seconds:7.2f} ms')
    print(f'\n{"coefficients beside":42s} {"median":>8s} {"worst":>8s}  of the largest')
    for name, bearing in PUBLISHED.items():
        off = 100.0 * errors(name, bearing)
        print(f'{name:42s} {np.median(off):6.2f} % {off.max():6.2f} %')


if __name__ == '__main__':
    main()
