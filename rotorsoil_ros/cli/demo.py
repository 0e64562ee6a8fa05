"""The main job for real: node and replay talk DDS on this host; then a comparison."""

from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.resources import as_file, files
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import numpy as np

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.bags import reader as bag_reader
from rotorsoil_ros.bags.profile import write_speed_profile
from rotorsoil_ros.case import models
from rotorsoil_ros.case.config import Case, load
from rotorsoil_ros.channel import across, Channel, HOUSING
from rotorsoil_ros.cli.demo_comparison import demonstrate_comparison
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.domain import own_domain
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.figures.response import all_figures, trend
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.units import rad_s_to_rpm, rpm_to_rad_s, Units
from rotorsoil_ros.wire.sensors import JointStateReader

MACHINE = 'paper_rotor'

# Run up through both pairs of critical speeds, dwell, coast down against a viscous drag.
_RUN_UP_S, _DWELL_S, _COAST_S, _RATE_HZ = 12.0, 3.0, 9.0, 100
_SLOWEST_RPM, _FASTEST_RPM = 300.0, 8400.0

_SHUTDOWN_S = 60.0  # for what hangs: a busy machine takes its time


@dataclass(frozen=True)
class _Answers:
    """What the log holds: stamps (n,) [ns], speeds (n,) [rad/s], amplitudes (n, c) [m, rad]."""

    stamp_ns: IntArray
    speed: FloatArray
    channels: tuple[Channel, ...]
    amplitude: FloatArray


def demo(arguments: Namespace) -> int:
    """Run a machine before a live node, then compare another; leave logs and pictures."""
    out: Path = arguments.output
    out.mkdir(parents=True, exist_ok=True)
    # Tables of the demo are its own: what it shows was computed here.
    directory = out / 'cache'
    with as_file(files('rotorsoil_ros') / 'config' / f'{MACHINE}.yaml') as path:
        case = load(path)
        with progress('solving for every speed') as _:
            model = models.coupled_model(case, directory)
            table = models.response_table(case, model, directory)
        profile = out / 'profile.mcap'
        write_speed_profile(profile, MACHINE, *speed_profile(time.time_ns()))
        print(f'{MACHINE}: run-up to {_FASTEST_RPM:g} rpm, dwell, coast-down: '
              f'{_RUN_UP_S + _DWELL_S + _COAST_S:g} s', flush=True)
        log = _live(path, profile, out, directory)
    answers = _read(log)
    _draw(model, table, answers, out / 'plots', case=case)
    _summarise(case, answers, out, log)
    print()
    demonstrate_comparison(out / 'comparison', directory, start_ns=time.time_ns())
    return 0


def speed_profile(start_ns: int) -> tuple[IntArray, FloatArray]:
    """Return stamps (n,) [ns] from a start on and speeds (n,) [rad/s] of the demonstration."""
    time_s = np.arange(round((_RUN_UP_S + _DWELL_S + _COAST_S) * _RATE_HZ)) / _RATE_HZ
    share = np.clip(time_s / _RUN_UP_S, 0.0, 1.0)
    coasting = np.clip((time_s - _RUN_UP_S - _DWELL_S) / _COAST_S, 0.0, 1.0)
    slowing = (_SLOWEST_RPM / _FASTEST_RPM) ** coasting
    speed_rpm = (_SLOWEST_RPM + share * (_FASTEST_RPM - _SLOWEST_RPM)) * slowing
    stamp_ns = start_ns + np.rint(time_s * NANOSECONDS).astype(np.int64)
    return stamp_ns, np.asarray(rpm_to_rad_s(speed_rpm))


