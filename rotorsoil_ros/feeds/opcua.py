"""A server of OPC UA that anybody may read and nobody may write."""

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
import hmac
import logging
from pathlib import Path
from threading import Event
from typing import Any, TypeVar
from urllib.parse import urlparse

from asyncua import Server, ua
from asyncua.crypto.permission_rules import PermissionRuleset, User, UserRole
from asyncua.crypto.truststore import TrustStore
from asyncua.crypto.validator import CertificateValidator, CertificateValidatorOptions
from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives import serialization

import rotorsoil_ros
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.feeds.address_space import AddressSpace, NAMESPACE
from rotorsoil_ros.feeds.board import Board
from rotorsoil_ros.feeds.running import Clocks

Read = TypeVar('Read')

APPLICATION_URI = 'urn:rotorsoil_ros:feed'
# What is kept for a client that subscribes and does not fetch: the last values, for ten minutes.
MOST_KEPT = {'max_subscriptions': 200, 'max_unacked_messages_per_subscription': 100,
          'max_monitored_item_queue_size': 10, 'max_lifetime_count': 6000}
LOOPBACK = ('127.0.0.1', 'localhost', '::1')
MOST_OTHERS = 0o077  # of the permissions of a file with passwords

# What a client may ask for: everything that reads, nothing that changes.
_READING = frozenset(ua.NodeId(getattr(ua.ObjectIds, f'{name}Request_Encoding_DefaultBinary'))
                     for name in (
    'CreateSession', 'ActivateSession', 'CloseSession', 'CloseSecureChannel', 'GetEndpoints',
    'FindServers', 'Read', 'Browse', 'BrowseNext', 'TranslateBrowsePathsToNodeIds',
    'RegisterNodes', 'UnregisterNodes', 'CreateSubscription', 'ModifySubscription',
    'DeleteSubscriptions', 'TransferSubscriptions', 'SetPublishingMode', 'Publish', 'Republish',
    'CreateMonitoredItems', 'ModifyMonitoredItems', 'DeleteMonitoredItems', 'SetMonitoringMode'))
_ENCRYPTED = [
    ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt,
    ua.SecurityPolicyType.Aes128Sha256RsaOaep_SignAndEncrypt,
    ua.SecurityPolicyType.Aes256Sha256RsaPss_SignAndEncrypt]


@dataclass(frozen=True, slots=True)
class OpcUaSettings:
    """
    Where a server listens, and whom it answers.

    Attributes
    ----------
    endpoint : str
        As in opc.tcp://127.0.0.1:4840.
    certificate, key : Path or None
        Of the server; with them it answers nobody who does not encrypt.
    trusted : Path or None
        Directory of the certificates of clients, or of who has signed them; None: any.
    users : Path or None
        Lines `name:password`; None: anybody may read.
    is_open : bool
        Answer the network without certificate.
    period_s : float
        How often values are renewed [s].

    """

    endpoint: str
    certificate: Path | None = None
    key: Path | None = None
    trusted: Path | None = None
    users: Path | None = None
    is_open: bool = False
    period_s: float = 1.0

    def __post_init__(self) -> None:
        """Refuse what cannot be meant."""
        parts = urlparse(self.endpoint)
        try:
            whole = parts.scheme == 'opc.tcp' and parts.hostname and parts.port is not None
        except ValueError:
            whole = False
        if not whole:
            raise InputError('--endpoint: must be opc.tcp://HOST:PORT, got '
                             f'{self.endpoint!r}')
        if (self.certificate is None) != (self.key is None):
            raise InputError('--certificate and --key: one needs the other')
        if self.certificate is None and self.trusted is not None:
            raise InputError('--trusted: needs --certificate and --key')
        if self.certificate is None and not self.is_open and parts.hostname not in LOOPBACK:
            raise InputError(
                f'--endpoint: {parts.hostname} is reached from the network, which needs '
                '--certificate and --key, or --insecure')


