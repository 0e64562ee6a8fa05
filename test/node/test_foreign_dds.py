"""The node talks with programs of another DDS stack, byte for byte."""

import json
import os
from pathlib import Path
import platform
import subprocess
import sys

import numpy as np
import pytest
from rclpy.parameter import Parameter

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.node.node import RotorsoilNode

FAN = Path('config/plant_fan.yaml')
PEER = Path(__file__).parent / 'cyclone_peer.py'
ON_THIS_HOST = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    '<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto'
    '</ParticipantIndex><Peers><Peer Address="localhost"/></Peers></Discovery></Domain>'
    '</CycloneDDS>')


@pytest.mark.skipif((sys.platform, platform.machine()) != ('linux', 'x86_64'),
                    reason='no wheel of cyclonedds for this machine')
def test_another_stack_is_heard_and_answered(graph, cache):
    fan = Machine.load(FAN, cache_directory=cache)
    parameters = {'cache': str(cache), 'machines': ['fan'], 'fan.case': str(FAN),
                  'speed_reliability': 'reliable', 'speed_depth': 1000, 'log.rerun': False}
    node = graph.add(RotorsoilNode(
        context=graph.context, parameter_overrides=[
            Parameter(name, value=value) for name, value in parameters.items()]))
    assert node.start()
    with subprocess.Popen(
            [sys.executable, str(PEER), str(graph.context.get_domain_id())],
            stdout=subprocess.PIPE, text=True,
            env={**os.environ, 'CYCLONEDDS_URI': ON_THIS_HOST}) as peer:
        graph.until(lambda: peer.poll() is not None, 'the other program')
        heard = json.loads(peer.communicate()[0])
    node.release()

    exact = fan.table.predictor(fan.case.unbalance).predict(np.array([120.0])).displacement[0]
    for name, values in (('amplitude', np.abs(exact)), ('phase', np.angle(exact))):
        assert len(heard[name]) >= 20
        for _, channels, position in heard[name]:
            assert tuple(channels) == fan.table.channels
            np.testing.assert_allclose(position, values, rtol=1e-14)
    column = fan.table.channels.index('drive_end_housing_x')
    residual = abs(1e-5 * np.exp(0.3j) - exact[column])
    stamps = {stamp for stamp, _, _ in heard['amplitude']}
    assert len(heard['residual']) >= 20
    for stamp, channels, position in heard['residual']:
        assert channels == ['drive_end_housing_x']
        assert position == pytest.approx([residual])
        assert stamp in stamps or stamp > max(stamps)
