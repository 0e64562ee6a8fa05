"""
What foundations that bend cost, and how many rows a table of their seats needs.

`python -m benchmarks.foundations` prints both.
"""

import argparse
from dataclasses import replace
from pathlib import Path
import time

import numpy as np
from scipy.interpolate import CubicSpline

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.flexible.body import CONTACT, Dof, FlexibleBody, SEAT
from rotorsoil_ros.machine.flexible.receptance import SeatReceptance
from rotorsoil_ros.units import hz_to_rad_s

MODES = (0, 10, 50)
STEPS = (1.0, 0.25, 0.1)  # [Hz]
FRAME = Path(__file__).parents[1] / 'examples' / 'foundations' / 'turbine_deck.yaml'
SPEEDS, REPEATS = 300, 15


def on_modes(model: CoupledModel, modes: int) -> CoupledModel:
    """Return a machine whose block has so many modes and a residual, on its one contact."""
    [block] = model.foundations
    random = np.random.default_rng(0)
    dofs = [Dof(bearing.name, axis, SEAT, (
        -block.centre_x, bearing.position - block.centre_y, model.rotor.shaft_height))
        for bearing in model.rotor.bearings for axis in ('x', 'z')]
    dofs += [Dof('base', axis, CONTACT, (0.0, 0.0, 0.0)) for axis in DOFS]
    count = len(dofs)
    spring = random.normal(size=(count, count))
    body = FlexibleBody(
        tuple(dofs), block.mass_matrix, np.array([dof.rigid_row for dof in dofs]),
        random.normal(size=(count, modes)) / np.sqrt(block.mass),
        (2.0 * np.pi * np.linspace(60.0, 600.0, modes)) ** 2, 1e-13 * spring @ spring.T,
        np.full(modes, 0.04), 0.04)
    return replace(model, foundations=(replace(block, body=body),))


def seconds(model: CoupledModel, speed: np.ndarray, unbalance: np.ndarray) -> float:
    """Return the shortest time of one unbalance response [s]."""
    model.unbalance_response(speed, unbalance)
    taken = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        model.unbalance_response(speed, unbalance)
        taken.append(time.perf_counter() - start)
    return min(taken)


def rows_needed() -> None:
    """Print how far a table of a frame's seats is off between its rows, by law and by spline."""
    machine = Machine.load(FRAME)
    hertz = np.linspace(5.0, 55.0, 997)
    exact = machine.seat_receptance(hz=hertz)
    size = np.abs(exact).max(axis=(1, 2))
    for step in STEPS:
        rows = np.arange(5.0, 55.0 + 0.5 * step, step)
        values = machine.seat_receptance(hz=rows)
        table = SeatReceptance.of(machine.seats, hz_to_rad_s(rows), values)
        found = table.compliance(hz_to_rad_s(hertz)), CubicSpline(rows, values)(hertz)
        law, spline = (float((np.abs(one - exact).max(axis=(1, 2)) / size).max())
                       for one in found)
        print(f'rows {step:g} Hz apart: the law is off by {law:.1e}, a spline by {spline:.1e}')


def main() -> None:
    """Print the cost beside that of the rigid block, in the same run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('case', nargs='?', default='config/plant_fan.yaml')
    machine = Machine.load(Path(parser.parse_args().case))
    speed = np.linspace(*machine.case.speed_range, SPEEDS)
    rigid = seconds(machine.model, speed, machine.case.unbalance)
    print(f'rigid block  {1e3 * rigid:.2f} ms for {SPEEDS} speeds')
    for modes in MODES:
        taken = seconds(on_modes(machine.model, modes), speed, machine.case.unbalance)
        print(f'{modes:3d} modes    {1e3 * taken:.2f} ms, '
              f'{taken / rigid:.2f} of the rigid block')
    rows_needed()


if __name__ == '__main__':
    main()
