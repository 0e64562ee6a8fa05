"""What the documents and examples say of the node is what the node has."""

from fnmatch import fnmatch
import gc
from pathlib import Path
import re

import pytest
import yaml

from rotorsoil_ros.case.document import located
from rotorsoil_ros.case.plant.together import sources_of
from rotorsoil_ros.node.parameters import OF_MACHINE, of_unbalance, OWN
from rotorsoil_ros.wire.handlers import TOPICS
from rotorsoil_ros.wire.messages import GROUND_TOPICS, OWN_TOPICS

from graphs import Bench

ROOT = Path(__file__).parents[2]
SECURITY = (ROOT / 'docs' / 'security.md').read_text()
START = ROOT / 'docs' / 'start' / 'ros_developer.md'
# With use_sim_time; when a sensor publishes; where the case has tables of several oils, and
# sensors on the ground.
NOT_ALWAYS = ('/clock', '/imu', '/oil_temperature', '/ground/amplitude', '/ground/phase')


def allowed(text, kind, rule):
    """Return what a part of the page about security lets a node do."""
    section = re.search(rf'<{kind}s {rule}="ALLOW">(.*?)</{kind}s>', text, re.DOTALL)[1]
    return set(re.findall(rf'<{kind}>(.*?)</{kind}>', section))


@pytest.mark.parametrize('machines', [['fan'], ['fan_house/fan_1', 'fan_house/fan_2']])
def test_the_security_policy_is_exactly_for_what_the_node_has(bench: Bench, machines):
    gc.collect()  # a node of the same name is in the graph until its context is collected
    entry = machines[0].partition('/')[0]
    node = bench.active(entry, **({'fan_house__case': 'fan_house'} if len(machines) > 1 else {}))
    policy = re.search(r'<policy.*</policy>', SECURITY, re.DOTALL)[0]
    _, _, of_plant = SECURITY.partition('The plant adds:')

    def named(kind, rule):
        told = {re.sub(r'\bfan/', f'{machine}/', name)
                for name in allowed(policy, kind, rule) for machine in machines}
        if len(machines) > 1:
            told = {name for name in told if not name.endswith('/reload')}
            told |= allowed(of_plant, kind, rule)
        return {node.resolve_topic_name(name) for name in told
                if not any(name.endswith(rare) for rare in NOT_ALWAYS)}

    def own(names):
        return {name for name, _ in names(node.get_name(), '/')}

    for told, names in (
            (named('topic', 'publish'), node.get_publisher_names_and_types_by_node),
            (named('service', 'reply'), node.get_service_names_and_types_by_node),
            (named('topic', 'subscribe'), node.get_subscriber_names_and_types_by_node)):
        # The graph learns of the last of them a moment later.
        bench.graph.until(lambda told=told, names=names: told <= own(names), f'{told}')
        assert told == own(names)


def test_permissions_are_for_all_that_a_machine_hears_and_tells():
    [rules] = re.findall(r'<allow_rule>.*?</allow_rule>', SECURITY, re.DOTALL)
    patterns = {rule: re.findall(r'<topic>rt/(.*?)</topic>', re.search(
        rf'<{rule}>(.*?)</{rule}>', rules, re.DOTALL)[1]) for rule in ('subscribe', 'publish')}
    for rule, names in (('subscribe', [f'fan/{name}' for name in TOPICS]),
                        ('publish', [f'rotorsoil/fan/{name}'
                                     for name in OWN_TOPICS | GROUND_TOPICS])):
        assert [name for name in names if not any(
            fnmatch(name, pattern) for pattern in patterns[rule])] == []


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
