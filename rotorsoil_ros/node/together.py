"""What the machines of one plant do together, told once a second."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
import math
from typing import NamedTuple

import numpy as np
from rclpy.lifecycle import LifecycleNode, LifecyclePublisher
from sensor_msgs.msg import JointState

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.plant.together import Shaken
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Diagnostics, Event, Level, Predicted
from rotorsoil_ros.node.run_log import RunLog
from rotorsoil_ros.wire.definitions import DIAGNOSTICS, JOINT_STATE, ros_name
from rotorsoil_ros.wire.messages import diagnostic_array, JointStateWriter, Records
from rotorsoil_ros.wire.speeds import SpeedSource


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
    A machine that is silent, stands or has no answer adds nothing, which /diagnostics says.
    """

    def __init__(
        self, node: LifecycleNode, plant: str, names: Sequence[str],
        channels: tuple[Channel, ...], *, log: RunLog, diagnostics: LifecyclePublisher,
    ) -> None:
        self._node, self._plant, self._names, self._channels = node, plant, names, channels
        self._log, self._diagnostics = log, diagnostics
        self._writer = JointStateWriter(channels, plant)
        self._publisher = node.create_lifecycle_publisher(JointState, f'~/{plant}/total', 10)
        self._parts: dict[str, _Part] = {}
        # Ticks, of a second each, since the last answer.
        self._quiet = dict[str, float].fromkeys(names, math.inf)

    def destroy(self) -> None:
        """Leave the graph."""
        self._node.destroy_lifecycle_publisher(self._publisher)

    def adds(self, name: str) -> bool:
        """Whether a machine is one of the plant."""
        return name in self._names

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
        if not self._publisher.is_activated:
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
        self._send(self._diagnostics, DIAGNOSTICS, now_ns, diagnostic_array(Diagnostics(
            self._plant, now_ns, Level.WARN if silent else Level.OK, summary,
            dict(_values(found)) if heard else {})))
        self._quiet = {name: ticks + 1 for name, ticks in self._quiet.items()}

    def _tell(self, found: Shaken, heard: Mapping[str, _Part]) -> None:
        stamp_ns = max(part.stamp_ns for part in heard.values())
        forces = np.sum([np.abs(part.force) for part in heard.values()], axis=0)
        [payload] = self._writer.write(
            [stamp_ns], np.stack([found.highest, found.velocity_rms, forces])[None])
        self._send(self._publisher, JOINT_STATE, stamp_ns, payload)

    def _send(
        self, publisher: LifecyclePublisher, kind: str, stamp_ns: int, payload: bytes,
    ) -> None:
        publisher.publish(payload)
        self._log.write(Records(publisher.topic_name, kind, [stamp_ns], [payload]))


def geared(source: SpeedSource, case: Case) -> SpeedSource:
    """Return what tells the speed of a machine: of a geared one its master, unless it is said."""
    if case.berth is None or case.berth.geared is None or source.topic:
        return source
    master, times = case.berth.geared
    return replace(source, topic=f'{master}/joint_states', type=ros_name(JOINT_STATE),
                   ratio=times * source.ratio)


def _values(found: Shaken) -> Iterator[tuple[str, float | str]]:
    """Yield who shakes whom, and which machines beat."""
    for column, channel in enumerate(found.channels):
        if channel.is_housing:
            yield f'{channel} share', ', '.join(f'{name} {share:.1%}' for name, share in zip(
                found.sources, found.share[:, column].tolist(), strict=True))
    for beat in found.beats():
        yield f'beat of {beat.first} and {beat.second} [s]', beat.period_s
        yield (f'beat of {beat.first} and {beat.second} at {beat.channel} [m]',
               f'{beat.lowest:.4g} to {beat.highest:.4g}')
