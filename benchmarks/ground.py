"""
Measure what a table of layered ground costs, where the time goes, and how wrong it is.

Tabulates eight grounds under a disc of radius one up to a0 = 6, each in a process of its own, and
prints CPU seconds of one core, pieces, exact solves, nodes, milliseconds per solve, the share of
each step, the error that the table states, that at unseen frequencies against a finer mesh, and
the largest memory of the process. `--rock` tells instead what rock that moves leaves of the peaks
of a layer on rigid rock, `--mesh` how the elements along the depth converge, and `--cones` how
much damping cones have over that of buried discs and of layers, and how far stacks of cones are
from a block in the ground.

    python -m benchmarks.ground [--rock | --mesh | --cones]
"""

import os

os.environ['OMP_NUM_THREADS'] = '1'  # before numpy: small solves are slower with two threads

import argparse
from collections import defaultdict
from collections.abc import Callable
import multiprocessing
import resource
import time
from typing import Any

import numpy as np

# Thickness and soil (G, nu, rho, eta) of each layer, what lies below, and the embedment.
GROUNDS: dict[str, tuple[list[tuple[float, tuple[float, ...]]], tuple[float, ...] | None,
                         float]] = {
    'half-space': ([], (1.0, 0.3, 1.0, 0.05), 0.0),
    'layer of 1 radius on rock': ([(1.0, (1.0, 0.25, 1.0, 0.05))], None, 0.0),
    'layer of 2 radii on rock': ([(2.0, (1.0, 0.3, 1.0, 0.05))], None, 0.0),
    'layer of 4 radii on rock': ([(4.0, (1.0, 0.4, 1.0, 0.08))], None, 0.0),
    'crust on soft half-space': ([(0.5, (4.0, 0.25, 1.1, 0.05))], (1.0, 0.4, 1.0, 0.1), 0.0),
    'three layers on half-space': (
        [(0.5, (1.0, 0.3, 1.0, 0.06)), (1.0, (2.0, 0.4, 1.05, 0.06)),
         (1.5, (0.6, 0.45, 1.0, 0.08))], (8.0, 0.25, 1.2, 0.03), 0.0),
    'embedded 0.5 radii, half-space': ([], (1.0, 0.25, 1.0, 0.05), 0.5),
    'embedded 1 radius, rock at 3': ([(3.0, (1.0, 0.3, 1.0, 0.05))], None, 1.0),
}
STEPS = {'eigenproblems of the waves': ('waves', 'WavePencil.standing'),
         'ground outside': ('cylinder', 'CylinderInWaves.around'),
         'ground below': ('cylinder', 'CylinderInWaves.beneath'),
         'rational fits': ('joining', 'interpolant'),
         'singular frequencies': ('tabulate', 'singular_frequencies')}
HIGHEST, UNSEEN = 6.0, 12
RATIOS = (3.0, 5.0, 10.0, 20.0)


