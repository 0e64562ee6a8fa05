"""`make demo`, shortened: a real node and a real replay over DDS; a comparison without a plant."""

from dataclasses import replace
from importlib.util import find_spec
import re

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.cli import demo, demo_comparison, main
from rotorsoil_ros.units import rad_s_to_rpm

START = 1_790_000_000_000_000_000


def test_profile_runs_up_dwells_and_coasts_down_inside_the_case():
    stamp_ns, speed = demo.speed_profile(7)
    assert stamp_ns[0] == 7
    speed_rpm = rad_s_to_rpm(speed)
    assert np.unique(np.diff(stamp_ns)).tolist() == [10_000_000]
    rising, still, falling = (np.diff(speed) > 1e-9, np.abs(np.diff(speed)) <= 1e-9,
                              np.diff(speed) < -1e-9)
    assert rising.sum() == 1200
    assert still.sum() == 300
    assert falling.sum() == 899
    assert np.all(rising[:1200])
    assert np.all(falling[-899:])
    low, high = load(demo.files('rotorsoil_ros') / 'config' / 'paper_rotor.yaml').speed_range
    assert low < speed.min() < speed.max() < high
    assert speed_rpm[0] == pytest.approx(300.0)
    assert speed_rpm.max() == pytest.approx(8400.0)


def test_demo_leaves_log_recording_and_pictures(tmp_path, monkeypatch, capfd):
    pytest.importorskip('rerun')
    for name, seconds in (('_RUN_UP_S', 0.6), ('_DWELL_S', 0.2), ('_COAST_S', 0.4)):
        monkeypatch.setattr(demo, name, seconds)
    monkeypatch.setattr(demo, 'all_figures', lambda *_: [])  # test_cli draws them
    monkeypatch.setattr(demo, 'demonstrate_comparison', lambda *_, **__: None)  # below
    assert main(['demo', '-o', str(tmp_path)]) == 0
    said = capfd.readouterr().out
    assert '120 speeds sent over DDS, 120 answered and logged' in said
    assert {path.name for path in (tmp_path / 'run').iterdir()} == {
        '.rotorsoil_log', 'metadata.yaml', 'run_0.mcap', 'run.rrd'}
    assert (tmp_path / 'plots' / 'demo.png').stat().st_size > 10_000
    assert 'um p-p at' in said


def test_comparison_without_a_plant_finds_what_was_put_in(tmp_path, monkeypatch, capsys):
    truth = replace(demo_comparison._TRUTH, ramp_s=10.0, dwell_s=3.0)
    monkeypatch.setattr(demo_comparison, '_TRUTH', truth)
    out = tmp_path / 'comparison'
    demo_comparison.demonstrate_comparison(out, tmp_path / 'cache', start_ns=START)
    said = capsys.readouterr().out
    assert said.startswith('plant_fan: SYNTHETIC sensors of 23 s')
    rows = re.findall(r'^  \S.* (\S+) +(\S+)$', said, flags=re.MULTILINE)
    soil, first, last = [tuple(map(float, row)) for row in rows[-3:]]
    assert soil == (0.7, pytest.approx(0.7, rel=0.02))
    assert first[1] == pytest.approx(first[0], rel=0.05)  # the least of all, under most noise
    assert last[1] == pytest.approx(last[0], rel=0.03)
    assert 0.028 < first[0] < last[0] < 7.0 * 0.028  # the fan's, and growing by six times that
    assert re.search(r'verdict   fails: .*peak measured at 1[01]\d\d rpm .* 13\d\d rpm', said)
    report = (out / 'report.html').read_text()
    assert 'SYNTHETIC' in report
    assert 'class="zone-A">A<' in report
    assert 'soil.shear_modulus: factor' in report
    assert (out / 'synthetic_plant_fan.mcap').stat().st_size > 100_000
    if find_spec('rerun'):
        assert (out / 'synthetic_plant_fan.rrd').stat().st_size > 100_000


def test_replay_that_fails_is_told_with_the_words_of_the_node(tmp_path, monkeypatch, capfd):
    monkeypatch.setattr(demo, 'write_speed_profile', lambda path, *_: path.write_bytes(b'junk'))
    assert main(['demo', '-o', str(tmp_path)]) == 2
    assert 'the replay failed' in capfd.readouterr().err
