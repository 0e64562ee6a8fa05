"""The node hears the temperature of the oil of a machine on films, and answers from its table."""

from films import OIL_CASE
import numpy as np
import pytest
from sensor_msgs.msg import Temperature

from rotorsoil_ros.case.machine import Machine

from graphs import Bench, joint_state, STAMP


@pytest.fixture
def oiled(tmp_path):
    path = tmp_path / 'oiled.yaml'
    path.write_text(OIL_CASE)
    return Machine.load(path, cache_directory=tmp_path)


def test_answers_follow_the_oil(graph, oiled):
    bench = Bench(graph, oiled.directory, oiled.case.path)
    bench.active('fan')
    amplitude, _ = bench.answers()
    publish = bench.speaker()
    warm = bench.graph.speaker('/fan/oil_temperature', Temperature)
    bench.graph.until(lambda: bench.probe.count_subscribers('/fan/oil_temperature'), 'the node')
    bench.settle()
    publish(joint_state([250.0]))
    bench.graph.until(lambda: amplitude, 'the first answer')
    message = Temperature(temperature=78.0)
    message.header.stamp.sec = STAMP // 10**9
    warm.publish(message)
    monitor = bench.graph.nodes[1]._watches['fan'].monitor
    bench.graph.until(lambda: monitor.table is monitor._oils.tables.get(80.0), 'the warm table')
    publish(joint_state([250.0], stamp=STAMP + 5))
    bench.graph.until(lambda: len(amplitude) == 2, 'the second answer')
    for told, table in zip(amplitude, (oiled.table, oiled.oils[80.0]), strict=True):
        wanted = table.predictor(oiled.case.unbalance).predict(np.array([250.0])).displacement[0]
        np.testing.assert_allclose(told.position, np.abs(wanted), rtol=1e-14)
    for node in bench.graph.nodes[1:]:
        node.release()


def test_machine_without_tables_of_oil_does_not_listen(bench):
    node = bench.active('fan')
    heard = node.get_subscriber_names_and_types_by_node(node.get_name(), '/')
    assert '/fan/oil_temperature' not in {name for name, _ in heard}
