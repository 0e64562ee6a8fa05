"""The verb `compare` as an engineer meets it, on measured and on synthetic runs."""

from base64 import b64decode
from contextlib import redirect_stdout
import csv
from html.parser import HTMLParser
import io
import json
from pathlib import Path
import re

import numpy as np
import pytest

from rotorsoil_ros.bags.comparison import compare
from rotorsoil_ros.bags.synthetic import on_ground, Truth, write_synthetic
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.figures.comparison import all_figures
from rotorsoil_ros.monitor.identification.case import identify_case, Wanted
from rotorsoil_ros.monitor.verdict import Verdict
from rotorsoil_ros.units import rpm_to_rad_s
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records

from house import sheets
from records import import_run_up

ROOT = Path(__file__).parents[1]
KIT = str(ROOT / 'config' / 'rk4_rotor_kit.yaml')
FAN = str(ROOT / 'config' / 'plant_fan.yaml')
START_NS = 1_700_000_000_000_000_000
SECOND = 1_000_000_000
HOUSINGS = tuple(f'{end}_housing_{axis}' for end in ('drive_end', 'fan_end') for axis in 'xz')


@pytest.fixture(scope='module')
def kit_log(tmp_path_factory):
    """Return the measured run-up of the rotor kit as a profile with vectors."""
    path = tmp_path_factory.mktemp('kit') / 'run_up.mcap'
    import_run_up(path, start_ns=START_NS)
    return str(path)


def fan_model():
    case = load(Path(FAN))
    return case, coupled_model(case, Path('no cache is needed for cones'))


def write_vectors(path, *, factor=1.0, unbalance=None, noise=0.0, phase=True, seed=0, gain=1.0,
                  seconds=2, offset=0.0, model=None):
    """Write a slow coast-down of the fan as 1X vectors, on ground of another stiffness."""
    case, cones = fan_model()
    model = cones if model is None else model
    speed = rpm_to_rad_s(np.linspace(1750.0, 300.0, 80))
    unbalance = case.unbalance if unbalance is None else np.array(unbalance)
    rows = [model.channels.index(name) for name in HOUSINGS]
    vector = gain * on_ground(model, factor).unbalance_response(
        speed, unbalance).displacement[:, rows] + offset
    random = np.random.default_rng(seed)
    spread = noise / np.sqrt(2.0) * np.sqrt(np.mean(np.abs(vector) ** 2, axis=0))
    vector = vector + spread * (random.normal(size=vector.shape)
                                + 1j * random.normal(size=vector.shape))
    stamps = [START_NS + seconds * SECOND * index for index in range(len(speed))]

    def messages(topic, names, array, values):
        numbers = np.full((len(stamps), 3, len(names)), np.nan)
        numbers[:, array] = values
        return Records(f'/plant_fan/{topic}', JOINT_STATE, stamps,
                       JointStateWriter(names).write(stamps, numbers))

    with LogFile(path) as log:
        log.write(messages('joint_states', ['rotor'], 1, speed[:, None]))
        log.write(messages('measured/amplitude', list(HOUSINGS), 0, np.abs(vector)))
        if phase:
            log.write(messages('measured/phase', list(HOUSINGS), 0, np.angle(vector)))
    return str(path)


def summary(directory):
    return json.loads((directory / 'comparison.json').read_text())


def judged(log, case=FAN):
    """Return the comparison of a log with a case, without files and pictures."""
    return compare(Path(log), Path(case), cache_directory=Path(log).parent / 'cache')


@pytest.fixture(scope='module')
def healthy(tmp_path_factory):
    """Return directory, standard output and status for a machine that behaves."""
    directory = tmp_path_factory.mktemp('healthy')
    log = write_vectors(directory / 'log.mcap', noise=0.02)
    said = io.StringIO()
    with redirect_stdout(said):
        status = main(['compare', log, FAN, '-o', str(directory / 'out')])
    return directory / 'out', said.getvalue(), status


