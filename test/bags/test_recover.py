"""What was flushed before a kill is saved, and nothing that was not written comes out."""

import io
from itertools import pairwise

from hypothesis import given, HealthCheck, settings, strategies as some
from mcap.reader import make_reader
import pytest
from rosbags.highlevel import AnyReader

from rotorsoil_ros.bags.recover import recover
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError

from records import float_records, joint_records, read_all, START, string_records


@pytest.fixture
def killed(tmp_path):
    """Return an unfinished file of three chunks, and where each of them ends."""
    log = LogFile(tmp_path / 'live.mcap')
    ends = []
    for second in range(3):
        log.write(joint_records(100, start=START + second * 10**9))
        log.write(float_records(50, start=START + second * 10**9))
        log.flush()
        ends.append(log.size)
    content = log.path.read_bytes()
    log.close()
    path = tmp_path / 'killed.mcap'
    path.write_bytes(content)
    return path, ends, read_all(log.path)


def test_every_flushed_message_is_saved_into_a_whole_file(killed, tmp_path):
    path, _, written = killed
    saved = recover(path, tmp_path / 'fixed.mcap')
    assert read_all(tmp_path / 'fixed.mcap') == written
    assert (saved.messages, saved.damaged_chunks) == (450, 0)
    assert saved.last_ns == START + 2 * 10**9 + 99 * 10**6
    content = (tmp_path / 'fixed.mcap').read_bytes()
    indexed = make_reader(io.BytesIO(content), validate_crcs=True)
    assert sum(1 for _ in indexed.iter_messages()) == 450
    assert indexed.get_header().profile == 'ros2'
    with AnyReader([tmp_path / 'fixed.mcap']) as reader:
        assert reader.message_count == 450


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(share=some.floats(0.0, 1.0))
def test_a_break_anywhere_costs_the_chunk_in_which_it_is(killed, tmp_path, share):
    path, ends, written = killed
    content = path.read_bytes()
    at = max(8, int(share * len(content)))
    cut, fixed = tmp_path / 'cut.mcap', tmp_path / 'fixed.mcap'
    cut.write_bytes(content[:at])
    fixed.unlink(missing_ok=True)
    recover(cut, fixed)
    # The messages of a chunk are whole before its index is.
    whole = sum(1 for end in ends if end <= at)
    assert read_all(fixed) in (written[:150 * whole], written[:150 * (whole + 1)])


def test_a_damaged_chunk_is_left_out_and_counted(killed, tmp_path):
    path, ends, written = killed
    content = bytearray(path.read_bytes())
    content[ends[0] + 200] ^= 255
    path.write_bytes(content)
    saved = recover(path, tmp_path / 'fixed.mcap')
    assert (saved.messages, saved.damaged_chunks) == (300, 1)
    assert read_all(tmp_path / 'fixed.mcap') == written[:150] + written[300:]


def test_the_verb_tells_how_many_and_until_when(killed, tmp_path, capsys):
    path, *_ = killed
    assert main(['recover', str(path), '-o', str(tmp_path / 'fixed.mcap')]) == 0
    assert capsys.readouterr().out == (
        f'{tmp_path}/fixed.mcap: 450 messages until 2023-11-14 22:13:22 UTC '
        '(1700000002099000001 ns)\n')


def test_nothing_is_overwritten_and_nonsense_is_refused(killed, tmp_path, capsys):
    path, *_ = killed
    before = path.read_bytes()
    with pytest.raises(InputError, match='exists already'):
        recover(path, path)
    assert path.read_bytes() == before
    (tmp_path / 'poem.mcap').write_text('roses are red')
    assert main(['recover', str(tmp_path / 'poem.mcap'), '-o', str(tmp_path / 'x')]) == 2
    assert main(['recover', str(tmp_path / 'nowhere'), '-o', str(tmp_path / 'x')]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 2
    assert sorted(found.name for found in tmp_path.iterdir()) == [
        'killed.mcap', 'live.mcap', 'poem.mcap']


def test_recovering_a_whole_file_keeps_it(bag, tmp_path):
    bag.write(string_records())
    bag.write(joint_records(10))
    bag.close()
    recover(bag.path / 'run_0.mcap', tmp_path / 'fixed.mcap')
    assert read_all(tmp_path / 'fixed.mcap') == read_all(bag.path)
    assert all(a <= b for a, b in pairwise(time for _, time, _ in read_all(bag.path)))
