"""How many messages were sent and never came? Their publisher has numbered them."""

from collections.abc import Callable, Mapping
from inspect import Parameter, Signature
from typing import Any

NUMBER = 'publication_sequence_number'


class Numbered:
    """
    Takes the messages of one subscription, and counts those between them that did not come.

    It does not matter where they were lost, on the network or in a queue that was full: DDS tells
    of the former only. A number belongs to its publisher, and rclpy does not say whose it is:
    where several publish, nothing is counted. One that has begun anew begins to count anew.

    Parameters
    ----------
    take : callable
        Gets every message.
    miss : callable
        Hears how many did not come.

    """

    # This is how rclpy finds out that somebody wants the number.
    __signature__ = Signature([Parameter(name, Parameter.POSITIONAL_ONLY)
                               for name in ('message', 'info')])

    def __init__(self, take: Callable[[bytes], None], miss: Callable[[int], None]) -> None:
        self._take, self._miss = take, miss
        self._last: int | None = None
        self._is_one = True

    def __call__(self, *told: Any) -> None:
        """Take a message and what is known of it."""
        # Of the executors of Jazzy, EventsExecutor hands both over as one.
        message, info = told if len(told) == 2 else told[0]
        if missing := self._missing(info):
            self._miss(missing)
        self._take(message)

    def hear_of(self, publishers: int) -> None:
        """
        Learn how many publishers there are now.

        After several of them the next number is the first that means something: it may be of one
        that has published for days.
        """
        is_one = publishers < 2
        if is_one is not self._is_one:
            self._is_one, self._last = is_one, None

    def _missing(self, info: Mapping[str, int | None]) -> int:
        """Return how many messages lie between this one and the last one."""
        number = info.get(NUMBER)  # None where the middleware gives none
        last, self._last = self._last, number
        if number is None or last is None or not self._is_one:
            return 0
        return max(0, number - last - 1)
