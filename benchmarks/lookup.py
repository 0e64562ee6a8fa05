"""
Measure look-ups, offline prediction end to end, and how fast the node starts and stops.

    python -m benchmarks.lookup
"""

from dataclasses import replace
import os
from pathlib import Path
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.profile import write_speed_profile
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.machine.band import ResponseBand
from rotorsoil_ros.machine.spread import SoilSpread
from rotorsoil_ros.machine.transient.poles import poles_of
from rotorsoil_ros.machine.transient.state import Transient
from rotorsoil_ros.prediction import Prediction

CASE = Path(__file__).resolve().parents[1] / 'config' / 'paper_rotor.yaml'
SAMPLES = 200_000


def look_ups(machine: Machine) -> None:
    """Print the rate of vectorised look-ups and the cost of a single one."""
    predictor = machine.table.predictor(machine.case.unbalance)
    speed = np.random.default_rng(0).uniform(*machine.table.speed_range, size=SAMPLES)
    for name, values in (('random', speed), ('a run-up', np.sort(speed))):
        seconds = []
        for _ in range(5):
            start = time.perf_counter()
            predictor.predict(values)
            seconds.append(time.perf_counter() - start)
        print(f'look-up, {name}: {SAMPLES / max(seconds):.3g} to '
              f'{SAMPLES / min(seconds):.3g} speeds/s')
    start = time.perf_counter()
    for index in range(2000):
        predictor.predict(speed[index:index + 1])
    print(f'look-up, one by one: {(time.perf_counter() - start) / 2000 * 1e6:.3g} us')


def run_up(machine: Machine) -> None:
    """Print what it costs to find what a changing speed strikes, and to follow it."""
    table = machine.table
    start = time.process_time()
    for _ in range(5):
        poles_of(machine.model, table.speed_range, table.stability, dense=table.pieces.edges)
    print(f'free vibrations of a table: {len(table.poles)} in '
          f'{(time.process_time() - start) / 5 * 1e3:.3g} ms')
    predictor = table.predictor(machine.case.unbalance)
    stamps = np.arange(2000) * 10**7
    ramp = np.linspace(*table.speed_range, 2000)
    for name, speed in (('speeding up', ramp), ('constant speed', np.full(2000, ramp[1000]))):
        steady, transient = predictor.predict(speed), Transient(table.poles)
        start = time.process_time()
        for index in range(2000):
            here = slice(index, index + 1)
            one = Prediction.of_parts(speed[here], steady.parts[here])
            predictor.moved(one, transient.follow(stamps[here], speed[here]))
        print(f'what is struck, {name}: {(time.process_time() - start) / 2000 * 1e6:.3g} us a '
              'speed')


def end_to_end(machine: Machine, directory: Path) -> None:
    """Print the rate of reading a profile, answering it and writing the MCAP."""
    stamp_ns = 10**18 + 10**7 * np.arange(SAMPLES)
    write_speed_profile(directory / 'in.mcap', 'paper_rotor', stamp_ns,
                        np.linspace(10.0, 900.0, SAMPLES))
    start = time.process_time()
    predict(machine, directory / 'in.mcap', directory / 'out.mcap')
    seconds = time.process_time() - start
    size = (directory / 'out.mcap').stat().st_size
    print(f'predict end to end: {SAMPLES / seconds:.3g} speeds/s and core, '
          f'{size / SAMPLES:.0f} bytes per speed')


def band(machine: Machine) -> None:
    """Print what the band over 64 soils costs."""
    case, model = machine.case, machine.model
    assert case.soil is not None
    start = time.process_time()
    spread = SoilSpread()
    soils = [spread.soil(case.soil, place) for place in spread.places(with_soil=True)[1:]]
    others = (replace(model, soil_models=[ConeModel(soil, foundation.contact)
                                          for foundation in model.foundations])
              for soil in soils)
    ResponseBand.build(machine.table, others).envelope(case.unbalance)
    print(f'band over {len(soils) + 1} soils: {time.process_time() - start:.2f} s of one core')


def start_and_stop(directory: Path) -> None:
    """Print how long a node takes from a warm cache to active, and from SIGTERM to its end."""
    for log in ('', str(directory / 'log')):
        command = [sys.executable, '-m', 'rotorsoil_ros.node.node', '--ros-args',
                   '-p', 'machines:=[paper_rotor]', '-p', f'paper_rotor.case:={CASE}',
                   '-p', f'cache:={directory}', *(['-p', f'log.directory:={log}'] if log else [])]
        start = time.perf_counter()
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as node:
            assert node.stderr is not None
            for line in node.stderr:
                if 'active' in line:
                    break
            active, start = time.perf_counter() - start, time.perf_counter()
            node.send_signal(signal.SIGTERM)
            node.wait(20)
        print(f'node {"with" if log else "without"} log: active after {active:.2f} s, '
              f'ended {time.perf_counter() - start:.2f} s after SIGTERM')


def main() -> None:
    """Measure all of it."""
    os.environ.update(ROS_DOMAIN_ID='58', ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST')
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        machine = Machine.load(CASE, cache_directory=directory)
        look_ups(machine)
        run_up(machine)
        end_to_end(machine, directory)
        band(machine)
        start_and_stop(directory)


if __name__ == '__main__':
    main()