def main() -> None:
    """Print the costs of every ground, or what moving rock does."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--rock', action='store_true')
    parser.add_argument('--mesh', action='store_true')
    parser.add_argument('--cones', action='store_true')
    arguments = parser.parse_args()
    for wanted, compare in ((arguments.rock, compare_rock), (arguments.mesh, compare_meshes),
                            (arguments.cones, compare_cones)):
        if wanted:
            compare()
            return
    for name in GROUNDS:
        # A fresh process: nothing is warm, and its peak memory is its own.
        process = multiprocessing.get_context('spawn').Process(target=measure, args=(name,))
        process.start()
        process.join()


def measure(name: str) -> None:
    """Print what one table costs."""
    from rotorsoil_ros.ground.layers import cylinder, joining, tabulate, waves
    from rotorsoil_ros.ground.layers.line import LineMesh
    from rotorsoil_ros.ground.layers.profile import Embedment
    from rotorsoil_ros.ground.layers.table import entry_scale

    spent: dict[str, float] = defaultdict(float)
    rooms = {'waves': waves, 'cylinder': cylinder, 'joining': joining, 'tabulate': tabulate}
    for step, (room, place) in STEPS.items():
        clock(rooms[room], place, step, spent)
    ground, depth = ground_of(name)
    radii = tabulate.Radii(1.0, 1.0, 1.0, 1.0, 1.0)
    start = time.process_time()
    table = tabulate.tabulate(ground, Embedment(depth), radii, a0_max=HIGHEST)
    total = time.process_time() - start
    shares = ', '.join(f'{step} {spent[step] / total:.0%}' for step in STEPS)
    a0 = np.sort(np.random.default_rng(1).uniform(0.05, HIGHEST, UNSEEN))
    exact = tabulate.exact_compliance(
        ground, Embedment(depth), radii, a0, span=(0.02, HIGHEST),
        mesh=LineMesh(order=5, smallest=0.002, per_wave=0.3, per_radius=0.25))
    error = (np.abs(table.compliance(a0) - exact) / entry_scale(exact)).max()
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(f'{name}: {total:.2f} s cpu, {len(table.pieces)} pieces, {table.solves} solves, '
          f'{table.nodes} nodes, {1e3 * total / table.solves:.1f} ms a solve; {shares}; stated '
          f'{table.measured_error:.1e}, against a finer mesh {error:.1e}; {memory:.0f} MiB',
          flush=True)


def ground_of(name: str) -> tuple[Any, float]:
    """Return a ground and the embedment of the disc in it."""
    from rotorsoil_ros.ground.layers.profile import Layer, LayeredSoil
    from rotorsoil_ros.ground.soil import Soil

    layers, below, depth = GROUNDS[name]
    return LayeredSoil(tuple(Layer(thickness, Soil(*soil)) for thickness, soil in layers),
                       None if below is None else Soil(*below)), depth


def clock(room: Any, place: str, step: str, spent: dict[str, float]) -> None:
    """Add the CPU seconds of a function of a room to those of its step."""
    *holders, last = place.split('.')
    for holder in holders:
        room = getattr(room, holder)
    function: Callable[..., Any] = getattr(room, last)

    def timed(*given: Any, **named: Any) -> Any:
        start = time.process_time()
        try:
            return function(*given, **named)
        finally:
            spent[step] += time.process_time() - start

    setattr(room, last, timed)


def compare_rock() -> None:
    """Print the largest compliances over those on rigid rock, by the ratio of wave speeds."""
    from rotorsoil_ros.ground.layers.profile import Layer, LayeredSoil, SURFACE
    from rotorsoil_ros.ground.layers.tabulate import exact_compliance, Radii
    from rotorsoil_ros.ground.soil import Soil

    a0 = np.linspace(0.1, 3.5, 120)
    layer = Layer(1.0, Soil(1.0, 0.3, 1.0, 0.05))

    def peaks(below: Soil | None) -> np.ndarray:
        found = exact_compliance(LayeredSoil((layer,), below), SURFACE,
                                 Radii(1.0, 1.0, 1.0, 1.0, 1.0), a0)
        return np.abs(found[:, :2]).max(axis=0)

    rigid = peaks(None)
    for ratio in RATIOS:
        share = peaks(Soil(ratio**2, 0.3, 1.0, 0.05)) / rigid
        print(f'c_s of the rock over that of the layer {ratio:g}: highest compliance x '
              f'{share[0]:.2f}, z {share[1]:.2f} of that on rigid rock')


def compare_meshes() -> None:
    """Print the worst error of an entry over frequency by the smallest element and the order."""
    from rotorsoil_ros.ground.layers.line import LineMesh
    from rotorsoil_ros.ground.layers.profile import Embedment
    from rotorsoil_ros.ground.layers.table import entry_scale
    from rotorsoil_ros.ground.layers.tabulate import exact_compliance, Radii

    a0 = np.array([0.05, 0.5, 1.0, 2.0, 3.0, 4.5, 6.0])
    radii, span = Radii(1.0, 1.0, 1.0, 1.0, 1.0), (0.05, HIGHEST)
    for name in ('layer of 1 radius on rock', 'embedded 0.5 radii, half-space'):
        ground, depth = ground_of(name)
        finest = exact_compliance(ground, Embedment(depth), radii, a0, span=span, mesh=LineMesh(
            order=6, smallest=1e-3, per_wave=0.25, per_radius=0.2))
        for order in (2, 4):
            errors = []
            for smallest in (0.016, 0.008, 0.004):
                found = exact_compliance(
                    ground, Embedment(depth), radii, a0, span=span, mesh=LineMesh(
                        order=order, smallest=smallest, per_wave=0.1 * order))
                errors.append(f'{(np.abs(found - finest) / entry_scale(finest)).max():.1e}')
            print(f'{name}, order {order}: smallest element 0.016, 0.008, 0.004 radii: '
                  + ', '.join(errors))


def compare_cones() -> None:
    """Print the damping of cones over that of discs at the surface, buried, and on layers."""
    from rotorsoil_ros.ground.cone import ConeModel
    from rotorsoil_ros.ground.layers.model import ThinLayerModel
    from rotorsoil_ros.ground.layers.profile import Embedment, Layer, LayeredSoil
    from rotorsoil_ros.ground.soil import Circle, Soil

    soil, disc, a0 = Soil(1.0, 0.25, 1.0, 0.05), Circle(1.0), np.array([0.5, 1.0, 2.0])
    even, on_rock = LayeredSoil((), soil), LayeredSoil((Layer(2.0, soil),), None)
    cone = np.linalg.inv(ConeModel(soil, disc).compliance(a0)).imag
    for name, ground, depth in (
            ('on the surface', even, 0.0), ('buried 0.5 radii', even, 0.5),
            ('buried 1 radius', even, 1.0), ('on a layer of 2 radii on rock', on_rock, 0.0)):
        model = ThinLayerModel.solved(ground, disc, omega_max=2.0, embedment=Embedment(depth))
        exact = np.linalg.inv(model.compliance(a0)).imag
        told = ', '.join(
            f'{motion} ' + ' '.join(f'{one:.2f}' for one in cone[:, dof, dof] / exact[:, dof, dof])
            for motion, dof in (('sliding', 0), ('vertical', 2), ('rocking', 4), ('torsion', 5)))
        print(f'damping of cones over that of a disc {name}, a0 = 0.5 1 2: {told}')
    compare_stacks()


def compare_stacks() -> None:
    """Print how far stacks of cones are from thin layers, for blocks in a half-space."""
    from rotorsoil_ros.ground.embedded_cone import EmbeddedConeModel
    from rotorsoil_ros.ground.layers.model import ThinLayerModel
    from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil
    from rotorsoil_ros.ground.soil import Circle, Soil

    disc, a0 = Circle(1.0), np.linspace(0.05, HIGHEST, 60)
    for ratio in (0.1, 0.25, 1.0 / 3.0, 0.45):
        soil = Soil(1.0, ratio, 1.0, 0.05)
        for depth in (0.25, 0.5, 1.0, 2.0):
            found, exact = (model.compliance(a0) for model in (
                EmbeddedConeModel(soil, disc, Embedment(depth)),
                ThinLayerModel.solved(LayeredSoil((), soil), disc, omega_max=HIGHEST,
                                      embedment=Embedment(depth))))
            size = np.sqrt(np.abs(np.diagonal(exact, axis1=1, axis2=2)))
            off = np.abs(found - exact) / (size[:, :, None] * size[:, None])
            told = ', '.join(
                f'{motion} ' + ' '.join(f'{off[a0 <= end][:, i, j].max():.0%}'
                                        for end in (2.0, HIGHEST))
                for motion, i, j in (('sliding', 0, 0), ('vertical', 2, 2), ('rocking', 4, 4),
                                     ('torsion', 5, 5), ('coupling', 0, 4)))
            print(f'stack of cones, nu {ratio:.2f}, embedded {depth:g} radii, a0 to 2 and '
                  f'{HIGHEST:g}: {told}', flush=True)


if __name__ == '__main__':
    main()
