"""The recording shows what an engineer looks for, at the time at which it happened."""

from dataclasses import replace
import warnings

import numpy as np
import pytest

from rotorsoil_ros.compared import Compared
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import Band, Diagnostics, Expected, Level, Model, Remark, Zoned
from rotorsoil_ros.monitor.criteria import Criteria
from rotorsoil_ros.node.run_log import LogSettings, RunLog
from rotorsoil_ros.prediction import Prediction
from rotorsoil_ros.screen import open_viewer, recorder

from recordings import assert_whole, column, PERIOD, predicted, START


@pytest.fixture
def recorded(machine, tmp_path):
    """Return a recording of events, and where it lies."""
    pytest.importorskip('rerun', reason='rerun-sdk is optional')
    path = tmp_path / 'run.rrd'

    def record(*events, flush_each=False):
        with open_viewer(path, {'fan': machine}) as viewer:
            for event in events:
                viewer(event)
                if flush_each:
                    viewer.flush()
        return path
    return record


def test_a_channel_is_split_at_its_station_and_shown_in_micrometres(recorded, machine):
    event = predicted(machine, [200.0, 300.0], period=5 * PERIOD)
    stamps, values = column(
        recorded(event), '/fan/bearing_1/journal_z/amplitude/predicted', 'Scalars:scalars')
    shown = machine.table.channels.index('bearing_1_journal_z')
    assert stamps == event.stamp_ns.tolist()
    np.testing.assert_allclose(
        np.ravel(values), 1e6 * np.abs(event.prediction.displacement[:, shown]), rtol=1e-12)


def test_phase_is_shown_in_degrees_and_speed_in_rpm(recorded, machine):
    event = predicted(machine, [200.0])
    path = recorded(event)
    _, phase = column(path, '/fan/disc_1/x/phase/predicted', 'Scalars:scalars')
    _, speed = column(path, '/fan/speed', 'Scalars:scalars')
    shown = machine.table.channels.index('disc_1_x')
    assert phase == [[pytest.approx(np.degrees(np.angle(
        event.prediction.displacement[0, shown])))]]
    assert speed == [[pytest.approx(1909.859317)]]  # 200 * 60 / (2 pi)


def test_what_would_last_stands_beside_an_answer_that_does_not(recorded, machine):
    event = predicted(machine, [200.0, 200.0], period=5 * PERIOD)
    lasting = Prediction.of_parts(event.prediction.speed, event.prediction.parts.copy())
    shown = machine.table.channels.index('bearing_1_housing_z')
    lasting.parts[..., shown] *= 2.0
    path = recorded(replace(event, steady=lasting))
    entity = '/fan/bearing_1/housing_z'
    for quantity in ('amplitude', 'velocity'):
        _, told = column(path, f'{entity}/{quantity}/predicted', 'Scalars:scalars')
        _, still = column(path, f'{entity}/{quantity}/steady', 'Scalars:scalars')
        np.testing.assert_allclose(still, 2.0 * np.array(told), rtol=1e-12)
    _, names = column(path, f'{entity}/amplitude/steady', 'SeriesLines:names', static=True)
    assert names == [['bearing_1_housing_z steady']]
    # Where both are the same there is one line.
    assert column(path, '/fan/disc_1/x/amplitude/steady', 'Scalars:scalars')[1] == []


def test_trends_are_thinned_to_what_a_screen_shows_across_batches(recorded, machine):
    events = [predicted(machine, [300.0] * 50, start=START + 50 * k * 10**6, period=10**6)
              for k in range(6)]
    stamps, _ = column(recorded(*events, flush_each=True), '/fan/speed', 'Scalars:scalars')
    assert np.diff(stamps).tolist() == [20 * 10**6] * 14  # 300 ms at 50 per second


def compared(machine, channels, amplitude, phase, *, speed=300.0, start=START):
    """Return measured vectors (n, channels) of one speed, 100 ms apart."""
    amplitude, phase = np.atleast_2d(amplitude), np.atleast_2d(phase)
    unknown = np.full(amplitude.shape, np.nan)
    return Compared(
        'fan', start + 10 * PERIOD * np.arange(len(amplitude)), np.full(len(amplitude), speed),
        channels, amplitude, phase, unknown, unknown.astype(complex), *[unknown] * 4)


def test_measured_values_lie_beside_the_predicted_ones(recorded, machine):
    path = recorded(compared(machine, ('disc_1_x',), [[2e-6]], [[1.5 * np.pi]]))
    assert column(path, '/fan/disc_1/x/amplitude/measured', 'Scalars:scalars') == (
        [START], [[pytest.approx(2.0)]])
    assert column(path, '/fan/disc_1/x/phase/measured', 'Scalars:scalars') == (
        [START], [[pytest.approx(-90.0)]])
    _, names = column(path, '/fan/disc_1/x/amplitude/measured', 'SeriesPoints:names',
                      static=True)
    assert names == [['disc_1_x measured']]


