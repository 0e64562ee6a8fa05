"""What the node answers, told to a control room until somebody stops it."""

from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
import sys
import time
from typing import TYPE_CHECKING

from rotorsoil_ros.cli.arguments.options import PLANT
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.stop import Stop

if TYPE_CHECKING:
    from rotorsoil_ros.feeds.hearsay import Inbox
    from rotorsoil_ros.feeds.running import Outlet

FAILED = 1
SECOND_S = 1.0


def opcua(arguments: Namespace) -> int:
    """Serve OPC UA."""
    with _needs('opcua'):
        from rotorsoil_ros.feeds.opcua import OpcUaOutlet, OpcUaSettings

    return _feed(arguments, OpcUaOutlet(OpcUaSettings(
        arguments.endpoint, certificate=arguments.certificate, key=arguments.key,
        trusted=arguments.trusted, users=arguments.users, is_open=arguments.insecure,
        period_s=arguments.period)))


def mqtt(arguments: Namespace) -> int:
    """Be an edge node of Sparkplug B."""
    with _needs('mqtt'):
        from rotorsoil_ros.feeds.mqtt import MqttOutlet, MqttSettings

    host, port = arguments.broker
    return _feed(arguments, MqttOutlet(MqttSettings(
        host, port, group=arguments.group, node=arguments.edge_node, authority=arguments.ca,
        certificate=arguments.certificate, key=arguments.key, user=arguments.user,
        password_file=arguments.password_file, primary_host=arguments.primary_host,
        state=arguments.state, period_s=arguments.period)))


def zenoh(arguments: Namespace) -> int:
    """Send the topics of the graph on."""
    with _needs('zenoh'):
        from rotorsoil_ros.feeds.halls import joined, ZenohSender

    with _needs('ros'):
        from rotorsoil_ros.node.listener import listening

    if not arguments.connect and not arguments.listen:
        raise InputError('--connect or --listen is missing: where other halls are')
    stop = Stop()
    wait = _patience(stop, lambda: '')
    with suppress(KeyboardInterrupt), joined(
            connect=arguments.connect, listen=arguments.listen, wait=wait) as session:
        sender = ZenohSender(session)
        with listening(sender, every=True) as listener:
            while not stop.requested:
                listener.hear(SECOND_S)
                sender.repeat()
    return 0


def _feed(arguments: Namespace, outlet: 'Outlet') -> int:
    """Hear the graph, or other halls, and tell, until a signal comes or the outlet fails."""
    from rotorsoil_ros.feeds.hearsay import Inbox
    from rotorsoil_ros.feeds.running import Clocks, feed, telling

    stop, inbox = Stop(), Inbox()
    clock = Clocks(time.monotonic_ns, time.time_ns)
    with suppress(KeyboardInterrupt), telling(
            outlet, inbox, plant=arguments.units == PLANT, clock=clock) as told, _heard(
            arguments, inbox, _patience(stop, lambda: told.failure)) as hear:
        if not feed(hear, told, until=lambda: stop.requested):
            if told.failure:
                raise InputError(told.failure)
            return FAILED
    return 0


def _patience(stop: Stop, failure: Callable[[], str]) -> Callable[[str], None]:
    """Return what says once who is not there, and waits; a signal or a failure ends that."""
    told = set[str]()

    def wait(said: str) -> None:
        if said not in told:
            told.add(said)
            print(f'{said}; trying again', file=sys.stderr)
        with stop.interrupting():
            time.sleep(SECOND_S)
        if failure():
            raise InputError(failure())
    return wait


@contextmanager
def _heard(
    arguments: Namespace, inbox: 'Inbox', wait: Callable[[str], None],
) -> 'Iterator[Callable[[float], object]]':
    """Yield what waits while messages come into an inbox, for so many seconds."""
    if arguments.zenoh:
        with _needs('zenoh'):
            from rotorsoil_ros.feeds.halls import hearing, joined

        with joined(connect=arguments.zenoh, wait=wait) as session, hearing(
                session, inbox):
            yield time.sleep
    else:
        with _needs('ros'):
            from rotorsoil_ros.node.listener import listening

        with listening(inbox) as listener:
            yield listener.hear


@contextmanager
def _needs(extra: str) -> Iterator[None]:
    """Say which extra brings what a block imports."""
    try:
        yield
    except ImportError as error:
        raise InputError(f'{error.name or error} is not installed: '
                         f"pip install 'rotorsoil_ros[{extra}]'") from error
