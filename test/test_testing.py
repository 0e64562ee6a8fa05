"""The fixtures that we give to others: a node in a graph of its own, a profile, a case."""

import numpy as np
import pytest
from rclpy.node import Node
from std_msgs.msg import Int32

import rotorsoil_ros as rs
from rotorsoil_ros.bags.profile import read_profile
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.machine import load as load_machine
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.testing import graph as graphs_of_tests
from rotorsoil_ros.testing.twin import FIRST_NS, STEP_NS
from rotorsoil_ros.units import rad_s_to_rpm, rpm_to_rad_s


def test_a_speed_that_is_sent_is_answered_with_what_the_table_says(rotorsoil_twin, machine):
    twin = rotorsoil_twin('paper_rotor', machine='fan')
    twin.speed.send(rpm=[1000.0, 2000.0])
    # The second speed comes so soon that the machine still does something else: told is that.
    exact = machine.predict(rs.Profile(
        'fan', FIRST_NS + STEP_NS * np.array([1, 2]), rpm_to_rad_s(np.array([1000.0, 2000.0]))))
    for number in range(2):
        answer, turned = twin.amplitude.receive(), twin.phase.receive()
        assert answer.stamp_ns == turned.stamp_ns == FIRST_NS + (number + 1) * STEP_NS
        assert answer.channels == list(machine.table.channels)
        for at, channel in enumerate(answer.channels):
            vector = exact.displacement[number, at]
            assert answer[channel] == pytest.approx(abs(vector), rel=1e-14)
            assert answer.displacement_um_pp(channel) == pytest.approx(2e6 * abs(vector))
            assert turned[channel] == pytest.approx(np.angle(vector), abs=1e-12)
        housing = twin.velocity_rms.receive()
        assert housing.velocity('bearing_1_housing_x') * 1e3 == pytest.approx(
            answer.velocity_mm_s_rms('bearing_1_housing_x'), rel=1e-14)
    with pytest.raises(AssertionError, match='disc_9_x is not answered; there are bearing_1_'):
        answer['disc_9_x']


def test_a_profile_is_replayed_and_every_speed_answered(rotorsoil_twin, rotorsoil_profile):
    profile = rotorsoil_profile('paper_rotor', rpm=range(600, 1600, 50), every_s=0.1)
    assert read_profile(profile).speed_rpm.tolist() == pytest.approx(list(range(600, 1600, 50)))
    twin = rotorsoil_twin()
    assert twin.replay(profile) == 20
    answers = twin.amplitude.wait_for(20)
    assert [answer.stamp_ns for answer in answers] == read_profile(profile).stamp_ns.tolist()
    with pytest.raises(InputError, match=r'nowhere\.mcap: no such file'):
        twin.replay('nowhere.mcap')


def test_a_case_is_changed_for_one_test_only(rotorsoil_case, rotorsoil_twin, case_file):
    path = rotorsoil_case('paper_rotor', 'foundations.0.mass=420.0')
    assert load(path).foundations[0].mass == 420.0
    heavy, plain = rotorsoil_twin(path, machine='heavy'), rotorsoil_twin()
    moved = []
    for twin, file in ((heavy, path), (plain, case_file)):
        twin.speed.send(rad_s=300.0)
        moved.append(twin.amplitude.receive()['block_x'])
        response = load_machine(file).response(rpm=rad_s_to_rpm(300.0))
        assert moved[-1] == pytest.approx(response['block_x'].amplitude.item(), rel=1e-9)
    assert moved[0] != moved[1]
    assert heavy.node.get_name() != plain.node.get_name()
    with pytest.raises(InputError, match='mass'):
        rotorsoil_case('paper_rotor', 'foundations.0.mass=-1')


def test_parameters_are_named_without_the_machine(rotorsoil_twin):
    twin = rotorsoil_twin(parameters={'speed.topic': '/plc/rpm', 'speed.unit': 'rpm',
                                      'speed.type': 'std_msgs/msg/Int32'})
    twin.publisher('/plc/rpm', Int32).publish(Int32(data=2000))
    assert twin.amplitude.receive()['disc_1_x'] > 0.0


def test_machines_of_a_plant_are_asked_by_their_names(rotorsoil_twin):
    twin = rotorsoil_twin('fan_house', parameters={'fan_2.speed.unit': 'rpm'})
    total = twin.hear('total')
    twin['fan_1'].speed.send(rad_s=150.0)
    own = twin['fan_1'].amplitude.receive()
    np.testing.assert_allclose(
        total.receive().message.position, own.message.position, rtol=1e-12)
    twin['fan_2'].speed.send(rad_s=1400.0)  # which it takes for rpm
    assert twin['fan_2'].velocity_rms.receive().velocity('fan_2_fan_end_housing_x') > 0.0
    with pytest.raises(RotorSoilError, match=r"is a plant: .* twin\['fan_1'\]"):
        twin.speed.send(rpm=1480)


def test_a_node_of_the_package_under_test_takes_part(rotorsoil_twin):
    twin = rotorsoil_twin()
    other = twin.add(Node('mine', context=twin.context))
    twin.until(lambda: 'rotorsoil' in other.get_node_names(), 'discovery')


def test_what_does_not_come_says_what_the_node_says(rotorsoil_twin, monkeypatch):
    twin = rotorsoil_twin()
    twin.until(lambda: twin.says != 'nothing yet', 'diagnostics')
    monkeypatch.setattr(graphs_of_tests, 'DEADLINE_S', 0.0)
    with pytest.raises(AssertionError, match='the node says: waiting for the first speed'):
        twin.amplitude.receive()


def test_a_node_that_does_not_start_is_an_error(rotorsoil_twin, tmp_path):
    with pytest.raises(RotorSoilError, match='the node did not start'):
        rotorsoil_twin(tmp_path / 'nowhere.yaml')


pytest_plugins = ['pytester']


def test_an_installed_plugin_needs_no_word(pytester):
    pytester.makepyfile("""
        def test_twin(rotorsoil_twin):
            twin = rotorsoil_twin('paper_rotor')
            twin.speed.send(rpm=2000)
            assert twin.amplitude.receive()['disc_1_x'] > 0.0
    """)
    done = pytester.runpytest_subprocess('-p', 'rotorsoil_ros.testing.plugin', '-q')
    done.assert_outcomes(passed=1)
