"""Many bags: each with a record, what is done stays done, and minutes are those of the node."""

from concurrent.futures import ThreadPoolExecutor
import csv
from dataclasses import asdict
import json
import math
import os
from pathlib import Path
import signal

import numpy as np
import pytest

from rotorsoil_ros.bags import archive, reader as bag_reader
from rotorsoil_ros.bags.archive import Book, predict_many, Record, write_statistics
from rotorsoil_ros.bags.feed import Inputs
from rotorsoil_ros.bags.predict import predict
from rotorsoil_ros.bags.profile import write_speed_profile
from rotorsoil_ros.bags.synthetic import Truth, write_synthetic
from rotorsoil_ros.bags.workers import ENGINE, pool_of, processes, THREADS
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.monitor.minutes import MINUTE_NS
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.units import rpm_to_rad_s

FAN = Path('config/plant_fan.yaml')
SECOND = 10**9
START = 1_790_000_000_123_456_789
SOFTER = 0.7


@pytest.fixture(scope='module')
def fan(tmp_path_factory):
    return Machine.load(FAN, cache_directory=tmp_path_factory.mktemp('tables'))


@pytest.fixture(scope='module')
def measured(fan, tmp_path_factory):
    """Return a run of 66 s on softer ground."""
    path = tmp_path_factory.mktemp('runs') / 'measured.mcap'
    write_synthetic(path, 'fan', fan.model, fan.case.unbalance, start_ns=START, truth=Truth(
        shear_modulus_factor=SOFTER, growth=1.0, noise=0.02, ramp_s=30.0, dwell_s=6.0,
        rate_hz=400.0))
    return path


@pytest.fixture(scope='module')
def book(fan, measured):
    """Return who has heard the run, and its minutes."""
    found = Book(fan)
    predict(fan, measured, None, listener=found)
    return found, found.rows()


def profile(path, *, rpm=(300.0, 1700.0), number=50):
    """Write a run-up of one speed a second."""
    write_speed_profile(path, 'fan', START + SECOND * np.arange(number),
                        rpm_to_rad_s(np.linspace(*rpm, number)))
    return path


def live(log, machine):
    """Return the minutes of a monitor that hears a log message by message, as the node does."""
    inputs, book = Inputs.of(log), Book(machine)
    monitor = Monitor('fan', machine.table, machine.case.unbalance, sinks=[book],
                      judging=Judging.of(machine.case))
    monitor.judge.take_criteria(criteria(
        machine.case, machine.model, machine.case.unbalance, machine.directory))
    book.begin(monitor)
    inlets, due_ns = inputs.inlets(monitor, lambda records: None), None
    for source, at_ns, payload in bag_reader.messages(log, lambda topic, _: topic in inlets):
        due_ns = at_ns + 370_000_000 if due_ns is None else due_ns
        while at_ns >= due_ns:
            monitor.tick(due_ns, stale_after_s=3.0)
            due_ns += SECOND
        inlets[source.topic]([at_ns], [bytes(payload)])
    monitor.tick(due_ns, stale_after_s=3.0)
    monitor.finish(due_ns)
    return book.rows()