def test_machine_that_behaves_passes(healthy):
    out, said, status = healthy
    assert status == 0
    assert said.endswith('verdict   passes\n')
    found = summary(out)
    assert found['verdict'] == 'passes'
    for name in HOUSINGS:
        channel = found['channels'][name]
        assert (channel['points'], channel['used']) == (80, 80)
        assert channel['share_inside_band'] > 0.95
        assert channel['r_squared'] > 0.99
        assert abs(channel['phase_bias_rad']) < 0.04  # noise of 2 % of the peak, where slow
    assert found['peaks']
    assert all(abs(peak['deviation']) < 0.05 for peak in found['peaks'])
    assert [round(mode['speed_rad_s'] * 30.0 / np.pi) for mode in found['critical_speeds']] == [
        1253, 1389, 1467]  # test_modes and `check`


def test_what_is_printed_is_peak_to_peak_and_lag(healthy):
    out, said, _ = healthy
    header, *rows = (re.split(' {2,}', line) for line in said.split('\n\n')[0].splitlines())
    found = summary(out)['channels']
    for row in rows:
        told = dict(zip(header, row, strict=True))
        own = found[told['channel']]
        assert float(told['bias [um p-p]']) == pytest.approx(2e6 * own['bias'], rel=5e-3)
        assert float(told['phase bias [deg of lag]']) == pytest.approx(
            -np.degrees(own['phase_bias_rad']), rel=5e-3)


def test_every_file_is_written_and_says_the_same(healthy):
    out, _, _ = healthy
    names = {path.name for path in out.iterdir()}
    assert names == {'comparison.csv', 'comparison.json', 'report.html', 'trend.png',
                     'residuals.png', *(f'{kind}_{name}.png' for name in HOUSINGS
                                        for kind in ('bode', 'polar'))}
    with (out / 'comparison.csv').open() as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == 4 * 80
    case, model = fan_model()
    row = rows[17]
    speed = np.array([float(row['speed_rad_s'])])
    exact = model.unbalance_response(speed, case.unbalance).displacement[
        0, model.channels.index(row['channel'])]
    # A slow coast-down: nearly what the machine does that has always turned so.
    assert float(row['predicted_amplitude']) == pytest.approx(abs(exact), rel=0.01)
    assert float(row['band_low']) <= float(row['predicted_amplitude']) <= float(row['band_high'])
    assert row['used'] == '1'


class Page(HTMLParser):
    """Checks that tags match; collects images and whatever would be loaded from elsewhere."""

    def __init__(self):
        super().__init__()
        self.open, self.images, self.loaded = [], [], []

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.loaded += [tag] * (tag in ('script', 'link', 'iframe') or 'href' in given)
        if tag == 'img':
            self.images.append(given['src'])
        elif tag != 'meta':
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def test_report_is_one_page_that_needs_nothing_else(healthy):
    text = (healthy[0] / 'report.html').read_text()
    page = Page()
    page.feed(text)
    assert page.open == []
    assert page.loaded == []
    assert len(page.images) == 10
    for source in page.images:
        head, _, body = source.partition(',')
        assert head == 'data:image/png;base64'
        assert b64decode(body).startswith(b'\x89PNG')
    assert 'http' not in re.sub('<img[^>]*>', '', text)
    assert '<b>passes</b>' in text


def test_softer_ground_fails_by_its_peaks(tmp_path):
    found = judged(write_vectors(tmp_path / 'log.mcap', factor=0.7))
    assert found.verdict == Verdict.FAILS
    assert any('% from the predicted 13' in failure for failure in found.failures)


def test_unbalance_far_beyond_the_band_fails(tmp_path):
    said = '\n'.join(judged(write_vectors(tmp_path / 'log.mcap', gain=4.0)).failures)
    assert re.search(r'fan_end_housing_z: \d+ % of the amplitudes lie inside the band', said)
    assert re.search(
        r'fan_end_housing_x: the peak measured at 1[23]\d\d rpm is .* um p-p high', said)


def test_zone_d_is_told_and_fails_at_constant_speed_only(tmp_path):
    found = judged(write_vectors(tmp_path / 'log.mcap', gain=10.0))
    [worst] = [entry for entry in found.zones
               if entry.source == 'measured' and entry.channel == 'fan_end_housing_x']
    assert worst.zone == 'D'
    assert not worst.is_steady
    points = found.points[HOUSINGS.index('fan_end_housing_x')]
    assert worst.velocity == pytest.approx((points.speed * points.amplitude).max() / np.sqrt(2.0))
    assert any('its zone is the worst in passing' in remark for remark in found.remarks)
    assert not any('zone D' in failure for failure in found.failures)
    found = judged(write_vectors(tmp_path / 'log.mcap', gain=10.0, seconds=60))
    assert any('zone D' in failure for failure in found.failures)


