"""What may stand behind `rotorsoil feed`: which network, how it is reached, and who may read."""

import argparse
from pathlib import Path

from rotorsoil_ros.cli.arguments.options import add_verb, number, PLANT, SI, Verbs

PERIOD = number('a time > 0 s', above_zero=True)
BROKER = '127.0.0.1'
PORTS = 65535


def add_feeds(verbs: Verbs) -> None:
    """Add the verb, with one parser for each network."""
    feed = verbs.add_parser(
        'feed', help='tell what the node answers to a control room: OPC UA, MQTT, Zenoh',
        description='Tell what the node answers to those who do not speak ROS.')
    kinds = feed.add_subparsers(metavar='KIND', required=True)
    _add_opcua(kinds)
    _add_mqtt(kinds)
    _add_zenoh(kinds)
    for kind in kinds.choices.values():
        kind.set_defaults(options=list(kind._option_string_actions))


def _add_opcua(kinds: Verbs) -> None:
    opcua = add_verb(kinds, 'opcua', 'live.feed:opcua',
                     'serve values by OPC UA, to be read and never to be written', case=False)
    add = opcua.add_argument
    add('--endpoint', metavar='URL', default='opc.tcp://127.0.0.1:4840',
        help='where it listens (default: %(default)s); another address than that of this host '
             'needs a certificate')
    add('--certificate', metavar='FILE', type=Path,
        help='of the server, PEM or DER; with it whoever does not encrypt is not answered')
    add('--key', metavar='FILE', type=Path, help='its private key')
    add('--trusted', metavar='DIR', type=Path,
        help='certificates of clients, or of who has signed them (default: any)')
    add('--users', metavar='FILE', type=Path,
        help='lines name:password, readable by the owner only (default: anybody may read)')
    add('--insecure', action='store_true', help='answer a network without a certificate')
    _add_telling(opcua)


def _add_mqtt(kinds: Verbs) -> None:
    mqtt = add_verb(kinds, 'mqtt', 'live.feed:mqtt',
                    'tell values to a broker of MQTT, as an edge node of Sparkplug B', case=False)
    add = mqtt.add_argument
    add('--broker', metavar='HOST[:PORT]', type=broker, default=(BROKER, 0),
        help=f'the broker (default: {BROKER}; port 1883, encrypted 8883)')
    add('--group', metavar='NAME', default='rotorsoil', help='group (default: %(default)s)')
    add('--edge-node', metavar='NAME', default='rotorsoil',
        help='edge node, one for each feed at a broker (default: %(default)s)')
    add('--ca', metavar='FILE', type=Path,
        help='certificate of who has signed that of the broker; with it the connection is '
             'encrypted')
    add('--certificate', metavar='FILE', type=Path, help='of the edge node, if it needs one')
    add('--key', metavar='FILE', type=Path, help='its private key')
    add('--user', metavar='NAME', default='', help='of the edge node at the broker')
    add('--password-file', metavar='FILE', type=Path, help='file that holds its password')
    add('--primary-host', metavar='ID', default='',
        help='host application that must be online before anything is told')
    add('--state', metavar='FILE', type=Path,
        help='keeps the number of the connection (bdSeq) over restarts')
    _add_telling(mqtt)


def _add_zenoh(kinds: Verbs) -> None:
    zenoh = add_verb(kinds, 'zenoh', 'live.feed:zenoh',
                     "send the node's topics on to other halls, where --zenoh hears them",
                     case=False)
    zenoh.add_argument('--connect', metavar='LOCATOR', action='append', default=[],
                       help='router or other hall, as in tcp/router:7447; may be repeated')
    zenoh.add_argument('--listen', metavar='LOCATOR', action='append', default=[],
                       help='where others connect, as in tcp/0.0.0.0:7447; may be repeated')


def _add_telling(kind: argparse.ArgumentParser) -> None:
    kind.add_argument('--zenoh', metavar='LOCATOR', action='append', default=[],
                      help='hear a router or a hall, as in tcp/router:7447, and no ROS graph; '
                           'may be repeated')
    kind.add_argument('--period', metavar='S', type=PERIOD, default=1.0,
                      help='how often values are renewed [s] (default: %(default)s)')
    kind.add_argument('--units', choices=(PLANT, SI), default=PLANT,
                      help='plant: um peak-to-peak, mm/s rms, rpm, degrees of lag (default); '
                           'si: m and rad zero-to-peak, m/s rms, rad/s, rad of lead')


def broker(text: str) -> tuple[str, int]:
    """Return host and port; port 0 stands for the usual one."""
    host, colon, port = text.rpartition(':') if text.count(':') == 1 else (text, '', '0')
    if not host or not port.isdigit() or int(port) > PORTS or (colon and port == '0'):
        raise argparse.ArgumentTypeError(f'must be HOST or HOST:PORT, got {text!r}')
    return host, int(port)
