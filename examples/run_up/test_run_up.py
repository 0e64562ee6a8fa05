"""The run-up that a developer begins with is answered, speed by speed, and drawn."""

import math

import numpy as np
from run_up import CHANNEL, FASTEST, RunUp

import rotorsoil_ros as rs
from rotorsoil_ros.testing.plugin import SHIPPED_CASES


def test_the_run_up_draws_what_the_machine_should_do(rotorsoil_twin, tmp_path):
    twin = rotorsoil_twin('paper_rotor')
    node = twin.add(RunUp(context=twin.context))
    twin.until(lambda: node.is_done, 'the end of the run-up')
    node.draw(str(tmp_path / 'run_up.png'))
    assert (tmp_path / 'run_up.png').read_bytes().startswith(b'\x89PNG')
    machine = rs.load(SHIPPED_CASES / 'paper_rotor.yaml')
    for stamp, amplitude in node.amplitudes.items():
        rpm = node.speeds[stamp] * 30.0 / math.pi
        if machine.case.speed_range[0] <= node.speeds[stamp] <= FASTEST:
            exact = machine.response(rpm=rpm)[CHANNEL].amplitude.item()
            np.testing.assert_allclose(amplitude, exact, rtol=1e-6)  # of a table between rows
