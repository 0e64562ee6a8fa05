"""A node that watches one machine, and what a test says to it and hears of it."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Thread
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.node.node import RotorsoilNode
from rotorsoil_ros.node.parameters import OF_MACHINE
from rotorsoil_ros.node.replay import replay
from rotorsoil_ros.testing.graph import AnyNode, Graph
from rotorsoil_ros.units import rpm_to_rad_s, to_mm_s_rms, to_um_pp
from rotorsoil_ros.wire.messages import NODE_NAME
from rotorsoil_ros.wire.speeds import ROTOR_JOINT

FIRST_NS = 1_700_000_000 * NANOSECONDS  # stamp of the first speed that nobody dates
STEP_NS = NANOSECONDS // 100


class TwinAnswer:
    """What the node answered to one speed: a JointState, read by channel."""

    def __init__(self, message: Any) -> None:
        self.message = message

    @property
    def stamp_ns(self) -> int:
        """The stamp of the speed [ns]."""
        stamp = self.message.header.stamp
        return int(stamp.sec * NANOSECONDS + stamp.nanosec)

    @property
    def channels(self) -> list[Channel]:
        """Where something was answered."""
        return [Channel.parse(name) for name in self.message.name]

    def __getitem__(self, channel: str) -> float:
        """Return what stands in `position`: displacement, zero-to-peak [m, rad], or phase."""
        return float(self.message.position[self._at(channel)])

    def velocity(self, channel: str) -> float:
        """Return what stands in `velocity`, zero-to-peak [m/s, rad/s], or rms [m/s]."""
        return float(self.message.velocity[self._at(channel)])

    def displacement_um_pp(self, channel: str) -> float:
        """Return a displacement [um peak-to-peak]."""
        return float(to_um_pp(np.asarray(self[channel])))

    def velocity_mm_s_rms(self, channel: str) -> float:
        """Return a velocity [mm/s rms]."""
        return float(to_mm_s_rms(np.asarray(self.velocity(channel))))

    def _at(self, channel: str) -> int:
        names = list(self.message.name)
        assert channel in names, f'{channel} is not answered; there are {", ".join(names)}'
        return names.index(channel)


class Speed:
    """The speed topic of a machine, as a test speaks on it."""

    def __init__(self, graph: Graph, topic: str) -> None:
        self._graph, self._topic = graph, topic
        self._publisher: Any = None
        self.sent_ns = FIRST_NS

    def send(
        self, *, rpm: float | Sequence[float] = (), rad_s: float | Sequence[float] = (),
        stamp_ns: int | None = None,
    ) -> None:
        """
        Tell one speed, or several one after the other, each 10 ms later.

        Parameters
        ----------
        rpm, rad_s : float or sequence of float
            In one unit or the other.
        stamp_ns : int or None
            Of the first; None: 10 ms after the one before.

        """
        if self._publisher is None:
            self._publisher = self._graph.speaker(self._topic, JointState)
        speeds = [*rpm_to_rad_s(np.atleast_1d(np.asarray(rpm, dtype=float))),
                  *np.atleast_1d(np.asarray(rad_s, dtype=float))]
        for number, value in enumerate(speeds):
            self.sent_ns = (self.sent_ns + STEP_NS if stamp_ns is None or number
                            else stamp_ns)
            message = JointState(name=[ROTOR_JOINT], velocity=[float(value)])
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(
                self.sent_ns, NANOSECONDS)
            self._publisher.publish(message)


class Heard:
    """A topic of answers, as a test waits for them."""

    def __init__(self, twin: 'Twin', topic: str) -> None:
        self._twin, self._name = twin, topic.rpartition('/')[2]
        self._messages = twin.graph.hear(topic, JointState)
        self._taken = 0

    def __len__(self) -> int:
        """How many have come."""
        return len(self._messages)

    def receive(self) -> TwinAnswer:
        """Return the next answer; wait for it."""
        self.wait_for(self._taken + 1)
        self._taken += 1
        return TwinAnswer(self._messages[self._taken - 1])

    def wait_for(self, count: int) -> list[TwinAnswer]:
        """Wait until so many answers have come; return all of them."""
        try:
            self._twin.graph.until(lambda: len(self._messages) >= count, f'{self._name}')
        except AssertionError as error:
            raise AssertionError(f'{error}; the node says: {self._twin.says}') from error
        return [TwinAnswer(message) for message in self._messages]


class Watched:
    """One machine, as a test speaks to it and hears of it."""

    def __init__(self, twin: 'Twin', name: str) -> None:
        answers = f'{twin.node.get_fully_qualified_name()}/{name}'
        self.speed = Speed(twin.graph, f'/{name}/joint_states')
        self.amplitude, self.phase, self.velocity_rms = (
            Heard(twin, f'{answers}/{told}') for told in ('amplitude', 'phase', 'velocity_rms'))


class Twin:
    """
    A node that watches a machine or a plant in a graph of its own, active when it is returned.

    `twin.speed`, `twin.amplitude`... are those of the machine, of a plant `twin['fan_1'].speed`...

    Parameters
    ----------
    graph : Graph
        Where.
    machine : str
        Its name, first part of its topics.
    case : Path or str
        Its case file, or the name of a shipped case.
    parameters : mapping
        Of the node; those of the machine without its name, as in `speed.unit`, of a plant
        `fan_1.speed.unit`.

    """

    def __init__(
        self, graph: Graph, machine: str, case: Path | str, parameters: Mapping[str, Any],
    ) -> None:
        self.graph, self.machine = graph, machine
        values = {'machines': [machine], f'{machine}.case': str(case), 'speed_depth': 1000,
                  'speed_reliability': 'reliable', 'log.rerun': False}
        values |= {f'{machine}.{name}' if {name, name.partition('.')[2]} & OF_MACHINE.keys()
                   else name: value for name, value in parameters.items()}
        others = sum(isinstance(node, RotorsoilNode) for node in graph.nodes)
        renamed = ['--ros-args', '-r', f'__node:={NODE_NAME}_{others + 1}'] if others else []
        self.node = graph.add(RotorsoilNode(
            context=graph.context, cli_args=renamed, parameter_overrides=[
                Parameter(name, value=value) for name, value in values.items()]))
        if not self.node.start():
            raise RotorSoilError(f'{machine}: the node did not start; it says why above')
        self.answers = f'{self.node.get_fully_qualified_name()}/{machine}'
        self._diagnostics = graph.hear('/diagnostics', DiagnosticArray)
        self._machines = {name.rpartition('/')[2]: Watched(self, name)
                          for name in self.node.settings.files[machine]}
        graph.settle()

    def __getitem__(self, name: str) -> Watched:
        """Return one machine of a plant."""
        return self._machines[name]

    @property
    def speed(self) -> Speed:
        """The speed topic of the machine."""
        return self._only.speed

    @property
    def amplitude(self) -> Heard:
        """Answers: amplitudes."""
        return self._only.amplitude

    @property
    def phase(self) -> Heard:
        """Answers: phases."""
        return self._only.phase

    @property
    def velocity_rms(self) -> Heard:
        """Answers: what zones judge."""
        return self._only.velocity_rms

    @property
    def _only(self) -> Watched:
        if self.machine not in self._machines:
            names = ', '.join(f'twin[{name!r}]' for name in self._machines)
            raise RotorSoilError(f'{self.machine} is a plant: ask one of its machines, {names}')
        return self._machines[self.machine]

    def hear(self, name: str) -> Heard:
        """Return what comes on another topic of JointStates below the name, as `total`."""
        heard = Heard(self, f'{self.answers}/{name}')
        self.graph.settle()
        return heard

    @property
    def context(self) -> Any:
        """The context in which nodes of a test have to be created."""
        return self.graph.context

    @property
    def says(self) -> str:
        """What the diagnostics of the machine said last."""
        told = [status.message for message in self._diagnostics for status in message.status
                if status.hardware_id == self.machine]
        return told[-1] if told else 'nothing yet'

    def add(self, node: AnyNode) -> AnyNode:
        """Let a node of the package under test take part."""
        return self.graph.add(node)

    def publisher(self, topic: str, kind: Any) -> Any:
        """Return a publisher of any topic that somebody hears."""
        return self.graph.speaker(topic, kind)

    def until(self, holds: Any, what: str = 'what was awaited') -> None:
        """Spin until something holds."""
        self.graph.until(holds, what)

    def replay(self, profile: Path | str, *, rate: float = 1000.0) -> int:
        """Publish a recorded profile, as `rotorsoil replay` does; return how many messages."""
        done: list[int | BaseException] = []

        def run() -> None:
            try:
                done.append(replay(Path(profile), rate=rate, context=self.context))
            except RotorSoilError as error:
                done.append(error)

        thread = Thread(target=run)
        thread.start()
        self.graph.until(lambda: not thread.is_alive(), f'the end of {profile}')
        [outcome] = done
        if isinstance(outcome, BaseException):
            raise outcome
        return outcome

    def release(self) -> None:
        """Finish its logs and leave the graph."""
        self.node.release()


