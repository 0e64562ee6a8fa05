"""What the documents and examples say of the node is what the node has."""

import gc
from pathlib import Path
import re

import yaml

from rotorsoil_ros.case.document import located
from rotorsoil_ros.case.plant.together import sources_of
from rotorsoil_ros.node.parameters import OF_MACHINE, of_unbalance, OWN
from rotorsoil_ros.wire.handlers import TOPICS
from rotorsoil_ros.wire.messages import OWN_TOPICS

from graphs import Bench

ROOT = Path(__file__).parents[2]
START = ROOT / 'docs' / 'start' / 'ros_developer.md'
# With use_sim_time; when a sensor publishes; where the case has tables of several oils, and
# sensors on the ground.
NOT_ALWAYS = {'/clock', '/fan/measured/disc_1_x/imu', '/fan/oil_temperature',
              '/fan/ground/yard/imu', '/rotorsoil/fan/ground/amplitude',
              '/rotorsoil/fan/ground/phase'}


def test_the_security_policy_is_exactly_for_what_the_node_has(bench: Bench):
    gc.collect()  # a node of the same name is in the graph until its context is collected
    node = bench.active('fan')
    policy = re.search(r'<policy.*</policy>', (ROOT / 'docs' / 'security.md').read_text(),
                       re.DOTALL)[0]

    def named(kind, allowed):
        section = re.search(rf'<{kind}s {allowed}="ALLOW">(.*?)</{kind}s>', policy, re.DOTALL)[1]
        return {node.resolve_topic_name(name)
                for name in re.findall(rf'<{kind}>(.*?)</{kind}>', section)}

    def own(names):
        return {name for name, _ in names(node.get_name(), '/')}

    for told, names in (
            (named('topic', 'publish') - NOT_ALWAYS, node.get_publisher_names_and_types_by_node),
            (named('service', 'reply'), node.get_service_names_and_types_by_node),
            (named('topic', 'subscribe') - NOT_ALWAYS,
             node.get_subscriber_names_and_types_by_node)):
        # The graph learns of the last of them a moment later.
        bench.graph.until(lambda told=told, names=names: told <= own(names), f'{told}')
        assert told == own(names)


def test_the_example_of_parameters_names_only_parameters_of_the_node():
    example = yaml.safe_load((ROOT / 'launch' / 'rotorsoil.yaml').read_text())
    given = example['/**']['ros__parameters']
    machines = {name: given.pop(name) for name in given['machines']}
    plant = machines.pop('fan_house')
    machines |= {name: plant.pop(name) for name in sources_of(located(Path(plant.pop('case'))))}
    assert not plant
    for name, value in given.items():
        if isinstance(value, dict):
            assert all(not OWN[f'{name}.{key}'].fault(entry) for key, entry in value.items())
        else:
            assert not OWN[name].fault(value)
    for machine in machines.values():
        for disc in machine.pop('unbalance', {}).values():
            assert not any(of_unbalance(0j)[key].fault(value) for key, value in disc.items())
        speed = {f'speed.{name}': value for name, value in machine.pop('speed', {}).items()}
        assert all(not OF_MACHINE[name].fault(value)
                   for name, value in {**machine, **speed}.items())


def test_every_parameter_is_told_in_the_documents():
    told = (ROOT / 'docs' / 'operations.md').read_text() + START.read_text()
    assert [name for name in OWN if f'`{name}`' not in told] == []
    assert [name for name in OF_MACHINE if f'<machine>.{name}`' not in told] == []


def test_every_topic_is_told_where_a_developer_starts():
    told = START.read_text()
    # Two names of one row: the second without what both begin with.
    assert [name for name in (*TOPICS, *OWN_TOPICS) if f'<machine>/{name}`' not in told
            and f'.../{name.split("/")[-1]}`' not in told] == []
