"""
How boundary elements converge: writes convergence_shapes.md (some 15 min on one core).

Rectangles of 1 : 1 to 1 : 5 up to a0 = 6 as the product solves them, beside two finer solutions of
its own: the same series with about twice the nodes, more functions and finer static cells, and
patches of constant traction on two meshes, which know nothing of edges, extrapolated. The patches
are held against themselves on coarser meshes.

    python docs/convergence_shapes.py
"""

import os

os.environ['OMP_NUM_THREADS'] = '1'  # before numpy: small solves are slower with two threads

from pathlib import Path

import numpy as np

from rotorsoil_ros.ground.boundary import rectangle
from rotorsoil_ros.ground.boundary.effort import patch_unknowns
from rotorsoil_ros.ground.boundary.patches import PatchSolver
from rotorsoil_ros.ground.boundary.rectangle import RectangleSolver
from rotorsoil_ros.ground.boundary.waves import SurfaceWaves
from rotorsoil_ros.ground.plan import Part

RATIOS = (1.0, 1.5, 2.0, 3.0, 5.0)
POISSON = (1.0 / 3.0, 0.45)
# a0 of each row, and the end of the range for which the product solves it.
PLACES = ((0.5, 4.0), (2.0, 4.0), (4.0, 4.0), (5.0, 6.0), (6.0, 6.0))
# Patches: half sides per a0, and unknowns of the finer mesh at most.
PER_A0, COARSER, MOST = 1.25, 0.8, 3700
FUNCTIONS, CELLS, FINER = 10, 8, 2.0
NO_POINTS = np.zeros((0, 2))


def main() -> None:
    """Solve everything and write the page."""
    lines = [HEAD]
    for poisson in POISSON:
        waves = SurfaceWaves.of(poisson, 0.0, 1.01 * 6.0 * 2.0 * np.hypot(1.0, RATIOS[-1]))
        for ratio in RATIOS:
            for a0, end in PLACES:
                own = RectangleSolver(waves, ratio, end, NO_POINTS).compliance(a0)[0]
                finer = series(waves, ratio, end, a0)
                told, doubt = patches(waves, ratio, a0)
                cells = [f'1 : {ratio:g}', f'{poisson:.2f}', f'{a0:g}', error(own, finer),
                         '-' if told is None else error(own, told),
                         '-' if told is None or doubt is None else error(doubt, told)]
                lines.append('| ' + ' | '.join(cells) + ' |')
    (Path(__file__).parent / 'convergence_shapes.md').write_text('\n'.join(lines) + '\n')


def series(waves: SurfaceWaves, ratio: float, end: float, a0: float) -> np.ndarray:
    """Return the compliance of a rectangle by more nodes, functions and cells."""
    usual = rectangle._MOST_FUNCTIONS, rectangle._CELLS
    rectangle._MOST_FUNCTIONS, rectangle._CELLS = FUNCTIONS, CELLS
    rectangle._kernels_at_rest.cache_clear()
    try:
        found = RectangleSolver(waves, ratio, max(FINER * end, 8.6), NO_POINTS)
        return found.compliance(a0)[0]
    finally:
        rectangle._MOST_FUNCTIONS, rectangle._CELLS = usual
        rectangle._kernels_at_rest.cache_clear()


def patches(
    waves: SurfaceWaves, ratio: float, a0: float,
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the compliance by patches, and by coarser ones; None where they are too many."""
    block = (Part(1.0, ratio, 0.0, 0.0),)
    found = []
    for share in (1.0, COARSER):
        highest = max(PER_A0 * share * a0, 4.0 * share)
        found.append(None if patch_unknowns((block,), highest) > MOST else PatchSolver(
            waves, (block,), np.zeros((1, 2)), highest, NO_POINTS).compliance(a0)[0])
    return (found[0], found[1]) if found[0] is not None else (found[1], None)


def error(found: np.ndarray, exact: np.ndarray) -> str:
    """Return the worst error in percent of sqrt(N_ii N_jj)."""
    size = np.sqrt(np.abs(np.diagonal(exact)))
    return f'{100.0 * (np.abs(found - exact) / np.outer(size, size)).max():.2f}'


HEAD = """# How boundary elements converge

Written by `python docs/convergence_shapes.py`: worst error over all entries of the compliance of a
welded rectangle, in percent of sqrt(N_ii N_jj), undamped, a0 = omega b / c_s with the shorter half
side b. First against the same series with about twice the nodes, 10 functions a side and twice
the static cells; then against patches of constant traction, another discretisation; last what
these patches change from a mesh a fifth coarser, which bounds their own error. A dash: more
patches than a minute solves, or no coarser mesh to hold them against.

So rectangles of 1 : 1 to 1 : 5 are within 0.5 % up to a0 = 6, but for 0.55 % at 1 : 5, nu = 0.45
and the end of the range to a0 = 4; below a0 = 2 within 0.1 %. On layers: `python -m
benchmarks.shapes --layers`.

| sides | nu | a0 | finer series | patches | of the patches |
| --- | --- | --- | --- | --- | --- |"""


if __name__ == '__main__':
    main()
