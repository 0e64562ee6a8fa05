"""
Count rooms and calls of the four trips through the package.

    python -m benchmarks.trips

A room is a module of the package of which a function runs, a call is one such function call
(a generator that goes on counts again). From a YAML file to its table: nothing in the cache,
infinite elements. From a speed to bytes and from a measured vector to its residual: the second
message, so that nothing is met for the first time. From the tick of a second to /diagnostics.
"""

from collections import Counter
from collections.abc import Callable
from pathlib import Path
import sys
import tempfile
from types import FrameType

import numpy as np

import rotorsoil_ros
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.wire.handlers import inlet, MEASURED_TOPICS
from rotorsoil_ros.wire.messages import Encoder, JointStateWriter, Messenger, Records, Topics
from rotorsoil_ros.wire.speeds import ROTOR_JOINT

PACKAGE = Path(rotorsoil_ros.__file__).parent
CASE = PACKAGE.parent / 'config' / 'plant_fan.yaml'
CHANNEL = 'drive_end_housing_x'
START_NS, STEP_NS = 1_700_000_000_000_000_000, 100_000_000


def trip(call: Callable[[], object]) -> Counter[str]:
    """Return how often functions of each room of the package run in a call."""
    rooms: Counter[str] = Counter()
    inside = str(PACKAGE)

    def count(frame: FrameType, event: str, argument: object) -> None:
        del argument
        if event == 'call' and frame.f_code.co_filename.startswith(inside):
            rooms[str(Path(frame.f_code.co_filename).relative_to(PACKAGE))] += 1

    sys.setprofile(count)
    try:
        call()
    finally:
        sys.setprofile(None)
    return rooms


class Plant:
    """A fan with inlets and a monitor, as the node has them, and what it published."""

    def __init__(self, directory: Path) -> None:
        machine = Machine.load(CASE, cache_directory=directory)
        self.told: list[Records] = []
        messenger = Messenger(
            Encoder('fan', machine.table.channels, Topics.of('', 'fan')), [self.told.append])
        self.monitor = Monitor('fan', machine.table, machine.case.unbalance, sinks=[messenger])
        self.monitor.judge.take_criteria(criteria(
            machine.case, machine.model, machine.case.unbalance, directory))
        self.monitor.begin(START_NS, machine.description('fan', machine.case.unbalance))
        self._inlets = {name: inlet(name, f'/fan/{name}', self.monitor,
                                    log=lambda records: None)
                        for name in ('joint_states', *MEASURED_TOPICS)}

    def hear(self, topic: str, name: str, values: tuple[float, float], step: int) -> None:
        """Take in a JointState of one name with position and velocity."""
        stamp = START_NS + step * STEP_NS
        row = np.array([[[values[0]], [values[1]], [np.nan]]])
        [cdr] = JointStateWriter([name]).write([stamp], row)
        self.messages = (stamp,), (bytes(cdr),)
        self._taken_in = self._inlets[topic]

    def take_in(self) -> None:
        """Hand the message to its inlet."""
        self._taken_in(*self.messages)

    def speed(self, step: int) -> Counter[str]:
        """Return the trip of a speed."""
        self.hear('joint_states', ROTOR_JOINT, (np.nan, 120.0), step)
        return trip(self.take_in)

    def vector(self, step: int) -> Counter[str]:
        """Return the trip of the second half of a measured vector."""
        self.hear('measured/amplitude', CHANNEL, (1e-5, np.nan), step)
        self.take_in()
        self.hear('measured/phase', CHANNEL, (0.3, np.nan), step)
        return trip(self.take_in)

    def published(self, name: str) -> bool:
        """Return whether something went out under a name since it was asked last."""
        names = [records.topic for records in self.told]
        self.told.clear()
        return any(topic.endswith(name) for topic in names)


def main() -> None:
    """Count and print a table in Markdown."""
    with tempfile.TemporaryDirectory() as name:
        rows = {'YAML to table': trip(lambda: Machine.load(
            CASE, cache_directory=Path(name) / 'cold'))}
        plant = Plant(Path(name))
        for step in range(3):
            rows['speed to bytes'] = plant.speed(step)
            assert plant.published('/amplitude'), 'no answer'
            rows['vector to residual'] = plant.vector(step)
            assert plant.published('/residual'), 'no residual'
        for second in (1, 2):
            rows['tick to /diagnostics'] = trip(lambda now=START_NS + second * 10**9: (
                plant.monitor.tick(now, stale_after_s=3.0)))
            assert plant.published('/diagnostics'), 'no diagnostics'
    print('| trip | rooms | calls |\n|---|---|---|')
    for trip_name, rooms in rows.items():
        print(f'| {trip_name} | {len(rooms)} | {rooms.total()} |')


if __name__ == '__main__':
    main()
