"""A stamp that was never set, or that is years away, is no time; the reception has one."""

from collections import Counter

import pytest

from rotorsoil_ros.wire.dating import Arrival, Dating, LONGEST_NS

SECOND = 10**9
START = 1_700_000_000 * SECOND
BOOT = 5 * SECOND  # what a clock says that was never set


def dated(stamps, received):
    """Return the times that messages count at, and what was counted."""
    counts = Counter()
    dating = Dating(lambda reason, number: counts.update({reason: number}))
    return [dating.date(stamp, received, row) for row, stamp in enumerate(stamps)], counts


def logged(count):
    return [START + row * SECOND for row in range(count)]


@pytest.mark.parametrize('stamps, reasons', [
    ([0, 0, 0], {'stamp_not_set': 3}), ([0, START + 7, START + 8], {'stamp_not_set': 1}),
    ([START + 7, BOOT, START + 8], {'stamp_far_off': 1}),
    ([BOOT, BOOT + SECOND, START + 7], {'stamp_far_off': 2}),
    ([START + 7, START - 3600 * SECOND, START + 8], {})])
def test_in_a_log_what_is_no_time_counts_when_it_was_received(stamps, reasons):
    times, counts = dated(stamps, logged(3))
    assert counts == reasons
    assert times == [stamp if abs(stamp - START) < LONGEST_NS else received
                     for stamp, received in zip(stamps, logged(3), strict=True)]


def test_without_any_time_there_is_none():
    times, counts = dated([0, START], [0, START])
    assert times == [None, START]
    assert counts == {'stamp_missing': 1}


def test_a_running_node_follows_the_clock_of_who_stamps_and_reads_its_own_if_it_must():
    read = []
    arrival = Arrival(lambda: read.append(START) or START)
    simulated = [BOOT, BOOT + SECOND, 0, BOOT + 2 * SECOND]
    times, counts = dated(simulated, arrival)
    assert times == [BOOT, BOOT + SECOND, START, BOOT + 2 * SECOND]
    assert counts == {'stamp_not_set': 1}
    assert len(read) == 1
    assert arrival[0:1][0] == START
