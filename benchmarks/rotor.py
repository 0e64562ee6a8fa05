"""
Time the rotor: fast solve against the dense one and against ROSS, modes, and how they grow.

One core, one BLAS thread, processor time, the best of several runs: `python -m benchmarks.rotor`.
ROSS is measured in the same run where the interpreter that `ROSS_PYTHON` names, or this one, has
it (`make bench` sees to that; `pip install rotorsoil_ros[bench]` into an environment of its own
does too). Without it the comparison is left out, and said to be.
"""

from dataclasses import replace
import json
import math
import os
from pathlib import Path

os.environ['OMP_NUM_THREADS'] = '1'

import subprocess
import sys
from typing import Any

import numpy as np

from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, Soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.bearing import Bearing
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftSection

from benchmarks.ross_rotor import seconds
from machines import Restrained
from oracles.dense import dense_response

LENGTH, DIAMETER = 0.76202, 0.020021
SPEED_RANGE = (2.0 * math.pi, 300.0 * math.pi)
UNBALANCE = np.array([1e-5, 0.0])
CAMPBELL, MODES = np.linspace(0.0, SPEED_RANGE[1], 50), 6
ROOT = Path(__file__).resolve().parents[1]


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


def dense(model: CoupledModel, speed: np.ndarray) -> None:
    """Solve the assembled system, a hundred speeds at a time: all at once would not fit."""
    for part in np.array_split(speed, max(len(speed) // 100, 1)):
        dense_response(model, part, UNBALANCE)


def for_ross(model: CoupledModel, speed: np.ndarray) -> dict[str, Any]:
    """Return the rotor on a block that only translates, in words of ROSS: y is up there."""
    rotor, [block] = model.rotor, model.foundations
    places = rotor.node_positions
    soil = 1.0 / model.soil_models[0].compliance(speed)[:, [0, 2], [0, 2]]
    [section], first = rotor.shaft, rotor.bearings[0]
    return {
        'density': section.material.density, 'young_modulus': section.material.young_modulus,
        'poisson_ratio': section.material.poisson_ratio, 'diameter': DIAMETER,
        'lengths': np.diff(places).tolist(),
        'discs': [{'node': rotor.node_of(disc.position), 'mass': disc.mass,
                   'diametral': disc.diametral_inertia, 'polar': disc.polar_inertia}
                  for disc in rotor.discs],
        'bearings': [rotor.node_of(one.position) for one in rotor.bearings],
        'stiffness': first.stiffness[0, 0], 'damping': first.damping[0, 0],
        'soil_k_x': soil[:, 0].real.tolist(), 'soil_c_x': (soil[:, 0].imag / speed).tolist(),
        'soil_k_z': soil[:, 1].real.tolist(), 'soil_c_z': (soil[:, 1].imag / speed).tolist(),
        'block_mass': block.mass, 'unbalance': UNBALANCE[0], 'speed': speed.tolist(),
        'campbell': CAMPBELL.tolist(), 'modes': MODES}


def measure_ross(speed: np.ndarray) -> dict[str, Any] | None:
    """Return what ROSS takes for the same rotor and what it finds, where it is installed."""
    python = os.environ.get('ROSS_PYTHON', sys.executable)
    if subprocess.run([python, '-c', 'import ross'], capture_output=True, check=False).returncode:
        return None
    done = subprocess.run(
        [python, '-m', 'benchmarks.ross_rotor'], cwd=ROOT, capture_output=True, text=True,
        check=True, input=json.dumps(for_ross(machine(28), speed)))
    found = json.loads(done.stdout.splitlines()[-1])
    model = machine(28)
    translates = replace(model, soil_models=tuple(
        Restrained(soil, 'x', 'z') for soil in model.soil_models))
    ours = translates.unbalance_response(speed, UNBALANCE).displacement
    column = [str(channel) for channel in model.channels].index('disc_1_x')
    found['deviation'] = float(np.abs(
        np.abs(ours[:, column]) / np.array(found['amplitude_x']) - 1.0).max())
    return found


def compare_with_ross(warm: float, cold: float, modes: float) -> None:
    """Print what ROSS takes beside what was measured here."""
    ross = measure_ross(np.linspace(*SPEED_RANGE, 300))
    if ross is None:
        print('ROSS: not installed here or at ROSS_PYTHON, so not compared')
        return
    print(f'ROSS {ross["version"]}, the same rotor, amplitudes within {ross["deviation"]:.1e}')
    for what, theirs, ours in (
            ('300 speeds', ross['warm'], warm), ('300 speeds, from the case on', ross['cold'],
                                                 cold), ('campbell', ross['campbell'], modes)):
        print(f'  {what}: ROSS {1e3 * theirs:.0f} ms, here {1e3 * ours:.2f} ms: '
              f'{theirs / ours:.0f} times')


def main() -> None:
    """Measure and print."""
    fast = {}
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
        fast[count] = warm, cold
    table = seconds(lambda: ResponseTable.build(machine(28), SPEED_RANGE), 3)
    print(f'  response table 60 to 9000 rpm: {1e3 * table:.0f} ms')

    modes = seconds(lambda: campbell(machine(28), CAMPBELL, MODES), 7)
    print(f'campbell, {len(CAMPBELL)} speeds, {MODES} modes: {1e3 * modes:.0f} ms')
    criticals = seconds(lambda: critical_speeds(machine(28), SPEED_RANGE), 3)
    print(f'critical speeds 60 to 9000 rpm: {1e3 * criticals:.0f} ms')

    compare_with_ross(*fast[300], modes)

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
        diagram = seconds(lambda elements=elements: campbell(
            machine(elements), CAMPBELL, MODES), runs)
        each = ', '.join(f'{1e3 * one:7.2f} ms' for one in times)
        print(f'  {elements:4d} elements: {1e3 * first:8.1f} ms, {each}, {1e3 * diagram:7.1f} ms')


if __name__ == '__main__':
    main()
