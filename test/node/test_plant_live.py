"""Several machines of one case file, live: parts by source, and what they do together."""

from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
from sensor_msgs.msg import JointState
import yaml

import rotorsoil_ros as rs
from rotorsoil_ros.case import document
from rotorsoil_ros.case.plant.together import Plant

from graphs import joint_state, STAMP, stamp_ns

CONFIG = Path(__file__).parents[2] / 'config'
HOUSE = CONFIG / 'fan_house.yaml'


def test_each_machine_answers_its_part_and_the_total_adds_them(bench, cache):
    bench.active('fan_1', 'fan_2', stale_after_s=1.0, fan_1__case='fan_house',
                 fan_2__case=f'{HOUSE}#fan_2')
    parts = [bench.answers(name)[0] for name in ('fan_1', 'fan_2')]
    total = bench.hear('/rotorsoil/fan_house/total')
    said = bench.hear('/diagnostics', DiagnosticArray)
    first, second = (bench.speaker(f'/{name}/joint_states') for name in ('fan_1', 'fan_2'))
    first(joint_state([150.0]))
    second(joint_state([140.0], stamp=STAMP + 7))
    bench.graph.until(lambda: total and stamp_ns(total[-1]) == STAMP + 7, 'the total')
    plant = Plant.load(HOUSE, cache_directory=cache)
    found = plant.shaken(rpm={'fan_1': 150.0 * 30.0 / np.pi, 'fan_2': 140.0 * 30.0 / np.pi})
    for part, own in zip(parts, np.abs(found.displacement), strict=True):
        assert list(part[0].name) == list(found.channels)
        np.testing.assert_allclose(part[0].position, own, rtol=1e-6, atol=1e-15)
    np.testing.assert_allclose(total[-1].velocity, found.velocity_rms, rtol=1e-6, atol=1e-13)
    np.testing.assert_allclose(total[-1].position, found.highest, rtol=1e-6, atol=1e-15)
    assert total[-1].header.frame_id == 'fan_house'

    def told(summary):
        return any(status.message == summary for array in said for status in array.status)

    bench.graph.until(lambda: told('fan_1, fan_2 together'), 'who is in the total')
    # Neither is heard any more; then one is, by itself.
    bench.graph.until(lambda: told('at least: nothing of fan_1, fan_2'), 'that all are silent')
    first(joint_state([151.0], stamp=STAMP + 60 * 10**9))
    bench.graph.until(lambda: stamp_ns(total[-1]) > STAMP + 7, 'a total of one')
    np.testing.assert_allclose(total[-1].position, parts[0][-1].position, rtol=1e-12)


def test_geared_machine_turns_with_the_other(bench, tmp_path):
    content = document.read(HOUSE)
    del content['machines'][1]['rated_rpm']
    content['machines'][1]['ratio'] = {'of': 'fan_1', 'times': 0.5}
    case = tmp_path / 'geared.yaml'
    case.write_text(yaml.safe_dump(content))
    (tmp_path / 'plant_fan.yaml').write_text((CONFIG / 'plant_fan.yaml').read_text())
    bench.active('fan_1', 'fan_2', fan_1__case=str(case), fan_2__case=str(case))
    slow = bench.answers('fan_2')[0]
    speaker = bench.graph.speaker('/fan_1/joint_states', JointState)
    bench.graph.until(lambda: speaker.get_subscription_count() == 2, 'both that hear it')
    speaker.publish(joint_state([150.0]))
    bench.graph.until(lambda: slow, 'the answer of the geared machine')
    fan = Plant.load(case, cache_directory=Path(bench.cache)).machines['fan_2']
    looked_up = fan.table.predictor(fan.case.unbalance).predict(np.array([75.0]))
    np.testing.assert_allclose(slow[0].position, np.abs(looked_up.displacement[0]), rtol=1e-9)


def test_blocks_on_one_ground_and_a_probe_in_the_yard_are_answered(bench, cache):
    bench.active('fan', fan__case='fan_on_l_block')
    told = bench.answers('fan')[0]
    bench.speaker('/fan/joint_states')(joint_state([150.0]))
    bench.graph.until(lambda: told, 'the answer')
    fan = rs.load(CONFIG / 'fan_on_l_block.yaml', cache_directory=cache)
    looked_up = fan.table.predictor(fan.case.unbalance).predict(np.array([150.0]))
    assert list(told[0].name) == list(map(str, fan.table.channels))
    assert {'yard_z', 'next_block_z'} <= set(told[0].name)
    np.testing.assert_allclose(told[0].position, np.abs(looked_up.displacement[0]), rtol=1e-12)
