"""What would the node have answered to a recorded profile? The same numbers, without a graph."""

from collections import Counter
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
import os
from pathlib import Path
from typing import Protocol

from rotorsoil_ros.bags.feed import feed, Inputs
from rotorsoil_ros.bags.metadata import files
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.events import Event
from rotorsoil_ros.monitor.criteria import criteria
from rotorsoil_ros.monitor.health import Health
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.wire.messages import Encoder, Messenger, Records, Topics
from rotorsoil_ros.wire.speeds import SpeedSource, USUAL


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
        What of the profile could not be read, and why.
    failure : str
        Why not one speed is answered; nothing where one is.

    """

    machine: str
    counts: Counter[str]
    remarks: tuple[str, ...] = ()
    failure: str = ''


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
    inputs = Inputs.of(profile, like=machine.case.name, speed=speed)
    if out is not None and out.exists() and any(out.samefile(file) for file in files(profile)):
        raise InputError(f'{out}: is the profile itself')
    name, unbalance = inputs.machine or machine.case.name, machine.case.unbalance
    with ExitStack() as stack:
        log = stack.enter_context(_Answers(out))
        viewer = [stack.enter_context(screen(name))] if screen else []
        encoder = Encoder(name, machine.table.channels, Topics.of(inputs.namespace, name))
        told = [Messenger(encoder, [log.write])] if out is not None else []
        heard = [listener] if listener is not None else []
        monitor = Monitor(name, machine.table, unbalance, sinks=[*told, *viewer, *heard],
                          judging=Judging.of(machine.case))
        monitor.judge.take_criteria(criteria(
            machine.case, machine.model, unbalance, machine.directory))
        for each in heard:
            each.begin(monitor)
        done = 0
        for number in feed(inputs, monitor, machine.description(name, unbalance), log=log.write):
            done += number
            for sink in viewer:
                sink.flush()
            if progress:
                progress(done, inputs.number)
        failure = _why_nothing(monitor.health)
        if not failure:
            log.keep()
    return Answered(name, monitor.health.counts, tuple(inputs.remarks), failure)


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
