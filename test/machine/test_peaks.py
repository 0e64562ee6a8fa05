"""Peaks of the tabulated response against those of a fine exact sweep."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.machine.peaks import channel_peaks, Peak, resolved_speeds, resonances
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.units import rpm_to_rad_s

PAPER = Path(__file__).parents[2] / 'config' / 'paper_rotor.yaml'


@pytest.fixture(scope='module')
def machine(tmp_path_factory):
    case = load(PAPER, ['speed_range_rpm=[2000, 9000]'])
    model = coupled_model(case, tmp_path_factory.mktemp('cache'))
    return model, ResponseTable.build(model, case.speed_range).predictor(case.unbalance)


def test_peak_is_the_maximum_of_the_exact_response(machine):
    model, predictor = machine
    peaks = channel_peaks(predictor, 'disc_2_z')
    main = max(peaks, key=lambda peak: peak.amplitude)
    near = main.speed * np.linspace(1.0 - 1e-3, 1.0 + 1e-3, 200_001)
    exact = np.abs(model.unbalance_response(near, np.array([1e-5, 0.0])).displacement[
        :, model.channels.index('disc_2_z')])
    assert main.speed == pytest.approx(near[exact.argmax()], rel=1e-6)  # of a width of 7e-4
    assert main.amplitude == pytest.approx(exact.max(), rel=1e-4)  # the table's promise


def test_both_forward_criticals_are_among_the_peaks_of_a_disc(machine):
    _, predictor = machine
    speeds = [peak.speed for peak in channel_peaks(predictor, 'disc_1_x')]
    for expected_rpm in (2929.5, 7742.0):
        # damping 0.007 moves the peak of one direction by a tenth of its width
        assert min(abs(speed / rpm_to_rad_s(expected_rpm) - 1.0) for speed in speeds) < 1e-3


def test_resolved_speeds_rise_and_are_all_answered(machine):
    _, predictor = machine
    speeds = resolved_speeds(predictor)
    assert np.all(np.diff(speeds) > 0.0)
    assert np.all(predictor.covers(speeds))
    assert (speeds[0], speeds[-1]) == predictor.table.speed_range


def test_resonances_list_each_once_with_the_channel_that_moves_most(machine):
    _, predictor = machine
    channels = ('disc_1_x', 'disc_1_z', 'disc_2_x', 'disc_2_z')
    found = resonances(predictor, channels)
    speeds = np.array([peak.speed for peak in found])
    assert np.all(np.diff(speeds) / speeds[:-1] > 0.05)
    largest = max((peak for channel in channels for peak in channel_peaks(predictor, channel)),
                  key=lambda peak: peak.amplitude)
    assert largest in found


class Curves:
    """Channels that move as they are told, at whatever speed."""

    channels = ('a', 'b')

    def __init__(self, *sizes):
        self.sizes = sizes

    def predict(self, speed):
        return SimpleNamespace(displacement=np.tile(self.sizes, (len(speed), 1)))


@pytest.mark.parametrize('sizes, kept', [
    ((0.0, 0.0), [Peak(1.0, 'a', 1.0), Peak(2.0, 'b', 2e-3)]),  # a thousandth of the largest
    ((1.9e-2, 0.0), [Peak(1.0, 'a', 1.0), Peak(2.0, 'b', 2e-3)]),
    ((2.1e-2, 0.0), [Peak(1.0, 'a', 1.0)])])  # a tenth of what moves beside it
def test_resonances_leave_out_what_is_small(monkeypatch, sizes, kept):
    given = {'a': [Peak(1.0, 'a', 1.0)], 'b': [Peak(2.0, 'b', 2e-3), Peak(3.0, 'b', 5e-4)]}
    monkeypatch.setattr('rotorsoil_ros.machine.peaks.channel_peaks',
                        lambda _, channel: given[channel])
    assert resonances(Curves(*sizes), ('a', 'b')) == kept
