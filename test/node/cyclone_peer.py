"""A program of another DDS stack: tells a fan's speed and vibration, writes its answers."""

from dataclasses import dataclass
import json
import sys
import time

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

RELIABLE = Qos(Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepLast(1000))
WANTED, DEADLINE_S, PERIOD_S = 20, 600.0, 0.02


@dataclass
class Time(IdlStruct, typename='builtin_interfaces::msg::dds_::Time_'):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename='std_msgs::msg::dds_::Header_'):
    stamp: Time
    frame_id: str


@dataclass
class JointState(IdlStruct, typename='sensor_msgs::msg::dds_::JointState_'):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


class Peer:
    """Writers and readers of the topics of a machine."""

    def __init__(self, domain):
        self.participant = DomainParticipant(domain)
        self.speed, self.amplitude, self.phase = (
            DataWriter(self.participant, self.topic(f'rt/fan/{name}'), qos=RELIABLE)
            for name in ('joint_states', 'measured/amplitude', 'measured/phase'))
        self.readers = {
            name: DataReader(
                self.participant, self.topic(f'rt/rotorsoil/fan/{name}'), qos=RELIABLE)
            for name in ('amplitude', 'phase', 'residual')}
        self.heard = {name: [] for name in self.readers}

    def topic(self, name):
        return Topic(self.participant, name, JointState, qos=RELIABLE)

    def tell(self, number):
        """Write a speed and a measured vector; frames differ in length, and so does padding."""
        header = Header(Time(1000 + number // 50, number % 50 * 20_000_000), 'x' * (number % 5))
        self.speed.write(JointState(header, ['rotor'], [], [120.0], []))
        self.amplitude.write(JointState(header, ['drive_end_housing_x'], [1e-5], [], []))
        self.phase.write(JointState(header, ['drive_end_housing_x'], [0.3], [], []))

    def listen(self):
        for name, reader in self.readers.items():
            self.heard[name] += [
                [state.header.stamp.sec * 10**9 + state.header.stamp.nanosec, state.name,
                 state.position] for state in reader.take(1000)]


def main(domain):
    peer, number, end = Peer(domain), 0, time.monotonic() + DEADLINE_S
    while min(map(len, peer.heard.values())) < WANTED and time.monotonic() < end:
        peer.tell(number)
        number += 1
        time.sleep(PERIOD_S)
        peer.listen()
    json.dump(peer.heard, sys.stdout)


if __name__ == '__main__':
    main(int(sys.argv[1]))
