"""What the machines of one plant do together, told once a second."""

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
import math
from typing import NamedTuple

from diagnostic_msgs.msg import DiagnosticArray
import numpy as np
from rclpy.lifecycle import LifecycleNode, LifecyclePublisher
from sensor_msgs.msg import JointState

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.together import Beat, plants_of, Shaken
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import Diagnostics, Event, Level, Predicted
from rotorsoil_ros.monitor.beside.companions import companions_of
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.node.hearing import Told
from rotorsoil_ros.node.run_log import RunLog
from rotorsoil_ros.node.settings import Settings
from rotorsoil_ros.wire.definitions import DIAGNOSTICS, JOINT_STATE, ros_name
from rotorsoil_ros.wire.messages import JointStateWriter, Records, statuses
from rotorsoil_ros.wire.speeds import USUAL


class _Part(NamedTuple):
    """Last answer of one machine."""

    stamp_ns: int
    speed: float
    displacement: ComplexArray
    force: ComplexArray


class Together:
    """
    Adds up the last answers of the machines of one plant, each at its own frequency.

    On `~/<plant>/total` velocity is the root of the sum of squares of all parts [m/s rms],
    position and effort are the sums of their amplitudes, which their peaks reach where they meet.
    On `~/<plant>/<machine>/share` position is the share of one machine in the square of the
    velocity of every housing [-], and velocity its own part [m/s rms]. On `~/<plant>/beats` is a
    status for every two machines whose speeds are close.
    A machine that is silent, stands or has no answer adds nothing, which /diagnostics says.

    Attributes
    ----------
    name : str
        Of the plant, first part of its topics.
    monitors : dict of Monitor
        Of its machines, by their names, in the order of the case.

    """

    def __init__(
        self, node: LifecycleNode, name: str, machines: Mapping[str, Machine], *, log: RunLog,
        diagnostics: LifecyclePublisher,
    ) -> None:
        self.name = name
        self.monitors: dict[str, Monitor] = {}
        self._node, self._names = node, tuple(machines)
        self._log, self._diagnostics = log, diagnostics
        create = node.create_lifecycle_publisher
        self._total = create(JointState, f'~/{name}/total', 10)
        self._beats = create(DiagnosticArray, f'~/{name}/beats', 10)
        self._shares = {one: create(JointState, f'~/{one}/share', 10) for one in machines}
        # Ticks, of a second each, since the last answer.
        self._quiet = dict[str, float].fromkeys(machines, math.inf)
        self.take_channels(next(iter(machines.values())).table.channels)

    def take_channels(self, channels: tuple[Channel, ...]) -> None:
        """Add up these channels from now on; nothing is known of them yet."""
        self._channels = channels
        self._housings = [column for column, channel in enumerate(channels)
                          if channel.is_housing]
        self._writer = JointStateWriter(channels, self.name)
        self._share_writers = {one: JointStateWriter(
            [channels[column] for column in self._housings], one) for one in self._names}
        self._parts: dict[str, _Part] = {}

    def join(self, monitor: Monitor) -> None:
        """Know the monitor of one of the machines."""
        self.monitors[monitor.machine] = monitor

    def destroy(self) -> None:
        """Leave the graph."""
        for publisher in (self._total, self._beats, *self._shares.values()):
            self._node.destroy_lifecycle_publisher(publisher)

    def __call__(self, event: Event) -> None:
        """Keep the last answer of a machine."""
        if isinstance(event, Predicted) and len(event.stamp_ns):
            found = event.prediction
            # One that was loaded again may have other channels: it is named as silent.
            if found.parts.shape[-1] == len(self._channels):
                self._parts[event.machine] = _Part(
                    int(event.stamp_ns[-1]), float(found.speed[-1]), found.displacement[-1],
                    found.force[-1])
                self._quiet[event.machine] = 0

    def tick(self, now_ns: int, *, stale_after_s: float) -> None:
        """Tell the total if an answer came, and who is in it; called once a second."""
        if not self._total.is_activated:
            return
        # In the order of the case, whoever spoke first.
        heard = {name: part for name in self._names if (part := self._parts.get(name)) is not None
                 and self._quiet[name] <= stale_after_s and part.speed > 0.0
                 and np.isfinite(part.displacement).all()}
        found = Shaken(tuple(heard), self._channels,
                       np.array([part.speed for part in heard.values()]),
                       np.array([part.displacement for part in heard.values()]))
        if heard and not all(self._quiet.values()):
            self._tell(found, heard)
        silent = [name for name in self._names if name not in heard]
        summary = (f'{", ".join(heard)} together' if not silent else
                   f'at least: nothing of {", ".join(silent)}')
        level = Level.OK if not silent else Level.WARN if heard else Level.STALE
        self._report(self._diagnostics, [Diagnostics(self.name, now_ns, level, summary, {})],
                     now_ns)
        self._quiet = {name: ticks + 1 for name, ticks in self._quiet.items()}

    def _tell(self, found: Shaken, heard: Mapping[str, _Part]) -> None:
        stamp_ns = max(part.stamp_ns for part in heard.values())
        forces = np.sum([np.abs(part.force) for part in heard.values()], axis=0)
        self._states(self._total, self._writer, stamp_ns, found.highest, found.velocity_rms,
                     forces)
        none = np.full(len(self._housings), np.nan)
        for name, share, own in zip(found.sources, found.share[:, self._housings],
                                    found.own_rms[:, self._housings], strict=True):
            self._states(self._shares[name], self._share_writers[name], stamp_ns, share, own,
                         none)
        self._report(self._beats, [_beat(self.name, stamp_ns, each) for each in found.beats()],
                     stamp_ns)

    def _states(
        self, publisher: LifecyclePublisher, writer: JointStateWriter, stamp_ns: int,
        *values: FloatArray,
    ) -> None:
        """Send one JointState of position, velocity and effort."""
        self._send(publisher, JOINT_STATE, stamp_ns,
                   *writer.write([stamp_ns], np.stack(values)[None]))

    def _report(
        self, publisher: LifecyclePublisher, found: Sequence[Diagnostics], stamp_ns: int,
    ) -> None:
        self._send(publisher, DIAGNOSTICS, stamp_ns, statuses(
            found, stamp_ns, node=self._node.get_fully_qualified_name().strip('/')))

    def _send(
        self, publisher: LifecyclePublisher, kind: str, stamp_ns: int, payload: bytes,
    ) -> None:
        publisher.publish(payload)
        self._log.write(Records(publisher.topic_name, kind, [stamp_ns], [payload]))