def _live(case: Path, profile: Path, out: Path, directory: Path) -> Path:
    """Let the replay talk to the node; return the directory of the node's log."""
    environment = {**os.environ, 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
    environment.setdefault('ROS_DOMAIN_ID', str(own_domain()))
    before = set(out.iterdir())
    with _node(case, out, directory, environment):
        replay = subprocess.run(
            [sys.executable, '-m', 'rotorsoil_ros.cli', 'replay', str(profile)],
            env=environment, check=False)
        if replay.returncode != 0:
            raise RotorSoilError(f'the replay failed; what the node said is in {out}/node.log')
    [log] = {path for path in set(out.iterdir()) - before if (path / 'metadata.yaml').exists()}
    return log


@contextmanager
def _node(
    case: Path, out: Path, directory: Path, environment: dict[str, str],
) -> Iterator[None]:
    """Run the node while the body does; leave its words in node.log."""
    parameters = [f'machines:=[{MACHINE}]', f'{MACHINE}.case:={case}', f'log.directory:={out}',
                  f'cache:={directory}', 'speed_reliability:=reliable', 'speed_depth:=1000']
    command = [sys.executable, '-m', 'rotorsoil_ros.node.node', '--ros-args']
    for parameter in parameters:
        command += ['-p', parameter]
    with (out / 'node.log').open('w') as words:
        node = subprocess.Popen(command, env=environment, stdout=words, stderr=words)
        try:
            yield
        finally:
            node.send_signal(signal.SIGINT)
            try:
                node.wait(_SHUTDOWN_S)
            except subprocess.TimeoutExpired:
                node.kill()
                node.wait()
    if node.returncode != 0:
        raise RotorSoilError(f'the node ended with status {node.returncode}, see {words.name}')


def _read(log: Path) -> _Answers:
    """Read speeds and predicted amplitudes back from the log of the node."""
    speeds: dict[int, float] = {}
    stamps: list[int] = []
    rows: list[FloatArray] = []
    channels: tuple[Channel, ...] = ()
    told, answered = f'/{MACHINE}/joint_states', f'/rotorsoil/{MACHINE}/amplitude'
    readers = {told: JointStateReader(), answered: JointStateReader()}
    for source, _, payload in bag_reader.messages(log, lambda topic, _: topic in readers):
        for _, states in readers[source.topic].runs([bytes(payload)]):
            if states is None:
                continue
            stamp_ns = int(states.stamp_ns[0])
            if source.topic == told:
                speeds[stamp_ns] = float(states.velocity[0, 0])
            else:
                channels = tuple(map(Channel.parse, states.names))
                stamps.append(stamp_ns)
                rows.append(states.position[0])
    return _Answers(np.array(stamps), np.array([speeds[stamp] for stamp in stamps]), channels,
                    np.array(rows))


def _draw(
    model: CoupledModel, table: ResponseTable, answers: _Answers, out: Path, *, case: Case,
) -> None:
    out.mkdir(exist_ok=True)
    with progress('drawing') as report:
        figures = list(all_figures(case, model, table))
        figures.append(('demo', trend(
            1e-9 * (answers.stamp_ns - answers.stamp_ns[0]), answers.speed, answers.amplitude,
            channels=answers.channels, title=f'{MACHINE}: what the live node answered')))
        for done, (name, figure) in enumerate(figures):
            figure.savefig(out / f'{name}.png', dpi=150)
            report(done + 1, len(figures))


def _summarise(case: Case, answers: _Answers, out: Path, log: Path) -> None:
    sent = len(speed_profile(0)[0])
    print(f'{sent} speeds sent over DDS, {len(answers.stamp_ns)} answered and logged')
    print('largest displacements:')
    names = [name for bearing in case.rotor.bearings for name in across(bearing.name, HOUSING)]
    names += [name for disc in case.rotor.discs for name in across(disc.name)]
    for name in names:
        column = answers.amplitude[:, answers.channels.index(name)]
        at = int(np.nanargmax(column))
        print(f'  {name:22s} {Units().displacement(column[at]):>14s} at '
              f'{rad_s_to_rpm(float(answers.speed[at])):6.0f} rpm')
    print(f'log       {log}')
    for recording in sorted(log.glob('*.rrd')):
        print(f'recording {recording}   (rerun {recording})')
    print(f'pictures  {out / "plots"}')
