"""The run-up that a developer begins with is answered, speed by speed, and drawn."""

import numpy as np
from run_up import CHANNEL, FASTEST, RunUp

import rotorsoil_ros as rs


def test_the_run_up_draws_what_the_machine_should_do(rotorsoil_twin, tmp_path):
    twin = rotorsoil_twin('paper_rotor')
    node = twin.add(RunUp(context=twin.context))
    twin.until(lambda: node.is_done, 'the end of the run-up')
    node.draw(str(tmp_path / 'run_up.png'))
    assert (tmp_path / 'run_up.png').read_bytes().startswith(b'\x89PNG')
    machine = rs.load('paper_rotor')
    table = machine.table
    answered = [stamp for stamp in node.amplitudes
                if table.speed_range[0] <= node.speeds[stamp] <= FASTEST]
    assert len(answered) > 100
    heard = sorted(node.amplitudes)
    exact = machine.predict(rs.Profile('', np.array(heard), np.array(
        [node.speeds[stamp] for stamp in heard])))
    exact = exact.displacement[np.isin(exact.stamp_ns, answered)]
    np.testing.assert_allclose(
        [node.amplitudes[stamp] for stamp in answered],
        np.abs(exact[:, table.channels.index(CHANNEL)]), rtol=1e-14)
