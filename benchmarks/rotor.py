"""
Time the rotor: fast solve against the dense one, modes, and how both grow.

One core, one BLAS thread, processor time, the best of several runs:
`OMP_NUM_THREADS=1 python benchmarks/rotor.py`.
"""

from collections.abc import Callable
import math
import os

os.environ['OMP_NUM_THREADS'] = '1'

import time

import numpy as np

from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, Soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes import campbell, critical_speeds
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftSection

from oracles.dense import dense_response

LENGTH, DIAMETER = 0.76202, 0.020021
SPEED_RANGE = (2.0 * math.pi, 300.0 * math.pi)
UNBALANCE = np.array([1e-5, 0.0])

# What ROSS 3.0 took for the same rotor once: processor seconds.
ROSS_RESPONSE, ROSS_CAMPBELL = 2.3, 2.5


def machine(elements: int) -> CoupledModel:
    """Return the seed paper's rotor on one block on soil."""
    shaft = ShaftSection(LENGTH, (DIAMETER, DIAMETER), (0.0, 0.0), elements,
                         Material(2.09e11, 0.3, 7920.0))
    discs = (Disc('disc_1', LENGTH / 4.0, 0.7, 1e-3, 2e-3),
             Disc('disc_2', LENGTH, 1.6, 3.2e-3, 6.4e-3))
    bearings = tuple(Bearing(name, place, 'block', 1e9 * np.eye(2), 5e2 * np.eye(2))
                     for name, place in (('bearing_1', 0.0), ('bearing_2', 0.75 * LENGTH)))
    contact = Rectangle(0.5, 0.5)
    block = Foundation('block', contact, 0.375 * LENGTH, 42.0, 0.0, (3.5, 3.5, 7.0))
    return CoupledModel(Rotor(0.6, (shaft,), discs, bearings), (block,),
                        (ConeModel(Soil(48e6, 0.25, 1900.0, 0.10), contact),))


def seconds(call: Callable[[], object], runs: int) -> float:
    """Return the shortest processor time of a call."""
    shortest = math.inf
    for _ in range(runs):
        start = time.process_time()
        call()
        shortest = min(shortest, time.process_time() - start)
    return shortest


def dense(model: CoupledModel, speed: np.ndarray) -> None:
    """Solve the assembled system, a hundred speeds at a time: all at once would not fit."""
    for part in np.array_split(speed, max(len(speed) // 100, 1)):
        dense_response(model, part, UNBALANCE)


def main() -> None:
    """Measure and print."""
    print('response of the 28-element rotor on soil')
    for count in (300, 3000):
        speed = np.linspace(*SPEED_RANGE, count)
        model = machine(28)
        cold = seconds(lambda speed=speed: machine(28).unbalance_response(speed, UNBALANCE), 7)
        warm = seconds(
            lambda speed=speed, model=model: model.unbalance_response(speed, UNBALANCE), 15)
        slow = seconds(lambda speed=speed, model=model: dense(model, speed), 2)
        print(f'  {count:5d} speeds: {1e3 * warm:8.2f} ms ({1e3 * cold:.2f} ms from the case on), '
              f'dense {1e3 * slow:8.0f} ms: {slow / warm:.0f} times')
        if count == 300:
            print(f'               ROSS 3.0 once {1e3 * ROSS_RESPONSE:.0f} ms: '
                  f'{ROSS_RESPONSE / warm:.0f} times ({ROSS_RESPONSE / cold:.0f} times from the '
                  'case on)')
    table = seconds(lambda: ResponseTable.build(machine(28), SPEED_RANGE), 3)
    print(f'  response table 60 to 9000 rpm: {1e3 * table:.0f} ms')

    speed = np.linspace(0.0, SPEED_RANGE[1], 50)
    modes = seconds(lambda: campbell(machine(28), speed, 6), 7)
    print(f'campbell, 50 speeds, 6 modes: {1e3 * modes:.0f} ms; ROSS 3.0 once '
          f'{1e3 * ROSS_CAMPBELL:.0f} ms: {ROSS_CAMPBELL / modes:.0f} times')
    criticals = seconds(lambda: critical_speeds(machine(28), SPEED_RANGE), 3)
    print(f'critical speeds 60 to 9000 rpm: {1e3 * criticals:.0f} ms')

    print('growth with elements: set-up, then 300 and 3000 speeds; frf at 300 and 3000 '
          'frequencies with its set-up; campbell')
    for elements in (28, 112, 448):
        runs = 5 if elements < 400 else 1
        few, many = (np.linspace(*SPEED_RANGE, count) for count in (300, 3000))
        first = seconds(lambda elements=elements, few=few: machine(elements).unbalance_response(
            few[:1], UNBALANCE), runs)
        model = machine(elements)
        model.unbalance_response(few, UNBALANCE)
        times = [seconds(lambda speeds=speeds, model=model: model.unbalance_response(
            speeds, UNBALANCE), runs) for speeds in (few, many)]
        times += [seconds(lambda omega=omega, model=model: model.frequency_response(
            omega, speed=300.0, channel='disc_1_z'), runs) for omega in (few, many)]
        diagram = seconds(lambda elements=elements: campbell(machine(elements), speed, 6), runs)
        each = ', '.join(f'{1e3 * one:7.2f} ms' for one in times)
        print(f'  {elements:4d} elements: {1e3 * first:8.1f} ms, {each}, {1e3 * diagram:7.1f} ms')


if __name__ == '__main__':
    main()
