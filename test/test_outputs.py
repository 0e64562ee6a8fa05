"""A verb that fails or is interrupted says so in a line at most, and leaves what was there."""

from pathlib import Path
import signal
import subprocess
import sys

import pytest

from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.cli import INTERRUPTED, main
from rotorsoil_ros.cli.outputs import replacing
from rotorsoil_ros.errors import InputError

from records import joint_records

DEADLINE_S = 600.0
ROOT = Path(__file__).parents[1]
PAPER = str(ROOT / 'config' / 'paper_rotor.yaml')


def script(wing):
    """Return what the installed `rotorsoil` or `rotorsoil_node` does."""
    return f'import sys; from rotorsoil_ros.{wing} import main; sys.exit(main())'


@pytest.fixture
def unanswered(tmp_path):
    """Return a profile of which no speed can be answered."""
    path = tmp_path / 'profile.mcap'
    with LogFile(path) as log:
        log.write(joint_records(10, topic='/fan/joint_states'))
    return path


def test_a_profile_without_an_answer_leaves_no_recording_and_takes_none(
        unanswered, tmp_path, capsys):
    pytest.importorskip('rerun', reason='rerun-sdk is optional')
    out, rrd, before = tmp_path / 'out.mcap', tmp_path / 'run.rrd', set(tmp_path.iterdir())
    command = ['predict', PAPER, str(unanswered), '-o', str(out), '--rrd', str(rrd),
               '--rotor-joint', 'nobody']
    assert main(command) == 1
    assert 'nothing is answered' in capsys.readouterr().err
    assert {path for path in tmp_path.iterdir() if path.name != 'cache'} == before
    rrd.write_text('precious')
    assert main([*command, '--force']) == 1
    assert rrd.read_text() == 'precious'


@pytest.mark.parametrize('error, status', [
    (InputError('case: is wrong'), 2), (OSError(28, 'No space left', 'x.png'), 2),
    (KeyboardInterrupt(), INTERRUPTED)])
@pytest.mark.parametrize('own', [None, 'notes'])
def test_what_a_verb_wrote_before_it_failed_goes_and_what_was_there_stays(
        tmp_path, monkeypatch, error, status, own):
    out = tmp_path / 'pictures'
    out.mkdir()

    def fail(arguments):
        (arguments.output / 'response.png').write_text('half')
        raise error

    if own:
        (out / own).write_text('precious')
    monkeypatch.setattr('rotorsoil_ros.cli.pictures.plot', fail)
    assert main(['plot', PAPER, '-o', str(out), '--force']) == status
    assert (out / 'response.png').exists() == bool(own)  # whose is it, among others?
    assert not own or (out / own).read_text() == 'precious'


def test_a_file_is_replaced_as_a_whole_or_not_at_all(tmp_path):
    path, link = tmp_path / 'table.csv', tmp_path / 'link.csv'
    path.write_text('old')
    link.symlink_to(path)

    def fail():
        with replacing(link) as aside:
            aside.write_text('half')
            raise OSError('full')

    with pytest.raises(OSError, match='full'):
        fail()
    assert path.read_text() == 'old'
    with replacing(link) as aside:
        aside.write_text('new')
    assert link.is_symlink()
    assert path.read_text() == 'new'
    assert sorted(tmp_path.iterdir()) == [link, path]
    with replacing(Path('/dev/null')) as aside:
        assert aside == Path('/dev/null')


# From within: a signal of another process may come when all is over. What a shell runs in the
# background inherits that interrupts are ignored.
INTERRUPTS = """
import os, runpy, signal, sys

signal.signal(signal.SIGINT, signal.default_int_handler)

class Interrupting:
    def find_spec(self, name, *rest):
        if name == {until!r}:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Interrupting())
"""


@pytest.mark.parametrize('until', ['rotorsoil_ros.errors', 'numpy', 'scipy.linalg'])
@pytest.mark.parametrize('program', [
    [script('cli'), 'check', PAPER],
    ["runpy.run_module('rotorsoil_ros.cli', run_name='__main__')", 'check', PAPER],
    [script('node')]])
def test_an_interrupt_while_libraries_are_loaded_is_quiet(program, until):
    does, *arguments = program
    done = subprocess.run(
        [sys.executable, '-c', INTERRUPTS.format(until=until) + does, *arguments],
        stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
        timeout=DEADLINE_S)
    assert done.stderr == ''
    # A node that is asked to stop has done what it should.
    assert done.returncode in ((0,) if 'node' in does else (INTERRUPTED, -signal.SIGINT))
