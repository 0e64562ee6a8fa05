"""
Measure what a kind of soil costs, and where the time goes.

Tabulates each geometry in a process of its own and prints CPU seconds of one core, number of
exact solves, unknowns, milliseconds per solve, the share of each step, the error measured at
unseen frequencies, and the largest memory of the process; then what a rescaling costs.

    python -m benchmarks.compliance [--poisson-ratio NU] [--loss-factor ETA] [--a0 MIN:MAX]
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

STEPS = {
    'mesh, near field, patterns': ('elements_tabulate', 'HalfSpaceSolver'),
    'waves and ray elements': ('elements_solver', 'RayElements.matrices'),
    'assembly of scalar entries': ('elements_solver', '_Pattern.entries'),
    'sparse factors and residual': ('elements_solver', '_solve'),
    'rational fits': ('elements_tabulate', 'fit_rational'),
}


def main() -> None:
    """Print the costs of every geometry."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[1])
    parser.add_argument('--poisson-ratio', type=float, default=0.31)
    parser.add_argument('--loss-factor', type=float, default=0.07)
    parser.add_argument('--a0', default='0.05:6', metavar='MIN:MAX')
    arguments = parser.parse_args()
    a0_min, a0_max = (float(part) for part in arguments.a0.split(':'))
    for geometry in ('disc', 'plane_strain', 'plane_stress'):
        # A fresh process: nothing is warm, and its peak memory is its own.
        process = multiprocessing.get_context('spawn').Process(target=measure, args=(
            geometry, arguments.poisson_ratio, arguments.loss_factor, a0_min, a0_max))
        process.start()
        process.join()


def measure(
    geometry: str, poisson_ratio: float, loss_factor: float, a0_min: float, a0_max: float,
) -> None:
    """Print what one table costs."""
    start = time.process_time()
    from rotorsoil_ros.ground.elements import (
        solver as elements_solver,
        tabulate as elements_tabulate,
    )
    from rotorsoil_ros.ground.half_space import InfiniteElementModel
    from rotorsoil_ros.ground.soil import Circle, Soil
    imports = time.process_time() - start

    spent: defaultdict[str, float] = defaultdict(float)
    rooms = {'elements_solver': elements_solver, 'elements_tabulate': elements_tabulate}
    start = time.process_time()
    table = tabulate(elements_tabulate, geometry, poisson_ratio, loss_factor, a0_min, a0_max)
    seconds = time.process_time() - start
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0

    # A second run is timed step by step, so that the clocks do not count in the first.
    for step, (room, path) in STEPS.items():
        _clock(rooms[room], path, step, spent)
    start = time.process_time()
    tabulate(elements_tabulate, geometry, poisson_ratio, loss_factor, a0_min, a0_max)
    again = time.process_time() - start

    print(f'{geometry}: nu = {poisson_ratio:g}, eta = {loss_factor:g}, '
          f'a0 = {a0_min:g} to {a0_max:g}')
    print(f'  {seconds:.3f} s of one core for {table.solves} solves of {table.unknowns} unknowns '
          f'({1e3 * seconds / table.solves:.1f} ms each); imports {imports:.2f} s')
    print(f'  error at unseen frequencies {table.measured_error:.1e}; '
          f'largest memory {megabytes:.0f} MB')
    for step in STEPS:
        print(f'    {step:30s} {1e3 * spent[step]:7.1f} ms  {spent[step] / again:5.0%}')
    rest = again - sum(spent.values())
    print(f'    {"the rest":30s} {1e3 * rest:7.1f} ms  {rest / again:5.0%}')
    if geometry == 'disc':
        soil = Soil(60e6, poisson_ratio, 1900.0, loss_factor)
        model = InfiniteElementModel(soil, Circle(0.7), table)
        omega = np.linspace(*model.omega_range, 1000)
        start = time.process_time()
        model.compliance(omega)
        print(f'  another G and radius, 1000 frequencies: '
              f'{1e3 * (time.process_time() - start):.1f} ms')
    print(flush=True)


def tabulate(
    room: Any, geometry: str, poisson_ratio: float, loss_factor: float, a0_min: float,
    a0_max: float,
) -> Any:
    """Return the table of a kind of soil."""
    return room.tabulate(geometry, poisson_ratio=poisson_ratio, loss_factor=loss_factor,
                         a0_min=a0_min, a0_max=a0_max)


def _clock(room: Any, path: str, step: str, spent: dict[str, float]) -> None:
    *outer, name = path.split('.')
    owner = room
    for part in outer:
        owner = getattr(owner, part)
    plain: Callable[..., Any] = getattr(owner, name)

    def clocked(*args: Any, **kwargs: Any) -> Any:
        start = time.process_time()
        try:
            return plain(*args, **kwargs)
        finally:
            spent[step] += time.process_time() - start

    setattr(owner, name, clocked)


if __name__ == '__main__':
    main()
