"""Fast runs tell the damping that a machine has, and the measured run-up its two modes."""

import csv
from pathlib import Path

import numpy as np
import pytest

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.machine.transient.poles import Poles
from rotorsoil_ros.machine.transient.state import Transient
from rotorsoil_ros.monitor.comparison import Run
from rotorsoil_ros.monitor.identification.case import identify_vectors, Wanted
from rotorsoil_ros.monitor.identification.passing import Passing
from rotorsoil_ros.monitor.identification.used import UsedVectors
from rotorsoil_ros.profile import Profile
from rotorsoil_ros.units import rpm_to_rad_s

KIT = Path('config/rk4_rotor_kit.yaml')
MEASURED = Path('test/reference/measured/rk4_runup_1x.csv')
SECOND = 10**9


def run_of(stamp_ns, speed):
    return Run('kit', stamp_ns, speed, [], [])


def test_envelopes_of_a_whole_run_are_those_of_every_speed():
    poles = Poles(np.array([-1.0 + 100j, -40.0 + 150j]), np.array([0.02, 0.0]),
                  np.ones((2, 1, 1), dtype=complex))
    stamps = np.arange(600) * (SECOND // 50)
    stamps[300:] += 11 * SECOND  # nobody knows what happened in between
    speed = 80.0 + 0.2 * np.abs(np.arange(600) - 400.0)
    rows = np.array([20, 150, 301, 450, 599])
    found = Passing.of(run_of(stamps, speed), stamps[rows], speed[rows], poles)
    known = Transient(poles).follow(stamps, speed)
    away = found._deviations(poles.decay, poles.slope, speed[rows])
    for row, own in zip(rows, away, strict=True):
        told = known.away[known.rows == row].sum(axis=0)  # nothing where nothing rings
        np.testing.assert_allclose(own, told, rtol=1e-9, atol=1e-12)


def test_a_slow_run_costs_nothing():
    poles = Poles(np.array([-10.0 + 100j]), np.zeros(1), np.ones((1, 1, 1), dtype=complex))
    stamps = np.arange(100) * SECOND
    assert Passing.of(run_of(stamps, 80.0 + 0.01 * np.arange(100)), stamps[10:],
                      80.0 + 0.01 * np.arange(10, 100), poles) is None
    assert Passing.of(run_of(stamps, 80.0 + np.arange(100.0)), stamps[10:],
                      80.0 + np.arange(10.0, 100.0), Poles.none('asked so')) is None


def test_damping_of_a_fast_run_is_not_taken_for_more_than_it_is(tmp_path):
    # The kit on bearings a fourteenth as stiff, run up at its 24 rad/s^2; two percent of noise.
    case = Machine.load(KIT, cache_directory=tmp_path, overrides=[
        'rotor.bearings.0.stiffness={xx: 7e4, zz: 7e4}',
        'rotor.bearings.1.stiffness={xx: 7e4, zz: 7e4}',
        'rotor.bearings.0.damping={xx: 30.0, zz: 30.0}',
        'rotor.bearings.1.damping={xx: 30.0, zz: 30.0}'])
    stamps = np.arange(180) * (SECOND // 25)
    speed = 110.0 + 24.0 * stamps / SECOND
    channels = tuple(channel for channel in case.table.channels
                     if channel.station == 'probe_1')
    exact = case.predict(Profile('kit', stamps, speed))[channels].displacement
    random = np.random.default_rng(5)
    noise = 0.02 * np.abs(exact).max() * np.sqrt(0.5)
    measured = exact + noise * (random.normal(size=exact.shape)
                                + 1j * random.normal(size=exact.shape))
    passing = Passing.of(run_of(stamps, speed), stamps, speed, case.table.poles)
    wanted = Wanted(scalars=['rotor.bearings.*.stiffness', 'rotor.bearings.*.damping'],
                    planes=['disc_1'])

    def damping(passing):
        vectors = UsedVectors(channels, np.linspace(0.0, 1.0, 180), speed, measured,
                              np.zeros(180, dtype=int), passing)
        return identify_vectors(case.case, case.model, vectors, wanted).factor

    followed, steady = damping(passing), damping(None)
    np.testing.assert_allclose(followed, 1.0, atol=0.03)
    assert steady[1] > 1.3  # what a steady model makes of the same run


def test_the_measured_rotor_kit_is_two_modes_that_beat():
    # Two free modes and a runout; one step of time per revolution, no rate. Vectors as measured.
    with MEASURED.open() as stream:
        rows = list(csv.DictReader(line for line in stream if not line.startswith('#')))
    rpm, amplitude, phase = (np.array([float(row[name]) for row in rows]) for name in (
        'rpm', 'amp_1x_um', 'phase_1x_deg'))
    few = rpm < 2300.0
    speed, vectors = rpm_to_rad_s(rpm[few]), (amplitude * np.exp(1j * np.deg2rad(phase)))[few]
    stamps = np.rint(np.cumsum(60.0 / rpm[few]) * SECOND).astype(np.int64)

    def explained(*modes, is_steady=False):
        """Return which share of the vectors modes explain, given as rpm and damping ratio."""
        decay = np.array([(-zeta + 1j) * rpm_to_rad_s(at) for at, zeta in modes])
        poles = Poles(decay, np.zeros(len(decay)), np.zeros((len(decay), 1, 1), dtype=complex))
        shape = speed[:, None]**2 / (1j * speed[:, None] - decay)
        if not is_steady:
            passing = Passing.of(run_of(stamps, speed), stamps, speed, poles)
            shape = shape - decay**2 * passing._deviations(decay, poles.slope, speed)
        system = np.concatenate([shape, np.ones((len(speed), 1))], axis=1)
        best, *_ = np.linalg.lstsq(system, vectors, rcond=None)
        left = np.sum(np.abs(vectors - system @ best)**2)
        return 1.0 - left / np.sum(np.abs(vectors - vectors.mean())**2)

    # The best that a search over both modes found, of each kind.
    assert explained((1575.5, 0.0123), (1660.5, 0.0277)) > 0.98
    assert explained((1647.3, 0.0274), (1698.5, 0.0105), is_steady=True) == pytest.approx(
        0.953, abs=0.001)
