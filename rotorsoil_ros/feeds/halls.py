"""
The node's topics from hall to hall by Zenoh: the same bytes under the same names.

Key expression and attachment are ours: `rotorsoil/<topic>`, and the type of the message with its
hash. They are not those of `rmw_zenoh`, whose keys carry domain, type and hash as well.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
import json

import zenoh

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.feeds.hearsay import Inbox, MODEL, Speaker, type_of
from rotorsoil_ros.wire.definitions import DIAGNOSTICS, type_hash
from rotorsoil_ros.wire.messages import DIAGNOSTICS_TOPIC

PREFIX = 'rotorsoil'
MODELS_EVERY = 5  # seconds, so that who comes later learns the channels


class ZenohSender:
    """
    Puts messages of the graph into Zenoh as they come.

    Nothing is dropped on the way: a router that is congested holds up this process, and the
    graph keeps for it what its queues hold.
    """

    def __init__(self, session: zenoh.Session) -> None:
        self._session = session
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._models: dict[str, bytes] = {}
        self._turn = 0

    def take(self, topic: str, cdr: bytes) -> None:
        """Send a message on."""
        found = Speaker.of(topic)
        if found is not None and found[1] == MODEL:
            self._models[topic] = cdr
        self._put(topic, cdr)

    def repeat(self) -> None:
        """Send the models again, every few times that this is asked; once a second it is."""
        self._turn = (self._turn + 1) % MODELS_EVERY
        if self._turn == 0:
            for topic, cdr in self._models.items():
                self._put(topic, cdr)

    def _put(self, topic: str, cdr: bytes) -> None:
        publisher = self._publishers.get(topic)
        if publisher is None:
            publisher = self._publishers[topic] = self._session.declare_publisher(
                key_of(topic), congestion_control=zenoh.CongestionControl.BLOCK)
        publisher.put(bytes(cdr), attachment=attachment_of(topic))


@contextmanager
def hearing(session: zenoh.Session, inbox: Inbox) -> Iterator[None]:
    """Put what comes from other halls into an inbox."""
    def hear(sample: zenoh.Sample) -> None:
        inbox.take(topic_of(str(sample.key_expr)), sample.payload.to_bytes())

    subscriber = session.declare_subscriber(f'{PREFIX}/**', hear)
    try:
        yield
    finally:
        subscriber.undeclare()  # type: ignore[no-untyped-call]


@contextmanager
def joined(
    *, connect: Sequence[str] = (), listen: Sequence[str] = (), wait: Callable[[str], object],
) -> Iterator[zenoh.Session]:
    """
    Be one of several halls: connect to a router or to another hall, or be found by them.

    Parameters
    ----------
    connect, listen : sequence of str
        Where they are; where others find this one.
    wait : callable
        Called with a word on who is not there, before they are looked for again. Who goes away
        later is found again by the session itself.

    Raises
    ------
    InputError
        If an endpoint is none, or cannot be listened at.

    """
    session = None
    while session is None:
        try:
            session = zenoh.open(_configured(connect, listen))
        except zenoh.ZError as error:
            # What follows the name of a file of the library is for its authors.
            said = ' '.join(str(error).split(' at /')[0].rpartition('msg: "')[2].split())
            if not said.startswith('Unable to connect'):
                raise InputError(f'--connect, --listen, --zenoh: {said}') from error
            wait(f'{", ".join(connect)}: nobody answers')
    try:
        yield session
    finally:
        session.close()  # type: ignore[no-untyped-call]


def _configured(connect: Sequence[str], listen: Sequence[str]) -> zenoh.Config:
    """Return what a session is to be: a client, which every router serves, unless it listens."""
    config = zenoh.Config()
    for key, value in (
            ('mode', 'peer' if listen else 'client'), ('scouting/multicast/enabled', False),
            ('connect/endpoints', list(connect)), ('listen/endpoints', list(listen)),
            ('connect/timeout_ms', 0)):
        config.insert_json5(key, json.dumps(value))
    return config


def key_of(topic: str) -> str:
    """Return the key expression of a topic."""
    return f'{PREFIX}{topic}'


def topic_of(key: str) -> str:
    """Return the topic of a key expression."""
    return key.removeprefix(PREFIX)


def attachment_of(topic: str) -> bytes:
    """Return what says of which type the bytes are."""
    found = Speaker.of(topic)
    kind = DIAGNOSTICS if topic == DIAGNOSTICS_TOPIC else type_of(found[1] if found else '')
    return f'type={kind};hash={type_hash(kind)}'.encode()