class OpcUaOutlet:
    """
    Tells a board to clients of OPC UA.

    Parameters
    ----------
    settings : OpcUaSettings
        Where and to whom.

    """

    def __init__(self, settings: OpcUaSettings) -> None:
        self._settings = settings
        self._users = None if settings.users is None else _users_of(settings.users)
        self._identity = None if settings.certificate is None or settings.key is None else (
            Identity.of(settings.certificate, settings.key))
        if settings.trusted is not None:
            if not settings.trusted.is_dir():
                raise InputError(f'--trusted: {settings.trusted}: must be a directory')
            for path in sorted(settings.trusted.iterdir()):
                _certificate(path)

    def run(
        self, board: Board, *, clock: Clocks, stop: Event, ready: Callable[[str], object],
    ) -> None:
        """Serve until it is asked to stop; raise InputError if it cannot begin."""
        # What clients do wrong is theirs; what we do wrong comes as an exception.
        logging.getLogger('asyncua').setLevel(logging.CRITICAL + 1)
        asyncio.run(self._serve(board, clock, stop, ready))

    async def _serve(
        self, board: Board, clock: Clocks, stop: Event, ready: Callable[[str], object],
    ) -> None:
        server = await self._prepared()
        space = AddressSpace(server, await server.register_namespace(NAMESPACE))
        await space.open()
        try:
            await server.start()
        except OSError as error:
            raise InputError(f'--endpoint: {self._settings.endpoint}: '
                             f'{error.strerror or error}') from error
        try:
            ready(f'OPC UA at {self._address(server)}, {self._who()}')
            while not stop.is_set():
                for machine in board.refresh(clock.steady_ns()):
                    await space.write(await space.take_shape(machine))
                await space.write(board.settle())
                await asyncio.to_thread(stop.wait, self._settings.period_s)
        finally:
            await server.stop()

    async def _prepared(self) -> Server:
        settings, server = self._settings, Server(user_manager=self)
        for limit, most in MOST_KEPT.items():
            setattr(server.iserver, limit, most)
        await server.init()
        server.set_endpoint(settings.endpoint)
        server.set_server_name('rotorsoil_ros')
        if self._identity is not None:
            await server.load_certificate(self._identity.certificate, 'der')
            await server.load_private_key(self._identity.key, format='der')
            server.set_certificate_validator(await self._validator())
        await server.set_application_uri(
            APPLICATION_URI if self._identity is None else self._identity.uri)
        server.set_security_policy(
            [ua.SecurityPolicyType.NoSecurity] if self._identity is None else _ENCRYPTED,
            permission_ruleset=ReadOnly())
        server.set_identity_tokens([ua.AnonymousIdentityToken if self._users is None
                                    else ua.UserNameIdentityToken])
        await server.set_build_info(APPLICATION_URI, 'rotorsoil_ros', 'rotorsoil_ros',
                                    rotorsoil_ros.__version__, '', ua.win_epoch_to_datetime(0))
        return server

    async def _validator(self) -> CertificateValidator:
        """Return what looks at the certificates of clients."""
        options = CertificateValidatorOptions.TIME_RANGE
        if self._settings.trusted is None:
            return CertificateValidator(options)
        store = TrustStore([self._settings.trusted], [])
        await store.load()
        return CertificateValidator(options | CertificateValidatorOptions.TRUSTED, store)

    def get_user(
        self, iserver: object, username: str | None = None, password: str | None = None,
        certificate: object = None,
    ) -> User | None:
        """Return who asks, if anybody may or the password is right."""
        del iserver, certificate
        if self._users is None:
            return User(role=UserRole.User)
        expected = self._users.get(username or '')
        given = password.decode(errors='replace') if isinstance(password, bytes) else password
        is_right = hmac.compare_digest((expected or '').encode(), (given or '').encode())
        return User(role=UserRole.User, name=username) if expected and is_right else None

    def _address(self, server: Server) -> str:
        """Return where it listens; of port 0 the system has chosen one."""
        parts = urlparse(self._settings.endpoint)
        port = server.bserver.port if server.bserver is not None else parts.port
        return f'opc.tcp://{parts.hostname}:{port}{parts.path}'

    def _who(self) -> str:
        who = 'anybody may read' if self._users is None else f'for {len(self._users)} users'
        return f'{"encrypted" if self._settings.certificate else "not encrypted"}, {who}'


@dataclass(frozen=True, slots=True)
class Identity:
    """Certificate and key of the server in DER, and how they call it."""

    certificate: bytes
    key: bytes
    uri: str

    @classmethod
    def of(cls, certificate: Path, key: Path) -> 'Identity':
        """Read both; raise InputError where they are not what they should be."""
        found = _certificate(certificate)
        secret = _read(
            key, 'a private key without password',
            pem=lambda content: serialization.load_pem_private_key(content, None),
            der=lambda content: serialization.load_der_private_key(content, None))
        if secret.public_key() != found.public_key():
            raise InputError(f'{key}: must be the key of {certificate}')
        try:
            names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
            uris = names.get_values_for_type(x509.UniformResourceIdentifier)
        except x509.ExtensionNotFound:
            uris = []
        return cls(
            found.public_bytes(serialization.Encoding.DER),
            secret.private_bytes(serialization.Encoding.DER, serialization.PrivateFormat.PKCS8,
                                 serialization.NoEncryption()),
            next(iter(uris), APPLICATION_URI))


class ReadOnly(PermissionRuleset):  # type: ignore[misc]
    """Lets everybody read and nobody do anything else."""

    def check_validity(self, user: User, action_type: ua.NodeId, body: Any) -> bool:
        """Return whether a service only reads."""
        return action_type in _READING


def _users_of(path: Path) -> dict[str, str]:
    """Return passwords by name."""
    if path.stat().st_mode & MOST_OTHERS:
        raise InputError(f'{path}: must be readable by its owner only (chmod 600)')
    users = {}
    for number, line in enumerate(path.read_text(encoding='utf-8').splitlines(), 1):
        name, colon, password = line.partition(':')
        if line.strip() and not (name and colon and password):
            raise InputError(f'{path}: line {number}: must be name:password')
        users[name] = password
    users.pop('', None)
    if not users:
        raise InputError(f'{path}: names no user')
    return users


def _certificate(path: Path) -> x509.Certificate:
    return _read(path, 'a certificate', pem=x509.load_pem_x509_certificate,
                 der=x509.load_der_x509_certificate)


def _read(
    path: Path, what: str, *, pem: Callable[[bytes], Read], der: Callable[[bytes], Read],
) -> Read:
    """Read a file in whichever of both forms it is."""
    try:
        content = path.read_bytes()
        return (pem if content.lstrip().startswith(b'-----BEGIN') else der)(content)
    except OSError as error:
        raise InputError(f'{path}: {error.strerror}') from error
    except (ValueError, TypeError, UnsupportedAlgorithm) as error:
        raise InputError(f'{path}: must be {what} in PEM or DER') from error
