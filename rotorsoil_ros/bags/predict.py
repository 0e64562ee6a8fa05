"""What would the node have answered to a recorded profile? The same numbers, without a graph."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass, field
import math
import os
from pathlib import Path
from typing import Protocol

import numpy as np

from rotorsoil_ros.bags.feed import feed, Inputs, stand_beside
from rotorsoil_ros.bags.metadata import files
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.summary import unstable
from rotorsoil_ros.channel import ACROSS, Channel
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import Event, Predicted
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.monitor.health import Health
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.wire.messages import Encoder, Messenger, moduli, Records, Topics
from rotorsoil_ros.wire.speeds import SpeedSource, USUAL


@dataclass(frozen=True, slots=True)
class LargestAnswer:
    """
    Where a channel answered with more than anywhere else.

    Attributes
    ----------
    channel : Channel
        Which.
    speed, amplitude, velocity : float
        Of the rotor [rad/s]; of the displacement, zero-to-peak [m]; and of the channel [m/s rms].

    """

    channel: Channel
    speed: float
    amplitude: float
    velocity: float


class Largest:
    """Keeps of all answers the largest displacement, and the largest velocity of each housing."""

    def __init__(self, channels: tuple[Channel, ...]) -> None:
        self._channels = channels
        self._moved = [not channel.is_rotation for channel in channels]
        self._housings = [column for column, channel in enumerate(channels)
                          if channel.is_housing]
        self.displacement: LargestAnswer | None = None
        self.housings: dict[Channel, LargestAnswer] = {}
        self.speeds = math.inf, -math.inf

    def __call__(self, event: Event) -> None:
        """Take an event; whatever is no answer is nothing."""
        if not isinstance(event, Predicted):
            return
        sizes, velocity = moduli(event.prediction)
        size = sizes[:, 0]
        known = np.isfinite(size).all(axis=1)
        if not known.any():
            return
        speed, size = np.abs(event.prediction.speed[known]), size[known]
        rms = np.abs(velocity[known]) / math.sqrt(2.0)
        self.speeds = (min(self.speeds[0], float(speed.min())),
                       max(self.speeds[1], float(speed.max())))
        row, column = divmod(int(np.where(self._moved, size, 0.0).argmax()), size.shape[1])
        own = LargestAnswer(self._channels[column], float(speed[row]), float(size[row, column]),
                            float(rms[row, column]))
        if self.displacement is None or own.amplitude > self.displacement.amplitude:
            self.displacement = own
        for column in self._housings:
            row = int(rms[:, column].argmax())
            own = LargestAnswer(self._channels[column], float(speed[row]),
                                float(size[row, column]), float(rms[row, column]))
            before = self.housings.get(own.channel)
            if before is None or own.velocity > before.velocity:
                self.housings[own.channel] = own


@dataclass(frozen=True, slots=True)
class Answered:
    """
    What became of a profile.

    Attributes
    ----------
    machine : str
        Under which name it was answered.
    counts : Counter
        How many speeds for which reason.
    remarks : tuple of str
        What of the profile could not be read or answered, and why.
    failure : str
        Why not one speed is answered; nothing where one is.
    largest : Largest or None
        What was answered with most.
    natural_speeds : mapping of str to float
        Lowest frequency of machine and support along x and z [rad/s], by which a zone goes.

    """

    machine: str
    counts: Counter[str]
    remarks: tuple[str, ...] = ()
    failure: str = ''
    largest: Largest | None = None
    natural_speeds: Mapping[str, float] = field(default_factory=dict)


class Screen(Protocol):
    """Who shows events, those since the last flush at once."""

    def __call__(self, event: Event) -> None:
        """Take an event."""

    def flush(self) -> None:
        """Show what was taken."""


class Listener(Protocol):
    """Who hears a whole run."""

    def begin(self, monitor: Monitor) -> None:
        """Get ready for the first message of a monitor."""

    def __call__(self, event: Event) -> None:
        """Take an event."""


Opens = Callable[[str], AbstractContextManager[Screen]]


def predict(
    machine: Machine, profile: Path, out: Path | None, *, screen: Opens | None = None,
    listener: Listener | None = None, speed: SpeedSource = USUAL,
    progress: Callable[[int, int], None] | None = None,
) -> Answered:
    """
    Answer every speed of a profile and log it as the node would.

    Parameters
    ----------
    machine : Machine
        Case and table.
    profile : Path
        Bag directory or MCAP file; where it tells of several machines, the one that is named
        like the case is answered.
    out : Path or None
        Log to write: profile, measurements and answers; None where none is wanted.
    screen : callable
        Opens who shows the events of a machine, given its name.
    listener : Listener
        Hears the run besides.
    speed : SpeedSource
        What tells the speed.
    progress : callable
        Called with the number of messages read and their total.

    Returns
    -------
    Answered
        Where not one speed was answered, with the reason; then nothing is left at `out`.

    Raises
    ------
    InputError
        If a file cannot be read or tells no speed, or if `out` is the profile itself.

    """
    inputs = Inputs.of(profile, of=machine.case, speed=speed)
    if out is not None and out.exists() and any(out.samefile(file) for file in files(profile)):
        raise InputError(f'{out}: is the profile itself')
    name, unbalance = inputs.machine or machine.case.name, machine.case.unbalance
    with ExitStack() as stack:
        log = stack.enter_context(_Answers(out))
        viewer = [stack.enter_context(screen(name))] if screen else []
        largest = Largest(machine.table.channels)
        encoder = Encoder(name, machine.table.channels, Topics.of(inputs.namespace, name))
        told = [Messenger(encoder, [log.write])] if out is not None else []
        heard = [listener] if listener is not None else []
        monitor = Monitor(name, machine.table, unbalance,
                          sinks=[*told, largest, *viewer, *heard],
                          judging=Judging.of(machine.case), oils=machine.oils,
                          ground=machine.ground)
        expected = criteria(machine.case, machine.model, unbalance, machine.directory)
        monitor.judge.take_criteria(expected)
        for each in heard:
            each.begin(monitor)
        done = 0
        for number in feed(inputs, monitor, machine.description(name, unbalance), log=log.write,
                           beside=stand_beside(machine, monitor, inputs)):
            done += number
            for sink in viewer:
                sink.flush()
            if progress:
                progress(done, inputs.number)
        failure = _why_nothing(monitor.health)
        if not failure:
            log.keep()
    remarks = [*inputs.remarks, *_grown(monitor)]
    return Answered(name, monitor.health.counts, tuple(remarks), failure, largest,
                    dict(zip(ACROSS, expected.natural_speeds, strict=True)))


class _Answers:
    """A log that is there, whole, once it is kept; where none is wanted, one of nothing."""

    def __init__(self, out: Path | None) -> None:
        self._out = out
        self._partial = None if out is None else out.with_name(f'{out.name}.partial')
        self._file = None if self._partial is None else LogFile(self._partial)

    def __enter__(self) -> '_Answers':
        return self

    def __exit__(self, *raised: object) -> None:
        if self._file is not None and self._partial is not None:
            self._file.close()
            self._partial.unlink(missing_ok=True)

    def write(self, records: Records) -> None:
        """Append messages of one topic."""
        if self._file is not None:
            self._file.write(records)

    def keep(self) -> None:
        """End the log and give it its name."""
        if self._file is not None and self._partial is not None and self._out is not None:
            self._file.close()
            os.replace(self._partial, self._out)


def _grown(monitor: Monitor) -> Iterator[str]:
    """Yield why speeds have no answer at which the machine is unstable."""
    if monitor.health.counts['unstable']:
        for line in unstable(monitor.table.stability):
            yield f'{monitor.health.counts["unstable"]} speeds are not answered: {line}'


def _why_nothing(health: Health) -> str:
    """Say why not one speed is answered; nothing where one is."""
    if health.counts['answered']:
        return ''
    told = ', '.join(
        f'{number} {reason.replace("_", " ")}'
        + (f' ({more})' if (more := health.explanations.get(reason)) else '')
        for reason, number in health.counts.items()
        if number and reason not in ('received', 'measured', 'samples'))
    return f'nothing is answered: {told or "no speed is told"}'