def test_amplitudes_alone_are_compared_and_said_to_be(tmp_path):
    found = judged(write_vectors(tmp_path / 'log.mcap', phase=False))
    assert found.verdict == Verdict.PASSES
    assert any('no phase measured: amplitudes only are compared' in remark
               for remark in found.remarks)
    assert not found.points[0].has_phase
    kinds = [name.partition('_')[0] for name, _, _ in all_figures(found)]
    assert set(kinds) == {'bode', 'trend', 'residuals'}


@pytest.mark.parametrize('seed', range(3))
def test_identification_through_a_log_keeps_its_promise(tmp_path, seed):
    # Unbalance within 3 %, G within 5 %, at 5 % noise over a run-down through resonance.
    truth = 0.031 * np.exp(0.9j)
    found = judged(write_vectors(tmp_path / 'log.mcap', factor=0.6, unbalance=[0.0, truth],
                                 noise=0.05, seed=seed))
    known = identify_case(found, Wanted(scalars=['soil.shear_modulus'], planes=['wheel']))
    assert known.factor[0] == pytest.approx(0.6, rel=0.05)
    assert abs(known.moment[0] - truth) < 0.03 * abs(truth)
    assert known.settings == [f'soil.shear_modulus={100e6 * float(known.factor[0])!r}']


def test_identified_case_is_written_and_explains_the_run(tmp_path, capsys):
    log = write_vectors(tmp_path / 'log.mcap', factor=0.6, unbalance=[0.0, 0.031j], noise=0.03)
    written = tmp_path / 'identified.yaml'
    assert main(['compare', log, FAN, '-o', str(tmp_path / 'out'), '--plane', 'wheel',
                 '--identify', 'soil.shear_modulus', '--write-case', str(written)]) == 1
    said = capsys.readouterr().out
    assert 'soil.shear_modulus: factor 0.6' in said
    assert 'quote this one' in said
    assert load(written).soil.shear_modulus == pytest.approx(60e6, rel=0.03)
    # The story of the case and its comments stay.
    before, after = Path(FAN).read_text().splitlines(), written.read_text().splitlines()
    assert set(before) - set(after) == {line for line in before if 'shear_modulus: 100' in line
                                        or 'disc: wheel, moment' in line}
    assert load(written).unbalance[1] == pytest.approx(0.031j, rel=0.03)
    assert judged(log, written).verdict == Verdict.PASSES


def test_run_that_cannot_tell_is_refused(tmp_path):
    found = judged(write_vectors(tmp_path / 'log.mcap', noise=0.02))
    with pytest.raises(NotSolvedError, match=r'cannot tell rotor.bearings.\*.damping'):
        identify_case(found, Wanted(scalars=['rotor.bearings.*.damping']))


def test_runout_is_identified_as_a_constant_vector(tmp_path):
    # At so many constant speeds: what was measured is steady to the last digit.
    found = judged(write_vectors(tmp_path / 'log.mcap', offset=2e-6j, seconds=11))
    known = identify_case(found, Wanted(planes=['wheel'], runout=True))
    assert known.columns[1:] == tuple(f'runout of {name}' for name in HOUSINGS)
    np.testing.assert_allclose(known.moment[1:], 2e-6j, rtol=1e-3)
    assert known.moment[0] == pytest.approx(0.028, rel=1e-3)


