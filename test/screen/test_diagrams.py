"""Bode diagrams, orbits and waterfalls of the recording show what was put in."""

from types import SimpleNamespace

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.compared import Compared
from rotorsoil_ros.events import Model, Predicted, Samples

rr = pytest.importorskip('rerun', reason='rerun-sdk is optional')

from rotorsoil_ros.screen.blueprint import blueprint, Shown  # noqa: E402
from rotorsoil_ros.screen.bode import Bode  # noqa: E402
from rotorsoil_ros.screen.channels import trends  # noqa: E402
from rotorsoil_ros.screen.orbits import Orbits  # noqa: E402
from rotorsoil_ros.screen.scene import Scene  # noqa: E402
from rotorsoil_ros.screen.viewer import MachineView  # noqa: E402
from rotorsoil_ros.screen.waterfall import (  # noqa: E402
    COLUMNS,
    LOUDEST,
    PART_ROWS,
    PARTS,
    QUIETEST,
    ROWS,
    spectrum,
    Waterfall,
)

from recordings import Paper  # noqa: E402

START = 1_790_000_000_000_000_000
SECOND = 10**9
UNKNOWN = np.full((1, 1), np.nan)


@pytest.fixture
def paper():
    return Paper()


def shown(machine):
    channels = machine.table.channels
    return Shown('fan', machine.case, trends('fan', machine.case, channels),
                 Scene(machine.case, channels))


def measured(channel, amplitude, phase, *, speed=300.0, stamp_ns=START):
    return Compared(
        'fan', np.array([stamp_ns]), np.array([speed]), (channel,), np.array([[amplitude]]),
        np.array([[phase]]), UNKNOWN, UNKNOWN.astype(complex), *[UNKNOWN] * 4)


@pytest.fixture
def bode(paper, machine):
    predictor = machine.table.predictor(machine.case.unbalance)
    return Bode(paper, 'bode', shown(machine).trends, predictor)


def distance(paper, channel, point):
    """Return how far a point lies from the predicted line."""
    lines = paper.drawn[f'bode/{channel}/predicted', 'LineStrips2D:strips']
    corners = np.array([corner for line in lines for corner in line])
    return float(np.linalg.norm(corners - point, axis=1).min())


def test_a_measured_point_that_is_predicted_lies_on_the_line(paper, machine, bode):
    number = machine.table.channels.index('disc_1_x')
    vector = machine.table.predictor(machine.case.unbalance).predict(
        np.array([300.0])).displacement[0, number]
    bode.compare(measured('disc_1_x', abs(vector), np.angle(vector) + 2.0 * np.pi))
    points = np.array(paper.drawn['bode/disc_1_x/measured', 'Points2D:positions'][0])
    assert len(points) == 2  # amplitude and phase
    for point in points:
        assert distance(paper, 'disc_1_x', point) < 1.0  # of 230; the line is drawn in steps
    bode.compare(measured('disc_1_x', 2.0 * abs(vector), np.nan, stamp_ns=START + 3 * SECOND))
    points = np.array(paper.drawn['bode/disc_1_x/measured', 'Points2D:positions'][0])
    assert len(points) == 3  # of the second one no phase is known
    # A factor of two on 60 units for four decades.
    assert points[0, 1] - points[1, 1] == pytest.approx(15.0 * np.log10(2.0), rel=1e-5)


def test_a_phase_ahead_lies_above_one_behind(paper, bode):
    heights = []
    for second, phase in enumerate((0.5 * np.pi, -0.5 * np.pi)):
        bode.compare(measured('disc_1_x', 1e-6 * 10.0**second, phase,
                              stamp_ns=START + 10 * second * SECOND))
        heights.append(paper.drawn['bode/disc_1_x/measured', 'Points2D:positions'][0][-1][1])
    assert heights[1] - heights[0] == pytest.approx(15.0)  # half of its axis, downward


def test_at_a_steady_state_no_points_are_piled_up(paper, bode):
    for second in range(5):
        bode.compare(measured('disc_1_x', 1e-6, 0.0, stamp_ns=START + 10 * second * SECOND))
    assert paper.stamps['bode/disc_1_x/measured'] == [START]