def test_measured_amplitudes_without_phase_draw_no_phase(recorded, machine):
    path = recorded(compared(machine, ('disc_1_x',), [[2e-6]], [[np.nan]]))
    assert column(path, '/fan/disc_1/x/amplitude/measured', 'Scalars:scalars')[0] == [START]
    assert column(path, '/fan/disc_1/x/phase/measured', 'Scalars:scalars')[0] == []


def test_velocity_of_a_housing_is_its_speed_times_amplitude_as_rms(recorded, machine):
    event = predicted(machine, [200.0])
    path = recorded(event, compared(machine, ('bearing_1_housing_z',), [[1e-5]], [[0.0]],
                                    speed=200.0))
    shown = machine.table.channels.index('bearing_1_housing_z')
    velocity = 200.0 * np.abs(event.prediction.displacement[0, shown]) / np.sqrt(2.0)
    entity = '/fan/bearing_1/housing_z/velocity'
    assert column(path, f'{entity}/predicted', 'Scalars:scalars')[1] == [
        [pytest.approx(1e3 * velocity)]]
    assert column(path, f'{entity}/measured', 'Scalars:scalars')[1] == [
        [pytest.approx(np.sqrt(2.0))]]  # 2 mm/s zero-to-peak
    assert column(path, '/fan/disc_1/x/velocity/predicted', 'Scalars:scalars')[1] == []


def test_band_lies_around_the_prediction_under_its_name(recorded, machine):
    count = len(machine.table.channels)
    path = recorded(Band('fan', np.array([START]), np.array([200.0]),
                         np.full((1, count), 1e-6), np.full((1, count), 3e-6)),
                    predicted(machine, [200.0]))
    low, high, line = ('soil_low', 'soil_high', 'predicted')
    for side, value in ((low, 1.0), (high, 3.0)):
        assert column(path, f'/fan/disc_1/x/amplitude/{side}', 'Scalars:scalars') == (
            [START], [[pytest.approx(value)]])
    names = [column(path, f'/fan/disc_1/x/amplitude/{what}', 'SeriesLines:names', static=True)[1]
             for what in (low, high, line)]
    assert names == [[['disc_1_x']]] * 3


def judged():
    """Tell criteria: no band, supports with a lowest frequency along z only."""
    return Expected('fan', START, Criteria(None, (), (np.inf, 100.0)).to_arrays())


def zoned(predicted, measured):
    return Zoned('fan', START, predicted, measured)


def test_limits_of_zones_follow_the_class_of_the_support(recorded, machine):
    path = recorded(judged(), predicted(machine, [60.0]), zoned({'bearing_1_housing_x': 'A'}, {}),
                    predicted(machine, [200.0], start=START + 2 * 10**9))
    zones = machine.case.zones
    slow, fast = (1e3 * zones.of('rigid', speed)[0] for speed in (60.0, 200.0))
    flexible = 1e3 * zones.of('flexible', 200.0)[0]
    assert fast < flexible
    found = {axis: column(path, f'/fan/limits/{axis}/A_B', 'Scalars:scalars')[1]
             for axis in 'xz'}
    assert found['z'] == [[pytest.approx(slow)], [pytest.approx(flexible)]]
    assert found['x'] == [[pytest.approx(slow)], [pytest.approx(fast)]]


def test_a_lane_shows_when_a_zone_changed_and_that_nothing_is_measured(recorded, machine):
    path = recorded(
        predicted(machine, [300.0]), zoned({'bearing_1_housing_x': 'A'}, {}),
        zoned({'bearing_1_housing_x': 'A'}, {'bearing_1_housing_x': 'D'}),
        predicted(machine, [300.0], start=START + 10**9),
        zoned({'bearing_1_housing_x': 'B'}, {}))
    lane = '/fan/zones/{}/bearing_1_housing_x'
    assert column(path, lane.format('predicted'), 'StateChange:state') == (
        [START, START + 10**9], [['A'], ['B']])
    assert column(path, lane.format('measured'), 'StateChange:state') == (
        [START, START, START + 10**9], [['-'], ['D'], ['-']])
    _, words = column(path, lane.format('measured'), 'StateConfiguration:labels', static=True)
    assert words == [['A', 'B', 'C', 'D', 'not measured']]


def test_remarks_stand_in_the_list_of_events_at_their_data(recorded, machine):
    path = recorded(predicted(machine, [300.0]),
                    Remark('fan', 17, Level.ERROR, 'bearing_1_housing_x: zone D'))
    stamps, words = column(path, '/fan/events', 'TextLog:text')
    assert (stamps, words) == ([START], [['14:13:20  bearing_1_housing_x: zone D']])
    assert column(path, '/fan/events', 'TextLog:level')[1] == [['ERROR']]


