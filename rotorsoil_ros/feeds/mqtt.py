"""An edge node of Sparkplug B at a broker: it is born, tells, dies, and comes back."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import json
import logging
from pathlib import Path
import ssl
from threading import Event

from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion, MQTTErrorCode
from paho.mqtt.reasoncodes import ReasonCode

from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.feeds.board import Board, MachineBoard
from rotorsoil_ros.feeds.points import Point
from rotorsoil_ros.feeds.running import Clocks
from rotorsoil_ros.feeds.sparkplug import (
    asks_for_rebirth,
    EdgeNode,
    Message,
    names_of,
    NAMESPACE_B,
    NS_IN_MS,
)

KEEP_ALIVE_S = 15  # within one and a half of it a broker notices that nobody is there
ANSWER_S = 10.0  # that a broker may take to say who it is
TURN_S = 0.1
BACK_OFF_S = (1.0, 2.0, 5.0, 10.0, 30.0, 60.0)
PORT, TLS_PORT = 1883, 8883
# Of a broker of MQTT 3.1.1 or 5 that does not know the name, or the password.
REFUSED = ('Bad user name or password', 'Not authorized')


@dataclass(frozen=True, slots=True)
class MqttSettings:
    """
    Which broker, and how the edge node is called there.

    Attributes
    ----------
    host, port : str, int
        The broker; port 0: the usual one.
    group, node : str
        Group and edge node of the topics.
    authority : Path or None
        Certificate of who has signed the broker's; with it the connection is encrypted.
    certificate, key : Path or None
        Of the edge node, where the broker wants one.
    user, password_file : str, Path or None
        What the broker wants to know.
    primary_host : str
        Who has to be online before anything is told; empty: nobody.
    state : Path or None
        File that keeps the number of the connection over restarts.
    period_s : float
        How often what has changed is told [s].

    """

    host: str
    port: int = 0
    group: str = 'rotorsoil'
    node: str = 'rotorsoil'
    authority: Path | None = None
    certificate: Path | None = None
    key: Path | None = None
    user: str = ''
    password_file: Path | None = None
    primary_host: str = ''
    state: Path | None = None
    period_s: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        for option, name in (('--group', self.group), ('--edge-node', self.node),
                             ('--primary-host', self.primary_host or 'none')):
            if wrong := names_of([name]):
                raise InputError(f'{option}: {wrong}')
        if (self.certificate is None) != (self.key is None):
            raise InputError('--certificate and --key: one needs the other')
        if self.certificate is not None and self.authority is None:
            raise InputError('--certificate: needs --ca, who has signed the certificate of the '
                             'broker')
        if self.password_file is not None and not self.user:
            raise InputError('--password-file: needs --user')

    @property
    def address(self) -> tuple[str, int]:
        """Host and port."""
        return self.host, self.port or (TLS_PORT if self.authority else PORT)


class SessionError(Exception):
    """Why a connection has ended or has not begun; another one is tried."""


class MqttOutlet:
    """
    Tells a board to a broker, one connection after the other.

    Parameters
    ----------
    settings : MqttSettings
        Which broker, and under which names.

    """

    def __init__(self, settings: MqttSettings) -> None:
        self.settings = settings
        self.tls = None if settings.authority is None else _context(settings)
        self.password = _password(settings.password_file)
        self._has_been = False
        self._told = ''

    def run(
        self, board: Board, *, clock: Clocks, stop: Event, ready: Callable[[str], object],
    ) -> None:
        """Tell until it is asked to stop; raise InputError if the broker knows no such user."""
        edge = EdgeNode(self.settings.group, self.settings.node,
                        bd_seq=_number(self.settings.state))
        host, port = self.settings.address
        how = 'encrypted' if self.tls else 'not encrypted'
        failures = 0
        while not stop.is_set():
            session = Session(self, edge, board, clock)
            try:
                for _ in session.steps(stop):
                    if session.is_born:
                        self._tell(f'Sparkplug B at {host}:{port}, {how}')
                        self._has_been, failures = True, 0
                        ready('')
            except (SessionError, OSError, ValueError) as error:
                if not self._has_been and str(error) in REFUSED:
                    raise InputError(f'--user: {host}:{port}: {error}') from error
                said = getattr(error, 'strerror', None) or error
                self._tell(f'{host}:{port}: {said}; trying again')
                stop.wait(BACK_OFF_S[min(failures, len(BACK_OFF_S) - 1)])
                failures += 1
            if session.has_asked:
                edge.connect_again()
                _keep(self.settings.state, edge.bd_seq)

    def _tell(self, text: str) -> None:
        """Say what has changed of the connection, once."""
        if text != self._told:
            self._told = text
            logging.getLogger(__name__).warning('%s', text)


class Session:
    """
    One connection, from the will to the farewell.

    It is worked on by whoever asks for its next step, in one thread, and waits for nobody: while
    the broker takes nothing, nothing is added to what waits for it.

    Attributes
    ----------
    has_asked, is_born : bool
        Whether a broker was asked to take the node in, and whether anything was told.

    """

    def __init__(self, outlet: MqttOutlet, edge: EdgeNode, board: Board, clock: Clocks) -> None:
        self.has_asked = self.is_born = False
        self._settings, self._edge = outlet.settings, edge
        self._board, self._clock = board, clock
        self._sent: dict[str, dict[tuple[str, str], Point]] = {}
        self._is_connected = False
        self._is_refused = ''
        self._wants_birth = False
        self._host_is_online, self._host_ms = not outlet.settings.primary_host, 0
        self._client = self._prepared(outlet)

    def steps(self, stop: Event) -> Iterator[None]:
        """Connect, tell until it is asked to stop, and say goodbye; yield between two turns."""
        host, port = self._settings.address
        self._client.connect(host, port, KEEP_ALIVE_S)
        self.has_asked = True
        began = due = self._clock.steady_ns()
        try:
            while not stop.is_set():
                self._turn()
                now = self._clock.steady_ns()
                if not self._is_connected and now - began > ANSWER_S * NANOSECONDS:
                    raise SessionError('the broker does not answer')
                if self._is_connected and now >= due and not self._client.want_write():
                    self._tell()
                    due = now + int(self._settings.period_s * NANOSECONDS)
                yield
        finally:
            self._leave()

    def _prepared(self, outlet: MqttOutlet) -> paho.Client:
        settings = self._settings
        client = paho.Client(
            CallbackAPIVersion.VERSION2, client_id=f'{settings.group}/{settings.node}',
            protocol=paho.MQTTv311, clean_session=True, reconnect_on_failure=False)
        if settings.user:
            client.username_pw_set(settings.user, outlet.password)
        if outlet.tls is not None:
            client.tls_set_context(outlet.tls)
        death = self._edge.death(self._now_ms())
        client.will_set(death.topic, death.payload, qos=1, retain=False)
        client.on_connect = self._connected
        client.on_message = self._commanded
        return client

    def _connected(
        self, client: paho.Client, data: object, flags: object, reason: ReasonCode,
        properties: object,
    ) -> None:
        del data, flags, properties
        if reason.is_failure:
            self._is_refused = str(reason)
            return
        self._is_connected = True
        client.subscribe(self._edge.command_topic(), qos=1)
        if self._settings.primary_host:
            client.subscribe(self._host_topic, qos=1)

    def _commanded(self, client: paho.Client, data: object, message: paho.MQTTMessage) -> None:
        del client, data
        if message.topic == self._edge.command_topic():
            self._wants_birth = self._wants_birth or asks_for_rebirth(bytes(message.payload))
        elif message.topic == self._host_topic:
            self._hear_host(bytes(message.payload))

    @property
    def _host_topic(self) -> str:
        return f'{NAMESPACE_B}/STATE/{self._settings.primary_host}'

    def _hear_host(self, payload: bytes) -> None:
        """Take in whether the primary host is online; what is older than the last word is not."""
        try:
            said = json.loads(payload)
            is_online, stamp_ms = bool(said['online']), int(said['timestamp'])
        except (ValueError, KeyError, TypeError):
            return
        if stamp_ms >= self._host_ms:
            self._host_is_online, self._host_ms = is_online, stamp_ms

    def _turn(self) -> None:
        code = self._client.loop(TURN_S)
        if self._is_refused:
            raise SessionError(self._is_refused)
        if code is not MQTTErrorCode.MQTT_ERR_SUCCESS:
            raise SessionError(paho.error_string(code).rstrip('.').lower())

    def _tell(self) -> None:
        """Tell what has changed since the last time, or everything where that is needed."""
        self._board.refresh(self._clock.steady_ns())
        changed: dict[str, list[Point]] = {}
        for point in self._board.settle():
            changed.setdefault(point.machine, []).append(point)
        if not self._host_is_online:
            if self.is_born:
                raise SessionError(f'{self._settings.primary_host} is offline')
            return
        if not self.is_born or self._wants_birth:
            self.is_born, self._wants_birth, self._sent = True, False, {}
            self._send(self._edge.birth(self._now_ms()))
        for machine in self._board.machines.values():
            self._tell_of(machine, changed.get(machine.name, []))

    def _tell_of(self, machine: MachineBoard, changed: list[Point]) -> None:
        sent, now_ms = self._sent.get(machine.name), self._now_ms()
        if machine.is_silent:
            if sent is not None:
                self._send(self._edge.device_death(machine.name, now_ms))
                del self._sent[machine.name]
        elif sent is None or sent.keys() != machine.points.keys():
            self._sent[machine.name] = dict(machine.points)
            self._send(self._edge.device_birth(machine.name, machine.points.values(), now_ms))
        elif news := [point for point in changed if not point.says_the_same(sent[point.key])]:
            sent.update((point.key, point) for point in news)
            self._send(self._edge.device_data(machine.name, news, now_ms))

    def _send(self, message: Message) -> None:
        sent = self._client.publish(message.topic, message.payload, qos=0, retain=False)
        if sent.rc is not MQTTErrorCode.MQTT_ERR_SUCCESS:
            raise SessionError(paho.error_string(sent.rc).rstrip('.').lower())

    def _leave(self) -> None:
        """Say that nothing more comes, as the will would, and hang up."""
        if self.is_born and self._client.is_connected():
            death = self._edge.death(self._now_ms())
            self._client.publish(death.topic, death.payload, qos=0, retain=False)
        self._client.disconnect()
        self._client.loop(TURN_S)

    def _now_ms(self) -> int:
        return self._clock.date_ns() // NS_IN_MS


def _context(settings: MqttSettings) -> ssl.SSLContext:
    """Return what encrypts; raise InputError where a file cannot be used."""
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    assert settings.authority is not None
    _loaded(settings.authority, lambda: context.load_verify_locations(settings.authority))
    if settings.certificate is not None and settings.key is not None:
        certificate, key = settings.certificate, settings.key
        for path in (certificate, key):
            path.open('rb').close()
        _loaded(certificate, lambda: context.load_cert_chain(
            certificate, key, password=lambda: ''))
    return context


def _loaded(path: Path, load: Callable[[], object]) -> None:
    try:
        load()
    except ssl.SSLError as error:
        raise InputError(f'{path}: must be a certificate in PEM, with its key '
                         f'({error.reason or error})') from error
    except OSError as error:
        raise InputError(f'{path}: {error.strerror}') from error


def _password(path: Path | None) -> str:
    return '' if path is None else path.read_text(encoding='utf-8').rstrip('\r\n')


def _number(path: Path | None) -> int:
    """Return the number of the next connection, as the last run has left it."""
    try:
        return int(path.read_text(encoding='utf-8')) if path is not None else 0
    except (OSError, ValueError):
        return 0


def _keep(path: Path | None, number: int) -> None:
    """Leave the number of the next connection for another run, if there is room for it."""
    if path is None:
        return
    try:
        path.write_text(f'{number}\n', encoding='utf-8')
    except OSError as error:
        logging.getLogger(__name__).warning('%s: %s', path, error.strerror)