def test_the_line_of_the_moment_is_gone_where_there_is_no_speed(paper, bode):
    bode.now(np.array([START, START + SECOND]), np.array([300.0, np.nan]))
    assert [len(lines) for lines in paper.drawn['bode/now', 'strips']] == [1, 0]


def test_another_unbalance_moves_the_curve_and_another_case_removes_it(paper, machine):
    view = MachineView(paper, shown(machine), machine)
    entity = '/fan/bode/disc_1_x/predicted', 'LineStrips2D:strips'
    before = paper.drawn[entity]
    description = machine.description('fan', 0.1 * machine.case.unbalance)
    view.take(Model('fan', START, description))
    view.flush()
    heights = [np.concatenate(lines)[:, 1] for lines in (before, paper.drawn[entity])]
    inside = heights[0] < 44.0  # below, the lower curve is at the end of its axis
    assert inside.any()
    decade = (heights[1] - heights[0])[inside]
    np.testing.assert_allclose(decade, 15.0, atol=0.01)  # downward
    after = paper.drawn[entity]
    view.take(Model('fan', START, {**description, 'tables': {'response': 'another'}}))
    view.flush()
    assert paper.drawn[entity] == []
    view.take(Model('fan', START, description))
    view.flush()
    assert paper.drawn[entity] == after


@pytest.fixture
def orbits(paper, machine):
    return Orbits(paper, 'orbits', machine.case, machine.table.channels)


def vectors(machine, speed=300.0):
    return machine.table.predictor(machine.case.unbalance).predict(
        np.array([speed])).displacement


