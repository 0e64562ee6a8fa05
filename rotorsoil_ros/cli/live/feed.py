"""What the node answers, told to a control room until somebody stops it."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
import time
from typing import TYPE_CHECKING

from rotorsoil_ros.cli.arguments.options import PLANT
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.stop import Stop

if TYPE_CHECKING:
    from rotorsoil_ros.feeds.running import Outlet

FAILED = 1


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


def _feed(arguments: Namespace, outlet: 'Outlet') -> int:
    """Hear the graph and tell, until a signal comes or the outlet fails."""
    from rotorsoil_ros.feeds.hearsay import Inbox
    from rotorsoil_ros.feeds.running import Clocks, feed, telling

    with _needs('ros'):
        from rotorsoil_ros.node.listener import listening

    stop, inbox = Stop(), Inbox()
    clock = Clocks(time.monotonic_ns, time.time_ns)
    with listening(inbox) as listener, telling(
            outlet, inbox, plant=arguments.units == PLANT, clock=clock) as told:
        is_well = feed(listener, told, until=lambda: stop.requested)
    if told.failure:
        raise InputError(told.failure)
    return 0 if is_well else FAILED


@contextmanager
def _needs(extra: str) -> Iterator[None]:
    """Say which extra brings what a block imports."""
    try:
        yield
    except ImportError as error:
        raise InputError(f'{error.name or error} is not installed: '
                         f"pip install 'rotorsoil_ros[{extra}]'") from error