def test_demonstration_without_a_plant_finds_what_was_put_in(tmp_path, capsys):
    case, model = fan_model()
    truth = Truth(ramp_s=12.0, dwell_s=3.0, rate_hz=800.0)
    log = tmp_path / 'synthetic.mcap'
    write_synthetic(log, 'plant_fan', model, case.unbalance, truth=truth, start_ns=START_NS)
    out = tmp_path / 'out'
    assert main(['compare', str(log), FAN, '-o', str(out), '--plane', 'wheel',
                 '--identify', 'soil.shear_modulus', '--identify-growth']) == 1
    said = capsys.readouterr().out
    assert 'note: SYNTHETIC signals' in said
    factor = float(re.search(r'soil.shear_modulus: factor (\S+)', said)[1])
    size = float(re.search(r'  wheel: (\S+) kg m', said)[1])
    growth = float(re.search(r'growth of wheel: (\S+) kg m', said)[1])
    assert factor == pytest.approx(truth.shear_modulus_factor, rel=0.02)
    # From the first vector to the last, which are a few turns inside the run.
    assert size == pytest.approx(abs(case.unbalance[1]), rel=0.03)
    assert growth == pytest.approx(truth.growth * abs(case.unbalance[1]), rel=0.1)
    found = summary(out)
    assert found['synthetic']
    assert 'SYNTHETIC' in (out / 'report.html').read_text().split('</h1>')[0]
    page = (out / 'report.html').read_text()
    soft = round(100.0 * (1.0 - factor))
    assert f'ground {soft} % softer than in the case, unbalance of wheel grew by ' in page
    assert 'look at wheel at the next stop' in found['next_step']
    assert '<dt>quasi-static</dt>' in page
    assert sheets(out / 'report.html', tmp_path) <= 3
    pictures = {name: figure for name, _, figure in all_figures(judged(log))}
    drawn = {line.get_label().split(' (')[0]: (line.get_marker(), line.get_color())
             for line in pictures['bode_fan_end_housing_x'].axes[0].get_lines()}
    ways = [drawn[f'measured, {way}'] for way in ('run-up', 'run-down', 'constant speed')]
    assert len({mark for mark, _ in ways}) == len({colour for _, colour in ways}) == 3
    lines = {line.get_label(): line for line in pictures['trend'].axes[1].get_lines()}
    measured, predicted = (lines[f'fan_end_housing_x {what}'] for what in ('measured',
                                                                           'predicted'))
    assert measured.get_color() != predicted.get_color()
    assert measured.get_marker() != predicted.get_marker()


def test_rotor_kit_is_shown_as_it_is(kit_log, tmp_path, capsys):
    assert main(['compare', kit_log, KIT, '-o', str(tmp_path)]) == 1
    said = capsys.readouterr().out
    channel = summary(tmp_path)['channels']['probe_1_x']
    assert channel['points'] == 210
    assert channel['excluded']['not quasi-static'] > 150
    assert channel['share_inside_band'] is None
    assert 'was passed too fast to be as high and where it would be at constant speed' in said
    # Nearly without damping the model rings on behind its own critical speed, and no peak of it
    # stands out.
    [peak] = summary(tmp_path)['peaks']
    assert peak['predicted'] is None
    assert 1550.0 < peak['measured']['speed_rad_s'] * 30.0 / np.pi < 1700.0
    assert not peak['quasi_static']
    assert 'the peak measured at 1665 rpm is not predicted' in said


def test_rotor_kit_bearing_stiffness_is_identified(kit_log, tmp_path, capsys):
    arguments = ['compare', kit_log, KIT, '-o', str(tmp_path), '--plane', 'disc_1',
                 '--identify', 'rotor.bearings.*.stiffness']
    case = tmp_path / 'identified.yaml'
    main([*arguments, '--write-case', str(case)])
    said = capsys.readouterr().out
    # One stiffness in all directions is one mode, which cannot beat; the kit has two.
    assert float(re.search(r'stiffness: factor (\S+)', said)[1]) == pytest.approx(0.064, rel=0.02)
    assert 88.0 < float(re.search(r'explains (\S+) %', said)[1]) < 92.0
    again = judged(kit_log, case)
    [peak] = again.peaks
    assert abs(peak.deviation) < 0.02
    [points] = again.points
    assert np.all(points.used)  # all 210, in a passage at p = 0.95
    [failure] = again.failures
    assert 'high, at most' in failure
    main([*arguments, '--force', '--set', 'run_up=quasi_static'])
    assert 'refused: the run cannot tell rotor.bearings.*.stiffness' in capsys.readouterr().out
    main([*arguments, '--force', '--set', 'run_up=quasi_static', '--with-transients'])
    said = capsys.readouterr().out
    assert float(re.search(r'stiffness: factor (\S+)', said)[1]) == pytest.approx(0.077, rel=0.02)


