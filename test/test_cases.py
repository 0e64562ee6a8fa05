"""Logs of kinds that are met in the field: read for what is in them, or refused by name."""

from pathlib import Path
import shutil

import pytest
from rosbags.highlevel import AnyReader

from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.profile import read_profile
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.node.replay import replay
from rotorsoil_ros.wire.speeds import SpeedSource

from records import topics_of

CASES = Path(__file__).parent / 'cases'
ANSWERS = '/rotorsoil/paper_rotor/amplitude'
YEAR_NS = 365 * 86400 * 10**9


@pytest.fixture
def predicted(tmp_path, case_file, cache, machine, capsys):
    """Return what predicts a log of a case: its status, what it says, and when it answered."""
    def run(log, *options):
        out = tmp_path / 'out.mcap'
        status = main(['predict', str(case_file), str(log), '-o', str(out),
                       '--cache', str(cache), *options])
        times = [] if not out.exists() else [time for _, time, _ in bag_reader.messages(
            out, lambda topic, _: topic == ANSWERS)]
        assert list(tmp_path.glob('*.partial')) == []
        return status, capsys.readouterr(), times
    return run


@pytest.mark.parametrize('log, answered', [
    *((f'mcap_without_summary/{name}.mcap', 200) for name in (
        'no_channels_in_summary', 'no_statistics', 'no_summary')),
    ('one_wrong_log_time/rollover.mcap', 199), ('split_bag_cut_off/split_cut', 192),
    ('two_types_on_one_topic/a.mcap', 100), ('two_types_on_one_topic/b.mcap', 100),
    ('speed_in_another_type/dds_type_name.mcap', 200)])
def test_all_that_can_be_read_is_answered(predicted, log, answered):
    status, _, times = predicted(CASES / log)
    assert (status, len(times)) == (0, answered)


def test_what_was_left_out_is_told(predicted):
    _, said, _ = predicted(CASES / 'one_wrong_log_time' / 'rollover.mcap')
    assert '/paper_rotor/joint_states: 1 messages with an impossible time' in said.err
    assert '18446744073709551611 ns' in said.err


def test_a_file_that_is_cut_off_is_told(predicted):
    _, said, _ = predicted(CASES / 'split_bag_cut_off' / 'split_cut')
    assert 'split_cut_2.mcap: was never finished' in said.err


@pytest.mark.parametrize('log, words', [
    ('other_encodings/json.mcap', '/joint_states is sensor_msgs/msg/JointState (json)'),
    ('other_encodings/ros1.mcap', '/joint_states is sensor_msgs/msg/JointState (ros1)'),
    ('other_encodings/ros1.mcap', 'rosbags-convert --src RUN.bag --dst RUN --dst-storage mcap'),
    ('other_encodings/msgzstd',
     '/paper_rotor/joint_states: each message is compressed with zstd (compression_mode MESSAGE)'),
    ('speed_in_another_type/float32.mcap',
     '/paper_rotor/rotor/speed is std_msgs/msg/Float32 (cdr), needed is std_msgs/msg/Float64'),
    ('speed_in_another_type/twist.mcap', 'is geometry_msgs/msg/TwistStamped (cdr), needed is')])
def test_what_cannot_be_read_is_refused_by_its_topic_and_nothing_is_sent(predicted, log, words):
    status, said, times = predicted(CASES / log)
    assert (status, times) == (2, [])
    assert words in said.err
    assert said.err.count('\n') == 1
    with pytest.raises(InputError, match='paper_rotor'):
        replay(CASES / log, wait_s=0.0)


@pytest.mark.parametrize('log, words', [
    ('othername', '200 joint missing (needed is rotor, there are fan_motor_joint)'),
    ('reversed', 'nothing is answered: 200 negative (the speed is negative: of a drive that '
                 'counts backwards the ratio is -1)')])
def test_nothing_answered_is_a_failure_with_its_reason(predicted, log, words):
    status, said, times = predicted(CASES / 'joint_of_another_name' / f'{log}.mcap')
    assert (status, times) == (1, [])
    assert words in said.err


NAMED = '--speed-topic'
SPEEDS = [
    ('speed_in_another_type/float32.mcap', 200, [NAMED, '/paper_rotor/rotor/speed']),
    ('speed_in_another_type/rpm_int32.mcap', 200,
     [NAMED, '/paper_rotor/rpm', '--speed-unit', 'rpm']),
    ('speed_in_another_type/twist.mcap', 200, ['--speed-field', 'twist.angular.y']),
    ('joint_of_another_name/othername.mcap', 200, ['--joint', 'fan_motor_joint']),
    ('joint_of_another_name/reversed.mcap', 200, ['--speed-ratio', '-1']),
    ('two_types_on_one_topic/a.mcap', 100, [NAMED, '/paper_rotor/joint_states']),
    ('two_types_on_one_topic/b.mcap', 100, [NAMED, 'paper_rotor/joint_states']),
    ('two_types_on_one_topic/b.mcap', 100, [
        NAMED, '/paper_rotor/joint_states', '--speed-type', 'drive_msgs/msg/MotorState',
        '--speed-unit', 'rpm'])]