def test_a_file_takes_seconds_at_a_time_and_a_viewer_does_not_wait(machine, tmp_path):
    pytest.importorskip('rerun', reason='rerun-sdk is optional')
    from rerun.chunk import RrdReader
    events = [predicted(machine, [300.0], start=START + second * 10**9) for second in range(12)]
    path = tmp_path / 'run.rrd'
    with open_viewer(path, {'fan': machine}) as viewer:
        for event in events:
            viewer.show([event])
    with warnings.catch_warnings():
        warnings.simplefilter('ignore')
        sent = [chunk for chunk in RrdReader(str(path)).stream()
                if chunk.entity_path == '/fan/speed' and not chunk.is_static]
    assert [chunk.to_record_batch().num_rows for chunk in sent] == [6, 6]


def test_the_picture_says_its_scale_and_draws_no_shaft_without_a_prediction(recorded, machine):
    path = recorded(predicted(machine, [300.0, 2000.0, 300.0], period=10 * PERIOD))
    _, words = column(path, '/fan/caption', 'TextDocument:text')
    assert 'Displacements x' in words[0][0]
    assert 'at 2865 rpm' in words[0][0]
    assert 'No prediction at' in words[1][0]
    _, shafts = column(path, '/fan/picture/shaft', 'LineStrips3D:strips')
    assert [len(strips) for strips in shafts] == [1, 0, 1]
    _, orbits = column(path, '/fan/picture/orbits', 'LineStrips3D:strips')
    assert [len(strips) for strips in orbits] == [4, 0, 4]


def test_the_block_moves_scaled_as_it_is_predicted_to(recorded, machine):
    event = predicted(machine, [300.0])
    path = recorded(event)
    _, moved = column(path, '/fan/picture/block/moving', 'Transform3D:translation')
    _, words = column(path, '/fan/caption', 'TextDocument:text')
    scale = float(words[0][0].split(' x ')[1].split('*')[0])
    first = machine.table.channels.index('block_x')
    turn = 2.0 * np.pi * (START % (4 * 10**9)) / (4 * 10**9)
    motion = np.real(event.prediction.displacement[0, first:first + 3] * np.exp(1j * turn))
    np.testing.assert_allclose(moved[0][0], scale * motion, rtol=1e-6)  # single precision


def test_nothing_that_moves_is_static_because_static_data_hides_it(recorded, machine):
    path = recorded(predicted(machine, [300.0]))
    for entity, component in (
            ('block/moving', 'Transform3D:translation'), ('shaft', 'LineStrips3D:strips'),
            ('orbits', 'LineStrips3D:strips'), ('discs', 'LineStrips3D:strips'),
            ('stations', 'Points3D:positions')):
        _, moving = column(path, f'/fan/picture/{entity}', component)
        _, still = column(path, f'/fan/picture/{entity}', component, static=True)
        assert (len(moving), len(still)) == (1, 0), entity


def test_events_stand_at_the_data_that_they_follow_and_only_changes_are_told(recorded, machine):
    def health(level, summary):
        return Diagnostics('fan', 10**9, level, summary, {})

    path = recorded(
        health(Level.STALE, 'before anything was shown'), predicted(machine, [300.0]),
        health(Level.OK, 'fine'), health(Level.OK, 'still fine'), health(Level.WARN, 'oh'),
        flush_each=True)
    stamps, words = column(path, '/fan/events', 'TextLog:text')
    assert words == [['14:13:20  fine'], ['14:13:20  oh']]
    assert stamps == [START, START]


def test_a_viewer_that_does_not_listen_is_told_and_costs_nothing(machine):
    told = []
    settings = LogSettings(
        directory='', name='run', mcap=False, rerun=False, split_mib=0.0, split_s=0.0,
        rerun_url='rerun+http://127.0.0.1:9/proxy')
    log = RunLog(settings, {'fan': machine}, tell=told.append, complain=told.append)
    log.show(predicted(machine, [300.0]))
    log.flush()
    log.close()
    assert told == ['nobody listens at rerun+http://127.0.0.1:9/proxy: the run is not shown live']


def test_without_rerun_the_reason_is_told(machine, tmp_path, monkeypatch):
    monkeypatch.setattr('rotorsoil_ros.screen.find_spec', lambda name: None)
    with pytest.raises(InputError, match='rerun-sdk is not installed'):
        open_viewer(tmp_path / 'run.rrd', {'fan': machine})


def test_a_new_recording_opens_with_the_models_that_it_rests_on(machine, tmp_path):
    pytest.importorskip('rerun', reason='rerun-sdk is optional')
    told = Model('fan', START, machine.description('fan', machine.case.unbalance))
    with open_viewer(tmp_path / 'a.rrd', {'fan': machine}) as sink:
        sink.show([told, predicted(machine, np.full(3, 300.0))])
        sink.begin(tmp_path / 'b.rrd')
        assert [event for event, _ in sink._views['fan']._moments] == [told]


def test_recording_of_a_run_is_whole_for_other_programs(machine, tmp_path):
    pytest.importorskip('rerun', reason='rerun-sdk is optional')
    with recorder(tmp_path / 'run.rrd', machine)('fan') as sink:
        sink.show([Model('fan', START, machine.description('fan', machine.case.unbalance)),
                   predicted(machine, np.full(3, 300.0))])
    assert_whole(tmp_path / 'run.rrd')
    assert not list(tmp_path.glob('.*'))
