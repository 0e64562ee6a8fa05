"""Messages of a log for the tests, and all that is in one."""

from pathlib import Path
import struct

import numpy as np
from rosbags.typesys import get_typestore, Stores

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.tables.imported import import_table
from rotorsoil_ros.wire.definitions import FLOAT64, JOINT_STATE, STRING
from rotorsoil_ros.wire.messages import JointStateWriter, Records

STORE = get_typestore(Stores.ROS2_JAZZY)
RUN_UP = Path(__file__).parent / 'reference' / 'measured' / 'rk4_runup_1x.csv'
START = 1_700_000_000_000_000_001


def joint_records(count, *, topic='/fan/joint_states', start=START):
    stamps = [start + 10**6 * row for row in range(count)]
    values = np.random.default_rng(count).normal(size=(count, 3, 1))
    return Records(topic, JOINT_STATE, stamps, JointStateWriter(['rotor']).write(stamps, values))


def float_records(count, *, topic='/fan/rotor/speed', start=START):
    stamps = [start + 10**6 * row for row in range(count)]
    return Records(topic, FLOAT64, stamps, [
        b'\0\1\0\0' + struct.pack('<d', row) for row in range(count)])


def string_records(*, start=START):
    payload = STORE.serialize_cdr(STORE.types[STRING]('{}'), STRING)
    return Records('/rotorsoil/fan/model', STRING, [start], [bytes(payload)], latched=True)


def import_run_up(path, machine='rk4_rotor_kit', start_ns=START):
    """Write the measured run-up of the rotor kit, a row of which is a turn."""
    return import_table(RUN_UP, {
        'machine': machine, 'time': {'every': 'turn'}, 'speed': {'column': 'rpm', 'unit': 'rpm'},
        'channels': {'probe_1_x': {
            'amplitude': {'column': 'amp_1x_um', 'unit': 'um 0-p'},
            'phase': {'column': 'phase_1x_deg', 'unit': 'deg', 'sense': 'lead'}}}},
        path, start_ns=start_ns)


def read_all(path, **options):
    return [(source.topic, time, payload)
            for source, time, payload in bag_reader.messages(path, lambda *_: True, **options)]


def written(*batches):
    return sorted((time, records.topic, payload) for records in batches
                  for time, payload in zip(records.log_time_ns, records.payloads, strict=True))


def topics_of(path):
    """Return type and number of messages of every topic that is CDR."""
    return {source.topic: (source.type, number)
            for source, number in bag_reader.sources(path).items() if source.encoding == 'cdr'}