def test_minutes_are_those_of_the_live_node_to_the_last_bit(fan, measured, book):
    _, rows = book
    assert repr(rows) == repr(live(measured, fan))
    assert {row.minute_ns for row in rows} == {
        (START + 60 * step * SECOND) // MINUTE_NS * MINUTE_NS for step in (0, 1)}


def test_minutes_are_means_over_what_was_measured(book):
    heard, told = book
    [points] = [each for each in heard._points.points()
                if each.channel == 'fan_end_housing_x']
    rows = [row for row in told if row.channel == 'fan_end_housing_x']
    assert sum(row.vectors for row in rows) == len(points.speed)
    for row in rows:
        here = points.used & (points.stamp_ns // MINUTE_NS * MINUTE_NS == row.minute_ns)
        left = (points.measured - points.predicted)[here]
        assert row.used == len(left)
        assert row.residual_re == pytest.approx(math.fsum(left.real) / len(left), rel=1e-9)
        assert row.residual_rms == pytest.approx(
            math.sqrt(math.fsum(np.abs(left) ** 2) / len(left)), rel=1e-9)
        assert row.speed_rad_s > 0.0


def test_effective_ground_of_a_minute_is_what_was_put_in(book):
    told = {row.minute_ns: (row.ground_factor, row.ground_factor_error) for row in book[1]
            if math.isfinite(row.ground_factor)}
    assert told
    for factor, error in told.values():
        assert abs(factor - SOFTER) < 2.0 * error
        assert factor == pytest.approx(SOFTER, rel=0.05)


def test_a_steady_minute_tells_nothing_of_the_ground(fan, tmp_path):
    write_synthetic(tmp_path / 'steady.mcap', 'fan', fan.model, fan.case.unbalance,
                    start_ns=START // MINUTE_NS * MINUTE_NS, truth=Truth(
                        slowest_rpm=1490.0, fastest_rpm=1500.0, ramp_s=2.0, dwell_s=20.0,
                        rate_hz=400.0))
    [record] = predict_many(fan, [tmp_path / 'steady.mcap'], tmp_path / 'out',
                            has_statistics=True)
    assert any(row.used for row in record.minutes)
    assert all(math.isnan(row.ground_factor) for row in record.minutes)


def test_speeds_alone_have_minutes_without_residuals(fan, tmp_path):
    path = profile(tmp_path / 'speeds.mcap', number=100)
    [record] = predict_many(fan, [path], tmp_path / 'out', has_statistics=True)
    assert {(row.vectors, row.zone_measured) for row in record.minutes} == {(0, '')}
    assert all(math.isnan(row.residual_rms) for row in record.minutes)
    by_channel = {}
    for row in record.minutes:
        by_channel[row.channel] = by_channel.get(row.channel, 0) + row.speeds
    assert set(by_channel.values()) == {100}


def test_a_bag_that_cannot_be_answered_stops_no_other(fan, tmp_path):
    (tmp_path / 'broken.mcap').write_bytes(b'no log')
    bags = [profile(tmp_path / 'a.mcap'), tmp_path / 'broken.mcap', tmp_path / 'absent.mcap',
            profile(tmp_path / 'fast.mcap', rpm=(3000.0, 4000.0)), profile(tmp_path / 'b.mcap')]
    records = list(predict_many(fan, bags, tmp_path / 'out'))
    assert [record.bag for record in records] == list(map(str, bags))
    assert [bool(record.failure) for record in records] == [False, True, True, True, False]
    assert 'nothing is answered: 50 above table' in records[3].failure
    assert sorted(path.name for path in (tmp_path / 'out').glob('*.mcap')) == ['a.mcap', 'b.mcap']


def test_predictions_are_those_of_one_bag_alone(fan, tmp_path):
    path = profile(tmp_path / 'a.mcap')
    [record] = predict_many(fan, [path], tmp_path / 'out')
    predict(fan, path, tmp_path / 'alone.mcap')
    assert Path(record.out).read_bytes() == (tmp_path / 'alone.mcap').read_bytes()


def test_only_what_is_new_or_changed_is_answered_again(fan, tmp_path, monkeypatch):
    bags = [profile(tmp_path / f'{name}.mcap') for name in 'abc']
    first = list(predict_many(fan, bags[:2], tmp_path / 'out', has_statistics=True))
    answered = []

    def watched(jobs):
        for job in jobs:
            answered.append(job.bag.name)
            yield archive.answer_bag(job)

    def counting(function, jobs, /):
        return watched(jobs)

    again = list(predict_many(fan, bags, tmp_path / 'out', has_statistics=True, map=counting))
    assert answered == ['c.mcap']
    assert repr(again[:2]) == repr(first)
    profile(bags[0], number=60)
    (tmp_path / 'out' / 'b.mcap').unlink()
    answered.clear()
    assert [record.counts['answered'] for record in predict_many(
        fan, bags, tmp_path / 'out', has_statistics=True, map=counting)] == [60, 50, 50]
    assert answered == ['a.mcap', 'b.mcap']
    answered.clear()
    other = Machine.load(FAN, cache_directory=fan.directory, overrides=['soil.density=1950'])
    list(predict_many(other, bags[:1], tmp_path / 'out', has_statistics=True, map=counting))
    assert answered == ['a.mcap']


def test_a_record_that_is_no_record_is_answered_again(fan, tmp_path):
    path = profile(tmp_path / 'a.mcap')
    list(predict_many(fan, [path], tmp_path / 'out'))
    for content in ('', '[]', '{"identity": 1}', '{'):
        (tmp_path / 'out' / 'a.json').write_text(content)
        [record] = predict_many(fan, [path], tmp_path / 'out')
        assert record.counts['answered'] == 50
        assert json.loads((tmp_path / 'out' / 'a.json').read_text())['bag'] == str(path)


def test_bags_of_one_name_have_records_of_their_own(fan, tmp_path):
    for place in ('north', 'south'):
        (tmp_path / place).mkdir()
    bags = [profile(tmp_path / place / 'run.mcap') for place in ('north', 'south')]
    outs = [Path(record.out) for record in predict_many(fan, bags, tmp_path / 'out')]
    assert len(set(outs)) == 2
    assert all(out.exists() and out.name.startswith('run_') for out in outs)


def test_a_bag_given_twice_or_none_is_refused(fan, tmp_path):
    path = profile(tmp_path / 'a.mcap')
    with pytest.raises(InputError, match='given twice'):
        predict_many(fan, [path, path], tmp_path / 'out')
    with pytest.raises(InputError, match='no bag'):
        predict_many(fan, [], tmp_path / 'out')


def test_any_executor_answers(fan, tmp_path):
    bags = [profile(tmp_path / f'{name}.mcap') for name in 'abc']
    with ThreadPoolExecutor(2) as pool:
        records = list(predict_many(fan, bags, tmp_path / 'out', map=pool.map))
    assert [record.counts['answered'] for record in records] == [50, 50, 50]


def deadly(job):
    """Answer a bag, unless its name says that it ends its process."""
    if (known := job.known()) is not None:
        return known
    job.begun.touch()
    if job.bag.stem.startswith('deadly'):
        os.kill(os.getpid(), signal.SIGKILL)
    job.begun.unlink()
    return job.keep(Record(str(job.bag), 'fan'))


def test_a_bag_that_kills_its_process_costs_no_other(fan, tmp_path, monkeypatch):
    monkeypatch.setattr(archive, 'answer_bag', deadly)
    bags = [profile(tmp_path / f'{name}.mcap')
            for name in ('a', 'deadly', 'b')]
    records = list(predict_many(fan, bags, tmp_path / 'out', map=processes(2)))
    assert [record.bag for record in records] == list(map(str, bags))
    assert [bool(record.failure) for record in records] == [False, True, False]
    assert 'ended twice' in records[1].failure
    assert not list((tmp_path / 'out').glob('*.begun'))


@pytest.mark.parametrize('ending', ['csv', 'parquet'])
def test_statistics_are_a_table(fan, tmp_path, ending):
    import pandas

    bag = profile(tmp_path / 'speeds.mcap', number=100)
    records = list(predict_many(fan, [bag], tmp_path / 'out', has_statistics=True))
    path = tmp_path / f'minutes.{ending}'
    write_statistics(path, records)
    table = pandas.read_csv(path) if ending == 'csv' else pandas.read_parquet(path)
    assert len(table) == len(records[0].minutes)
    np.testing.assert_array_equal(table['predicted'], [
        row.predicted for row in records[0].minutes])
    assert table['residual_rms'].isna().all()
    assert list(table.columns) == ['bag', *asdict(records[0].minutes[0])]


def test_statistics_of_another_ending_are_refused(tmp_path):
    with pytest.raises(InputError, match='must end with'):
        write_statistics(tmp_path / 'x.xlsx', [])


def test_verb_answers_several_bags_in_processes(tmp_path, capsys):
    bags = [str(profile(tmp_path / f'{name}.mcap')) for name in 'ab']
    (tmp_path / 'broken.mcap').write_bytes(b'no log')
    status = main(['predict', str(FAN), *bags, str(tmp_path / 'broken.mcap'), '--jobs', '2',
                   '-o', str(tmp_path / 'out'), '--statistics', str(tmp_path / 'x.csv'),
                   '--cache', str(tmp_path / 'cache')])
    told = capsys.readouterr()
    assert status == 1
    assert '2 of 3 bags answered' in told.out
    assert 'broken.mcap: ' in told.err
    with (tmp_path / 'x.csv').open() as stream:
        assert {row['bag'] for row in csv.DictReader(stream)} == set(bags)


def test_verb_keeps_no_predictions_without_an_output(tmp_path, capsys):
    bag = profile(tmp_path / 'a.mcap')
    assert main(['predict', str(FAN), str(bag), '--statistics', str(tmp_path / 'x.csv'),
                 '--cache', str(tmp_path / 'cache')]) == 0
    assert sorted(path.name for path in tmp_path.rglob('*.mcap')) == ['a.mcap']
    assert main(['predict', str(FAN), str(bag), '--cache', str(tmp_path / 'cache')]) == 2
    assert '-o OUT is missing' in capsys.readouterr().err


@pytest.mark.filterwarnings('ignore::DeprecationWarning', 'ignore::ResourceWarning')
def test_a_cluster_answers(fan, tmp_path):
    from distributed import LocalCluster

    from rotorsoil_ros.bags.workers import cluster

    bags = [profile(tmp_path / f'{name}.mcap') for name in 'abc']
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=True,
                      dashboard_address=None) as workers:
        records = list(predict_many(
            fan, bags, tmp_path / 'out', map=cluster(workers.scheduler_address)))
    assert [record.counts['answered'] for record in records] == [50, 50, 50]


def test_processes_come_with_the_engine_with_one_thread_and_without_ros(monkeypatch):
    monkeypatch.delenv('MKL_NUM_THREADS', raising=False)
    said = (f'[name in __import__("sys").modules for name in ({ENGINE!r}, "rclpy")], '
            f'[__import__("os").environ.get(name) for name in {THREADS}]')
    with pool_of(1) as pool:
        assert pool.submit(eval, said).result() == ([True, False], ['1', '1', '1'])
    assert 'MKL_NUM_THREADS' not in os.environ
