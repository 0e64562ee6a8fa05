"""At which time does a message count? At its own stamp, if that can be one."""

from collections.abc import Callable, Sequence
from typing import overload, TypeAlias

from rotorsoil_ros.arrays import IntArray
from rotorsoil_ros.events import LAST_STAMP, NANOSECONDS

YEAR_S = 31_556_952
LONGEST_NS = 10 * YEAR_S * NANOSECONDS  # that any log spans: what is further off is no time

Note: TypeAlias = Callable[[str, int], None]


class Arrival(Sequence[int]):
    """
    When a message has come to a running node [ns].

    Reading the clock takes 3 us, and most messages have their own stamp: it is read when asked.
    """

    def __init__(self, clock: Callable[[], int]) -> None:
        self._clock = clock

    def __len__(self) -> int:
        return 1

    @overload
    def __getitem__(self, index: int) -> int: ...

    @overload
    def __getitem__(self, index: slice) -> Sequence[int]: ...

    def __getitem__(self, index: int | slice) -> int | Sequence[int]:
        return self if isinstance(index, slice) else self._clock()


class Dating:
    """
    Decides at which time stamped messages count: at their own, or at that of their reception.

    A stamp of zero was never set, and one that is years from those before and from the time of
    reception is none: both are dated on reception, and counted. Where the reception has no time
    either, there is none. A running node may follow another clock than its own from the first
    message on, of a simulation or of a replay; in a log both times were written by one.
    """

    def __init__(self, note: Note) -> None:
        self._note = note
        self._last_ns: int | None = None

    def date(self, stamp_ns: int, received_ns: Sequence[int], row: int) -> int | None:
        """Return the time of a message [ns]; its reception is asked for only if it matters."""
        last = self._last_ns
        if stamp_ns and (isinstance(received_ns, Arrival) if last is None
                         else abs(stamp_ns - last) <= LONGEST_NS):
            self._last_ns = stamp_ns
            return stamp_ns
        received = received_ns[row]
        if stamp_ns and abs(stamp_ns - received) <= LONGEST_NS:
            self._last_ns = stamp_ns
            return stamp_ns
        if not received:
            self._note('stamp_missing', 1)
            return None
        self._note('stamp_far_off' if stamp_ns else 'stamp_not_set', 1)
        return received


def are_stamps(stamp_ns: IntArray) -> bool:
    """Return whether all of these, (n,), can be stamps [ns]."""
    return bool(stamp_ns.min() >= 0 and stamp_ns.max() <= LAST_STAMP)
