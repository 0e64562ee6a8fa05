"""A broker of MQTT in a process of its own, a host that hears what is told, and certificates."""

import datetime
import ipaddress
from pathlib import Path
import shutil
import socket
import subprocess
import sys
from threading import Lock

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import rsa
from paho.mqtt import client as paho
from paho.mqtt.enums import CallbackAPIVersion
import pytest

from rotorsoil_ros.feeds.sparkplug import parse

from plants import until

# What a plant runs; where it is not installed, amqtt of the package index.
MOSQUITTO = shutil.which('mosquitto') or shutil.which('mosquitto', path='/usr/sbin')


class Broker:
    """A broker on this host that can be killed and started again."""

    def __init__(self, folder, port, *, tls=None, users=None):
        self.port = port
        self._folder, self._tls, self._users = Path(folder), tls, users
        self._process = None
        self.start()

    def start(self):
        if not MOSQUITTO:
            pytest.importorskip('amqtt', reason='neither mosquitto nor amqtt is installed')
        command = self._mosquitto() if MOSQUITTO else self._amqtt()
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL,
                                         stderr=subprocess.DEVNULL)
        until(self._answers, f'a broker at port {self.port}')

    def kill(self):
        self._process.kill()
        self._process.wait()

    def _answers(self):
        assert self._process.poll() is None, 'the broker has ended'
        try:
            socket.create_connection(('127.0.0.1', self.port), 1.0).close()
        except OSError:
            return False
        return True

    def _mosquitto(self):
        lines = [f'listener {self.port} 127.0.0.1',
                 f'allow_anonymous {str(not self._users).lower()}']
        if self._users:
            file = self._folder / 'passwords'
            file.write_text(''.join(f'{name}:{word}\n' for name, word in self._users.items()))
            subprocess.run(['mosquitto_passwd', '-U', file], check=True)
            lines += [f'password_file {file}']
        if self._tls:
            certificate, key = self._tls
            lines += [f'certfile {certificate}', f'keyfile {key}']
        (self._folder / 'mosquitto.conf').write_text('\n'.join([*lines, 'user root', '']))
        return [MOSQUITTO, '-c', str(self._folder / 'mosquitto.conf')]

    def _amqtt(self):
        listener = {'type': 'tcp', 'bind': f'127.0.0.1:{self.port}'}
        if self._tls:
            listener |= {'ssl': True, 'certfile': str(self._tls[0]), 'keyfile': str(self._tls[1])}
        plugins = {'amqtt.plugins.authentication.AnonymousAuthPlugin': {
            'allow_anonymous': not self._users}}
        if self._users:
            from pwdlib.hashers.argon2 import Argon2Hasher
            file = self._folder / 'passwords'
            file.write_text(''.join(f'{name}:{Argon2Hasher().hash(word)}\n'
                                    for name, word in self._users.items()))
            plugins['amqtt.plugins.authentication.FileAuthPlugin'] = {'password_file': str(file)}
        config = {'listeners': {'default': listener}, 'plugins': plugins}
        (self._folder / 'amqtt.yaml').write_text(repr(config))
        return [sys.executable, '-W', 'ignore', '-m', 'amqtt.scripts.broker_script', '-c',
                str(self._folder / 'amqtt.yaml')]


class Host:
    """A host application: it hears every message of a group, in their order."""

    def __init__(self, port, *, user='', password=''):
        self._lock, self.heard = Lock(), []
        self.client = paho.Client(CallbackAPIVersion.VERSION2, client_id='host')
        if user:
            self.client.username_pw_set(user, password)
        self._subscribed = []
        self.client.on_connect = lambda client, *_: client.subscribe('spBv1.0/#', qos=1)
        self.client.on_subscribe = lambda *_: self._subscribed.append(1)
        self.client.on_message = self._hear
        self.client.reconnect_delay_set(1, 1)
        self.client.connect('127.0.0.1', port)
        self.client.loop_start()
        until(lambda: self._subscribed, 'a subscription')

    def _hear(self, client, data, message):
        with self._lock:
            self.heard.append((message.topic.split('/'), bytes(message.payload)))

    def kinds(self):
        """Return what has come: kinds of messages, with the machine where there is one."""
        with self._lock:
            return ['/'.join([parts[2], *parts[4:]]) for parts, _ in self.heard]

    def payloads(self, kind):
        """Return the payloads of one kind."""
        with self._lock:
            return [parse(payload) for parts, payload in self.heard
                    if '/'.join([parts[2], *parts[4:]]) == kind]

    def last(self, kind):
        """Return the metrics of the last message of a kind, by name."""
        return {metric.name: metric for metric in self.payloads(kind)[-1].metrics}

    def wait_for(self, kind, count=1):
        until(lambda: self.kinds().count(kind) >= count, f'{count} {kind}')

    def say(self, topic, payload, *, retain=False):
        self.client.publish(topic, payload, qos=1, retain=retain).wait_for_publish(600)

    def close(self):
        self.client.disconnect()
        self.client.loop_stop()


def certified(folder, name, uri):
    """Write a certificate that nobody else has signed, and its key."""
    key = rsa.generate_private_key(public_exponent=65537, key_size=2048)
    subject = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, name)])
    begin = datetime.datetime(2020, 1, 1, tzinfo=datetime.UTC)
    usage = dict.fromkeys(('digital_signature', 'content_commitment', 'key_encipherment',
                           'data_encipherment', 'key_cert_sign'), True)
    certificate = (
        x509.CertificateBuilder().subject_name(subject).issuer_name(subject)
        .public_key(key.public_key()).serial_number(x509.random_serial_number())
        .not_valid_before(begin).not_valid_after(begin + datetime.timedelta(days=36500))
        .add_extension(x509.SubjectAlternativeName([
            x509.UniformResourceIdentifier(uri), x509.DNSName('localhost'),
            x509.IPAddress(ipaddress.ip_address('127.0.0.1'))]), critical=False)
        .add_extension(x509.BasicConstraints(ca=True, path_length=None), critical=True)
        .add_extension(x509.KeyUsage(**usage, key_agreement=False, crl_sign=False,
                                     encipher_only=False, decipher_only=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage([
            x509.ExtendedKeyUsageOID.SERVER_AUTH, x509.ExtendedKeyUsageOID.CLIENT_AUTH]),
            critical=False)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()),
                       critical=False)
        .sign(key, hashes.SHA256()))
    (folder / f'{name}.pem').write_bytes(certificate.public_bytes(serialization.Encoding.PEM))
    (folder / f'{name}_key.pem').write_bytes(key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8,
        serialization.NoEncryption()))
    return folder / f'{name}.pem', folder / f'{name}_key.pem'