def acquaint(
    names: Collection[str], machines: Mapping[str, Machine], monitors: Mapping[str, Monitor],
) -> None:
    """
    Let machines, and those on the same blocks, know what the others do at the speeds told of them.

    Parameters
    ----------
    names : collection of str
        Machines that are new, or others than before.
    machines, monitors : mapping
        By name all machines that are watched.

    """
    plants = plants_of(machines)
    alone = {name: {name: machine} for name, machine in machines.items()
             if not any(name in among for among in plants.values())}
    for among in (plants | alone).values():
        known = {machine.case.name: machine for machine in among.values()}
        told = {machine.case.name: monitors[name] for name, machine in among.items()}
        for name, machine in among.items() if among.keys() & set(names) else ():
            monitors[name].stand_beside(companions_of(machine, [*machine.others(known)], told))


def _beat(plant: str, stamp_ns: int, beat: Beat) -> Diagnostics:
    """Say how two machines beat."""
    summary = (f'beat of {beat.period_s:.3g} s' if math.isfinite(beat.period_s) else
               'equally fast') + f', worst at {beat.channel}'
    return Diagnostics(plant, stamp_ns, Level.OK, summary, {
        'period_s': beat.period_s, 'channel': str(beat.channel),
        'lowest_m': f'{beat.lowest:.6g}', 'highest_m': f'{beat.highest:.6g}'},
        name=f'{beat.first} and {beat.second}')


def refuse_clashes(
    plants: Mapping[str, Mapping[str, Machine]], machines: Mapping[str, Machine],
) -> None:
    """Raise InputError where machines that are entries of their own cannot be added up."""
    for plant, among in plants.items():
        if fault := _clash(plant, among, machines):
            raise InputError(f'parameter machines: {", ".join(among)} cannot be told together as '
                             f'{plant}: {fault}; name a plant once, as machines: [{plant}]')


def _clash(plant: str, among: Mapping[str, Machine], machines: Mapping[str, Machine]) -> str:
    """Say why machines cannot be added up under a name; nothing if they can."""
    if plant in {name.partition('/')[0] for name in machines.keys() - among.keys()}:
        return f'{plant} is another machine or plant'
    if len({machine.table.channels for machine in among.values()}) > 1:
        return 'they are of different plants'
    sources = Counter(machine.case.name for machine in among.values())
    return ', '.join(f'{source} is there {count} times'
                     for source, count in sources.items() if count > 1)


def told_of(
    name: str, machines: Mapping[str, Machine], plants: Mapping[str, Mapping[str, Machine]],
    settings: Settings,
) -> Told:
    """
    Return what tells the speed of a machine.

    Of one in a plant its own topics and joint_states of the plant; of a geared one what tells
    the speed of its master, unless its own parameters say otherwise.

    Parameters
    ----------
    name : str
        Whose speed.
    machines, plants : mapping
        All machines by name, and those of every plant.
    settings : Settings
        What the parameters say.

    """
    own, berth = settings.speed(name), machines[name].case.berth
    if berth is not None and berth.geared is not None and own == USUAL:
        source, times = berth.geared
        master = next((one for among in plants.values() if name in among
                       for one, each in among.items() if each.case.name == source), '')
        told = (told_of(master, machines, plants, settings) if master else
                Told(source, (USUAL,)))
        return told._replace(sources=tuple(
            replace(each, ratio=times * each.ratio) for each in told.sources))
    plant = name.rpartition('/')[0]
    if not plant or own.topic or own.fits(JOINT_STATE):
        return Told(name, (own,))
    shared = f'{plant}/joint_states'
    return Told(name, (own, replace(own, topic=shared, type=ros_name(JOINT_STATE),
                                    joint=settings.joint_in_plant(name))), shared)