def test_a_measured_orbit_that_is_predicted_covers_the_predicted_one(paper, machine, orbits):
    displacement = vectors(machine)
    orbits.predicted(np.array([START]), displacement)
    drawn = dict(zip(paper.drawn['orbits/names', 'Points2D:labels'],
                     paper.drawn['orbits/predicted', 'strips'][0], strict=True))
    x, z = (displacement[0, machine.table.channels.index(f'bearing_2_housing_{axis}')]
            for axis in 'xz')
    orbits.compare([
        measured('bearing_2_housing_x', abs(x), np.angle(x)),
        measured('bearing_2_housing_z', abs(z), np.angle(z), stamp_ns=START + SECOND // 10)])
    [[found]] = paper.drawn['orbits/measured/bearing_2_housing', 'strips']
    np.testing.assert_allclose(found, drawn['bearing_2_housing'], atol=1e-9)
    [mark] = paper.drawn['orbits/measured/bearing_2_housing/mark', 'Points2D:positions']
    np.testing.assert_allclose(mark[0], found[0], rtol=1e-6)  # single precision


def test_the_written_scale_is_the_radius_of_the_circle(paper, machine, orbits):
    displacement = vectors(machine)
    orbits.predicted(np.array([START]), displacement)
    number = machine.table.channels.index('disc_1_x')
    names = paper.drawn['orbits/names', 'Points2D:labels']
    row = names.index('disc_1')
    words = paper.drawn['orbits/scales', 'Points2D:labels'][0][row]
    radius = float(words.removeprefix('circle: ').removesuffix(' um'))
    line = np.array(paper.drawn['orbits/predicted', 'strips'][0][row])
    half_width = 0.5 * np.ptp(line[:, 0])
    assert half_width * radius == pytest.approx(1e6 * abs(displacement[0, number]), rel=5e-3)
    assert 0.3 <= 0.5 * max(np.ptp(line, axis=0)) <= 0.95


def test_a_circle_holds_what_is_measured_as_well(paper, machine, orbits):
    large = [measured('disc_1_x', 1e-3, 0.0), measured('disc_1_z', 1e-3, 1.5)]
    orbits.expect(large)
    orbits.predicted(np.array([START]), vectors(machine))
    orbits.compare(large)
    [[found]] = paper.drawn['orbits/measured/disc_1', 'strips']
    row = paper.drawn['orbits/names', 'Points2D:labels'].index('disc_1')
    assert paper.drawn['orbits/scales', 'Points2D:labels'][0][row] == 'circle: 2000 um'
    assert np.ptp(found[:, 0]) == pytest.approx(2.0 * 0.5, rel=5e-3)  # 1 mm of 2 mm


def test_what_comes_with_a_measurement_is_drawn_at_its_scale(paper, machine):
    view = MachineView(paper, shown(machine), machine)
    prediction = machine.table.predictor(machine.case.unbalance).predict(np.array([300.0]))
    view.take(Predicted('fan', np.array([START]), prediction))
    view.take(measured('disc_1_x', 1e-3, 0.0))
    view.flush()
    row = paper.drawn['/fan/orbits/names', 'Points2D:labels'].index('disc_1')
    assert paper.drawn['/fan/orbits/scales', 'Points2D:labels'][0][row] == 'circle: 2000 um'


def test_without_phases_a_box_says_how_far_it_moves(paper, machine, orbits):
    orbits.predicted(np.array([START]), vectors(machine))
    orbits.compare([measured('disc_1_x', 1e-6, np.nan), measured('disc_1_z', 1e-6, np.nan)])
    [[box]] = paper.drawn['orbits/measured/disc_1', 'strips']
    assert len(box) == 5
    assert np.ptp(box[:, 0]) == pytest.approx(np.ptp(box[:, 1]))
    assert paper.drawn['orbits/measured/disc_1/mark', 'Points2D:positions'] == [[]]


def test_an_orbit_is_seen_along_the_shaft_with_z_upward(paper, machine, orbits):
    orbits.predicted(np.array([START]), vectors(machine))
    row = paper.drawn['orbits/names', 'Points2D:labels'].index('disc_1')
    centre = np.mean(paper.drawn['orbits/predicted', 'strips'][0][row][:-1], axis=0)
    # At the angle zero it is to the right and above; up is where y of the plane is less.
    orbits.compare([measured('disc_1_x', 1e-6, 0.0), measured('disc_1_z', 1e-6, 0.0)])
    [mark] = paper.drawn['orbits/measured/disc_1/mark', 'Points2D:positions']
    assert mark[0][0] > centre[0]
    assert mark[0][1] < centre[1]


def test_directions_measured_at_other_times_make_no_orbit(paper, machine, orbits):
    orbits.predicted(np.array([START]), vectors(machine))
    orbits.compare([measured('disc_1_x', 1e-6, 0.0),
                    measured('disc_1_z', 1e-6, 0.0, stamp_ns=START + SECOND)])
    assert ('orbits/measured/disc_1', 'strips') not in paper.drawn


def tone(hertz, velocity_mm_s, *, rate=1000.0, seconds=2.0, gap=False):
    """Return stamps and acceleration of one frequency and velocity (rms)."""
    time = np.arange(0.0, seconds + 0.5 / rate, 1.0 / rate)
    if gap:
        time = np.delete(time, slice(400, 420))
    omega = 2.0 * np.pi * hertz
    acceleration = 9.81 + 1e-3 * velocity_mm_s * np.sqrt(2.0) * omega * np.sin(omega * time)
    return START + np.rint(1e9 * time).astype(np.int64), acceleration


@pytest.mark.parametrize('gap', [False, True])
def test_the_spectrum_of_a_tone_has_its_velocity(gap):
    frequency, velocity = spectrum(*tone(25.0, 1.5, gap=gap))
    peak = int(velocity[frequency > 2.0].argmax()) + int(np.sum(frequency <= 2.0))
    assert frequency[peak] == pytest.approx(25.0, abs=0.5)
    assert velocity[peak] == pytest.approx(1.5, rel=0.03)  # a hole of 1 % of the samples


def seen(paper):
    """Return what a waterfall shows: rows of its picture and points of its line, from the top."""
    [[[_, moved, _]]] = paper.drawn['water/picture', 'Transform3D:translation']
    rows, points = {}, set()
    for part in range(PARTS):
        own = f'water/picture/{part}'
        if (own, 'DepthImage:buffer') not in paper.drawn:
            continue
        [[[_, place, _]]] = paper.drawn[own, 'Transform3D:translation']
        [picture] = paper.drawn[own, 'DepthImage:buffer']
        for row, shades in enumerate(np.array(picture, dtype=np.uint8).reshape(-1, COLUMNS)):
            rows[moved + place + row] = shades
        points |= {(float(x), moved + place + float(y))
                   for line in paper.drawn[f'{own}/speed', 'strips'][0] for x, y in line}
    return rows, points


def test_a_waterfall_shows_the_newest_spectrum_on_top(paper):
    waterfall = Waterfall(paper, 'water', 'fan/measured/a/imu', top_hz=200.0)
    [words] = paper.drawn['water/labels', 'Points2D:labels']
    assert words == 'no raw acceleration has come on fan/measured/a/imu'
    tones = [20.0 + 2.0 * number for number in range(ROWS + 5)]
    for number, hertz in enumerate(tones):
        stamps, acceleration = tone(hertz, LOUDEST)
        waterfall.take(Samples('fan', 'a', stamps + 3 * SECOND * number, acceleration),
                       2.0 * np.pi * hertz)
        [picture] = paper.drawn[f'water/picture/{number // PART_ROWS % PARTS}',
                                'DepthImage:buffer']
        assert len(picture) <= PART_ROWS * COLUMNS  # what is new, and little else
    rows, points = seen(paper)
    assert sorted(rows) == list(range(ROWS - 3))  # the oldest part has begun anew
    for row, shades in rows.items():
        place = tones[-1 - int(row)] / 200.0 * COLUMNS
        assert shades.argmax() == pytest.approx(place, abs=1)
        assert shades.max() >= 253  # LOUDEST is 255
        assert any(abs(x - place) < 1e-3 and y == row + 0.5 for x, y in points)
    assert 'no raw' not in ' '.join(paper.drawn['water/labels', 'Points2D:labels'])
    assert 0.0 < QUIETEST < LOUDEST


def test_time_that_jumps_back_begins_a_new_spectrum(paper):
    waterfall = Waterfall(paper, 'water', 'a', top_hz=200.0)
    stamps, acceleration = tone(25.0, 1.0)
    late = Samples('fan', 'a', stamps[:1500] + 9 * SECOND, acceleration[:1500])
    waterfall.take(late, 157.0)
    waterfall.take(Samples('fan', 'a', stamps[:1500], acceleration[:1500]), 157.0)
    assert 'water/picture' not in paper.stamps


def test_few_samples_have_no_spectrum():
    stamps, acceleration = tone(25.0, 1.0)
    assert len(spectrum(stamps[:50], acceleration[:50])[0]) == 0


def views(container):
    for part in container.contents:
        if hasattr(part, 'contents') and not isinstance(part, rr.blueprint.View):
            yield from views(part)
        else:
            yield part


def names_of(case_file, tmp_path):
    case = load(case_file)
    channels = coupled_model(case, tmp_path).channels
    found = Shown('it', case, trends('it', case, channels), Scene(case, channels))
    return {str(view.name) for view in views(blueprint({'it': found}).root_container)}


def test_a_machine_on_a_rigid_base_has_no_views_of_housings(tmp_path, case_file):
    config = case_file.parent
    on_soil = names_of(config / 'plant_fan.yaml', tmp_path)
    rigid = names_of(config / 'rk4_rotor_kit.yaml', tmp_path)
    assert any(name.startswith('Zones measured') for name in on_soil)
    assert any('velocity [mm/s rms]' in name for name in on_soil)
    assert {'Speed [rpm]', 'Events', 'Probes, phase [deg]'} <= rigid
    assert not [name for name in rigid
                if 'Zones' in name or 'velocity' in name or 'ousing' in name]


def test_only_stations_that_can_move_have_an_orbit(machine):
    from rotorsoil_ros.screen.orbits import cells
    found = [cell.station for cell in cells(machine.case, machine.table.channels)]
    assert found == ['bearing_1_journal', 'disc_1', 'bearing_2_journal', 'disc_2',
                     'bearing_1_housing', 'bearing_2_housing']
    on_ground = SimpleNamespace(rotor=machine.case.rotor, foundations=())
    assert not [cell for cell in cells(on_ground, machine.table.channels)
                if 'housing' in cell.station]
