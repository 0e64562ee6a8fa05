"""A viewer that hangs, fails or is slow costs nobody anything but what it does not show."""

import socket
import threading

import pytest

from rotorsoil_ros.background import Aside, BACKLOG
from rotorsoil_ros.node.run_log import LogSettings, RunLog


def test_every_event_is_shown_in_order_and_then_it_is_finished():
    shown, complaints = [], []
    viewer = Aside(shown.extend, lambda: shown.append('end'), complain=complaints.append)
    for number in range(5):
        viewer(number)
        viewer.flush()
    viewer.close()
    assert shown == [0, 1, 2, 3, 4, 'end']
    assert complaints == []


@pytest.mark.parametrize('error', [OSError, RuntimeError, ValueError])
def test_a_viewer_that_fails_is_told_once(error):
    complaints = []

    def fail(events):
        raise error('gone')

    viewer = Aside(fail, lambda: None, complain=complaints.append)
    viewer(0)
    viewer.flush()
    viewer._thread.join(600.0)
    for number in range(2 * BACKLOG):
        viewer(number)
        viewer.flush()
    viewer.close()
    assert complaints == ['the viewer failed and nothing more is shown: gone']


def test_a_viewer_that_hangs_holds_nobody_up_and_no_memory():
    complaints, let_go = [], threading.Event()
    viewer = Aside(lambda events: let_go.wait(), lambda: None, complain=complaints.append,
                   patience_s=0.05)
    for number in range(10 * BACKLOG):
        viewer(number)
        viewer.flush()
    assert viewer._batches.qsize() <= BACKLOG
    viewer.close()
    let_go.set()
    viewer._thread.join(600.0)
    assert not viewer._thread.is_alive()
    assert len(complaints) == 2
    assert 'does not keep up' in complaints[0]
    assert 'left alone' in complaints[1]


def test_a_viewer_that_listens_and_never_reads_is_nobody(machine):
    with socket.create_server(('127.0.0.1', 0)) as deaf:
        settings = LogSettings(
            directory='', name='run', mcap=False, rerun=False, split_mib=0.0, split_s=0.0,
            rerun_url=f'rerun+http://127.0.0.1:{deaf.getsockname()[1]}/proxy')
        complaints = []
        log = RunLog(settings, {'fan': machine}, tell=print, complain=complaints.append)
        log.flush()
        log.close()
    assert len(complaints) == 1
    assert 'nobody listens' in complaints[0]


def test_what_hangs_while_it_is_opened_holds_nobody_up_and_loses_nothing(monkeypatch):
    monkeypatch.setattr('rotorsoil_ros.background.OPENING_S', 0.01)
    complaints, shown, let_go = [], [], threading.Event()
    viewer = Aside(shown.extend, lambda: None, begin=let_go.wait, complain=complaints.append)
    viewer(0)
    viewer.flush()
    assert complaints == ['the viewer hangs while it is opened: what comes waits for it']
    let_go.set()
    viewer.close()
    assert shown == [0]


def test_at_the_limit_of_threads_there_is_no_viewer_and_that_is_told(monkeypatch):
    complaints = []

    def refuse(thread):
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, 'start', refuse)
    viewer = Aside(pytest.fail, pytest.fail, complain=complaints.append)
    viewer(0)
    viewer.flush()
    viewer.close([1])
    assert complaints == [
        "the viewer failed and nothing more is shown: can't start new thread"]
