"""Machines that are watched without ROS, and the board of a feed that hears of them."""

import math
import socket
from threading import Event, Thread
import time

import numpy as np

from rotorsoil_ros.events import Diagnostics, Level, Measured, Model
from rotorsoil_ros.feeds.board import Board
from rotorsoil_ros.feeds.hearsay import Inbox
from rotorsoil_ros.feeds.running import Clocks
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.wire.messages import (
    diagnostic_array,
    DIAGNOSTICS_TOPIC,
    Encoder,
    JointStateWriter,
    Messenger,
    NODE_NAME,
    Topics,
)

SECOND = 10**9
START = 1_700_000_000 * SECOND
RUNNING = 200.0  # rad/s, inside the table of the paper's rotor
DEADLINE_S = 600.0


class Plant:
    """A machine that is watched, an inbox that hears what is told of it, and its board."""

    def __init__(self, machine, *, name='fan', namespace='', plant=False, inbox=None):
        self.machine, self.name = machine, name
        self.topics = Topics.of(namespace, name)
        self.inbox = inbox or Inbox()
        self.board = Board(self.inbox, plant=plant)
        self.start()

    def start(self):
        """Begin to watch, as a node that has just started."""
        encoder = Encoder(self.name, self.machine.table.channels, self.topics)
        self.monitor = Monitor(self.name, self.machine.table, self.machine.case.unbalance,
                               sinks=[Messenger(encoder, [self.hear])])
        self.monitor.begin(START, {'channels': list(self.machine.table.channels)})

    def hear(self, records):
        for payload in records.payloads:
            self.inbox.take(records.topic, payload)

    def turns(self, at_s, *speeds):
        stamps = [START + round(at_s * SECOND) + number for number in range(len(speeds))]
        self.monitor.on_speed(np.array(stamps), np.array(speeds))

    def measures(self, at_s, factor, channel):
        """Measure a multiple of the prediction at RUNNING."""
        vector = factor * self.expected(channel, RUNNING)
        for quantity, value in (('amplitude', abs(vector)), ('phase', np.angle(vector))):
            self.monitor.on_measured(Measured(
                self.name, quantity, np.array([START + round(at_s * SECOND)]), (channel,),
                np.array([[value]]), np.array([[math.nan]])))

    def ticks(self, at_s):
        self.monitor.tick(START + round(at_s * SECOND), stale_after_s=3.0)

    def vibrates(self, at_s, values, level=Level.OK):
        """Have the node say something of what is measured."""
        part = Diagnostics(self.name, START + round(at_s * SECOND), level, 'zone B', values,
                           'vibration')
        self.inbox.take(DIAGNOSTICS_TOPIC, diagnostic_array(part, node=self.topics.node))

    def reshapes(self, channels):
        self.hear(next(Encoder(self.name, channels, self.topics).encode(
            Model(self.name, START, {'channels': list(channels)}))))

    def expected(self, channel, speed):
        answer = self.machine.table.predictor(self.machine.case.unbalance).predict(
            np.array([speed]))
        return complex(answer.displacement[0, self.machine.table.channels.index(channel)])

    def at(self, at_s=0.0):
        """Refresh at a time; return the machine."""
        self.board.refresh(round(at_s * SECOND))
        (machine,) = self.board.machines.values()
        return machine


def totals(inbox, plant, at_s, told, level=Level.OK):
    """Have the machines of a plant do something together: displacement and velocity by channel."""
    stamp_ns = START + round(at_s * SECOND)
    if told:
        values = np.array([[*zip(*((size, velocity, math.nan)
                                   for size, velocity in told.values()), strict=True)]])
        [payload] = JointStateWriter([*told], plant).write([stamp_ns], values)
        inbox.take(f'/{NODE_NAME}/{plant}/total', payload)
    inbox.take(DIAGNOSTICS_TOPIC, diagnostic_array(
        Diagnostics(plant, stamp_ns, level, 'at least', {}), node=NODE_NAME))


class Hands:
    """A clock that somebody else sets."""

    def __init__(self):
        self.now_s = 0.0
        self.clock = Clocks(lambda: round(self.now_s * SECOND),
                           lambda: START + round(self.now_s * SECOND))


class Running:
    """An outlet at work, and what it says."""

    def __init__(self, outlet, board, clock):
        self.stop, self.said, self.failure = Event(), [], None
        self._thread = Thread(target=self._run, args=(outlet, board, clock), daemon=True)
        self._thread.start()

    def _run(self, outlet, board, clock):
        try:
            outlet.run(board, clock=clock, stop=self.stop, ready=self.said.append)
        except Exception as error:  # noqa: BLE001 - a test asks for it
            self.failure = error

    @property
    def is_alive(self):
        return self._thread.is_alive()

    def end(self):
        self.stop.set()
        self._thread.join(DEADLINE_S)
        assert not self._thread.is_alive()


def until(holds, what='what was awaited'):
    """Wait until something holds; fail at a deadline that only a hang reaches."""
    deadline = time.monotonic() + DEADLINE_S
    while not (found := holds()):
        assert time.monotonic() < deadline, f'{what} did not happen'
        time.sleep(0.01)
    return found


def free_port():
    """Return a port that nobody uses."""
    with socket.socket() as probe:
        probe.bind(('127.0.0.1', 0))
        return probe.getsockname()[1]