@pytest.mark.parametrize('log, answered, options', SPEEDS)
def test_a_speed_is_read_where_and_as_the_plant_tells_it(predicted, log, answered, options):
    status, said, times = predicted(CASES / log, *options)
    assert (status, len(times), said.err) == (0, answered, '')


@pytest.mark.parametrize('log, answered, options', SPEEDS)
def test_a_log_tells_such_a_speed_as_it_was_understood(
        predicted, tmp_path, log, answered, options):
    predicted(CASES / log, *options)
    understood = read_profile(tmp_path / 'out.mcap')
    assert (understood.machine, len(understood.speed)) == ('paper_rotor', answered)
    source = SpeedSource(**{
        name.removeprefix('--').removeprefix('speed-'): float(value) if 'ratio' in name else value
        for name, value in zip(options[::2], options[1::2], strict=True)})
    assert understood.speed.tolist() == read_profile(
        CASES / log, machine='paper_rotor' if source.topic else None,
        speed=source).speed.tolist()
    assert 0.0 < understood.speed.min() < understood.speed.max() < 1000.0


@pytest.mark.parametrize('log, options, words', [
    ('speed_in_another_type/rpm_int32.mcap', [], 'numbers are on /paper_rotor/rpm (std_msgs/'),
    ('speed_in_another_type/rpm_int32.mcap', [NAMED, '/paper_rotor/rpms'],
     'no such topic; did you mean /paper_rotor/rpm?'),
    ('speed_in_another_type/twist.mcap', ['--speed-field', 'twist.angular.q'],
     'has no number twist.angular.q; its numbers are twist.linear.x'),
    ('speed_in_another_type/twist.mcap', [NAMED, '/paper_rotor/rotor/speed'],
     'the field of the speed must be named'),
    ('two_types_on_one_topic/b.mcap', ['--speed-ratio', '0'], 'speed ratio must be finite'),
    ('other_encodings/json.mcap', [NAMED, '/paper_rotor/joint_states'], 'is encoded as json')])
def test_a_speed_that_is_not_told_so_is_refused_in_one_line(predicted, log, options, words):
    status, said, times = predicted(CASES / log, *options)
    assert (status, times, said.err.count('\n')) == (2, [], 1)
    assert words in said.err


@pytest.mark.parametrize('log, unset', [('zero_stamp', 200), ('first_stamp_zero', 1)])
def test_a_stamp_that_was_never_set_is_dated_on_reception_and_told(predicted, log, unset):
    status, said, times = predicted(CASES / 'stamps_never_set' / f'{log}.mcap')
    assert status == 0
    assert f'{unset} stamp_not_set' in said.out
    assert len(times) == 200
    assert max(times) - min(times) < 21 * 10**9  # as long as the log is
    assert min(times) > 50 * YEAR_NS


@pytest.mark.parametrize('name, saved', [
    ('one_wrong_log_time/rollover.mcap', 199), ('split_bag_cut_off/split_cut', 192)])
def test_what_was_recovered_is_readable_by_anybody(predicted, tmp_path, name, saved):
    fixed = tmp_path / Path(name).name.replace('split_cut', 'fixed')
    assert main(['recover', str(CASES / name), '-o', str(fixed)]) == 0
    status, said, times = predicted(fixed)
    assert (status, len(times), said.err) == (0, saved, '')
    with AnyReader([fixed]) as reader:
        assert len(list(reader.messages())) == reader.message_count == saved


def test_a_file_that_was_recovered_beside_itself_stands_for_the_broken_one(predicted, tmp_path):
    bag = Path(shutil.copytree(CASES / 'split_bag_cut_off' / 'split_cut', tmp_path / 'bag'))
    assert main(['recover', str(bag / 'split_cut_2.mcap'), '-o',
                 str(bag / 'split_cut_2_recovered.mcap')]) == 0
    status, said, times = predicted(bag)
    assert (status, len(times), said.err) == (0, 192, '')
    assert topics_of(bag)['/paper_rotor/joint_states'][1] == 192


def test_compressed_files_are_named(tmp_path):
    bag = tmp_path / 'bag'
    bag.mkdir()
    (bag / 'bag_0.mcap.zstd').write_bytes(b'\x28\xb5\x2f\xfd')
    with pytest.raises(InputError, match=r'bag_0\.mcap\.zstd: unpack them first'):
        bag_reader.sources(bag)
    (bag / 'metadata.yaml').write_text(
        'rosbag2_bagfile_information: {compression_mode: FILE, compression_format: zstd, '
        'relative_file_paths: [bag_0.mcap.zstd]}')
    with pytest.raises(InputError, match=r'bag_0\.mcap\.zstd: compressed with zstd as whole'):
        bag_reader.sources(bag)