def test_log_of_an_answered_run_knows_its_case(kit_log, tmp_path, capsys):
    answered = str(tmp_path / 'answered.mcap')
    assert main(['predict', KIT, kit_log, '-o', answered]) == 0
    assert main(['compare', answered, '-o', str(tmp_path / 'own')]) == 1
    assert main(['compare', kit_log, KIT, '-o', str(tmp_path / 'asked')]) == 1
    capsys.readouterr()
    own, asked = summary(tmp_path / 'own'), summary(tmp_path / 'asked')
    assert own['case'] == 'rk4_rotor_kit'
    assert own['failures'] == asked['failures']
    assert own['channels']['probe_1_x']['bias'] == pytest.approx(
        asked['channels']['probe_1_x']['bias'], rel=1e-9)
    changed = tmp_path / 'other'
    main(['compare', answered, KIT, '--set', 'rotor.bearings.0.stiffness.xx=2e6',
          '-o', str(changed)])
    assert any('rest on another table than the case' in line
               for line in summary(changed)['remarks'])


def test_log_carries_its_case_and_the_files_that_it_names(kit_log, tmp_path, capsys):
    table = tmp_path / 'measured_ground.csv'
    table.write_text('hz,xx_re,xx_im,zz_re,zz_im\n0,8e8,0,9e8,0\n40,7e8,6e7,8e8,7e7\n')
    case = tmp_path / 'own_fan.yaml'
    text = re.sub(r'support:\n(  .*\n)+', 'support: {model: table, file: measured_ground.csv}\n',
                  Path(FAN).read_text())
    case.write_text(text)
    log, answered = write_vectors(tmp_path / 'log.mcap'), tmp_path / 'answered.mcap'
    given = judged(log, case)
    assert main(['predict', str(case), log, '-o', str(answered)]) == 0
    case.unlink()
    table.unlink()
    own = compare(answered, cache_directory=tmp_path / 'cache')
    assert (own.verdict, own.failures) == (given.verdict, given.failures)
    for one, other in zip(own.points, given.points, strict=True):
        np.testing.assert_array_equal(one.predicted, other.predicted)


@pytest.mark.parametrize('arguments, problem', [
    (['nothing.mcap'], 'nothing.mcap: no such file or bag directory'),
    (['{log}'], '{log}: does not carry the case it was answered with; give the CASE'),
    (['{log}', FAN, '--machine', 'pump'], '{log}: must tell the speed of pump on joint_states'),
    (['{log}', 'nothing.yaml'], 'nothing.yaml: cannot be read'),
    (['{log}', '--set', 'a=1'], '--set: needs the CASE that it overrides'),
    (['{log}', FAN, '--write-case', 'x.yaml'], '--write-case: needs --identify'),
    (['{log}', FAN, '--identify', 'soil.sheer'],
     f'{FAN}: --identify soil.sheer: names no number of the case'),
    (['{log}', FAN, '--identify-unbalance', '--plane', 'whel'],
     f'{FAN}: plane must be one of coupling, wheel, got whel'),
])
def test_bad_input_is_one_line_and_status_2(arguments, problem, tmp_path, capsys):
    log = write_vectors(tmp_path / 'log.mcap')
    given = [argument.replace('{log}', log) for argument in arguments]
    assert main(['compare', *given, '-o', str(tmp_path / 'out')]) == 2
    said = capsys.readouterr().err
    assert said.startswith(problem.replace('{log}', log))
    assert said.count('\n') == 1


@pytest.mark.slow
def test_soil_under_infinite_elements_is_identified_on_its_table(tmp_path):
    overrides = ['support.model=infinite_elements']
    case = load(Path(FAN), overrides)
    model = coupled_model(case, tmp_path)
    log = write_vectors(tmp_path / 'log.mcap', factor=0.6, noise=0.05, model=model)
    found = compare(Path(log), case, cache_directory=tmp_path)
    known = identify_case(found, Wanted(scalars=['soil.shear_modulus'], planes=['wheel']))
    assert known.factor[0] == pytest.approx(0.6, rel=0.05)
