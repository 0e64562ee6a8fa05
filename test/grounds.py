"""A fan on ground that moves by itself, and what sensors feel of both, at every frequency."""

from dataclasses import dataclass
import math

import numpy as np
from scipy import signal

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Samples
from rotorsoil_ros.machine.transmissibility import disturbed
from rotorsoil_ros.monitor.criteria import Criteria
from rotorsoil_ros.monitor.monitor import Monitor
from rotorsoil_ros.monitor.rules import Judging
from rotorsoil_ros.units import GRAVITY, hz_to_rad_s, rad_s_to_rpm

START = 1_700_000_000 * 10**9
RUNNING_HZ = 24.7  # a whole number of turns in ten seconds
RUNNING = hz_to_rad_s(RUNNING_HZ)
RPM = float(rad_s_to_rpm(RUNNING))
RATE_HZ = 250.0
YARD = {'name': 'yard', 'place': {'x': 8.0, 'y': 0.0}}
WITHIN_HZ = 3.0, 60.0


def traffic(seconds, *, seed=1, rms=1e-4):
    """Return the velocity of ground in a narrow band around 18 Hz [m/s]."""
    number = round(seconds * RATE_HZ)
    frequency = np.fft.rfftfreq(number, 1.0 / RATE_HZ)
    b, a = signal.butter(1, [15.0, 21.0], 'band', fs=RATE_HZ)
    spectrum = np.fft.rfft(np.random.default_rng(seed).normal(size=number)) * np.abs(
        signal.freqz(b, a, worN=frequency, fs=RATE_HZ)[1])
    spectrum[(frequency < WITHIN_HZ[0]) | (frequency > WITHIN_HZ[1])] = 0.0
    moved = np.fft.irfft(spectrum, number)
    return moved * rms / moved.std()


@dataclass
class Felt:
    """Accelerations over time: of every housing, and of every sensor along x, y, z [m/s^2]."""

    time: np.ndarray
    housings: dict
    sensors: np.ndarray
    by_ground: dict


def felt(machine, moved, *, own=1.0, noise=1e-4):
    """
    Return what is felt at a steady speed while the ground moves along x by itself.

    The motion of everything at every frequency is that of dense solves, which no table knows;
    `by_ground` is the velocity that the ground makes of each housing [m/s].
    """
    number = len(moved)
    time, omega = np.arange(number) / RATE_HZ, hz_to_rad_s(np.fft.rfftfreq(number, 1.0 / RATE_HZ))
    chosen = (omega > hz_to_rad_s(WITHIN_HZ[0])) & (omega < hz_to_rad_s(WITHIN_HZ[1]))
    ground, model = machine.ground, machine.model
    displaced = np.zeros(len(omega), dtype=complex)
    displaced[chosen] = np.fft.rfft(moved)[chosen] / (1j * omega[chosen])
    ratio, force = model.ground_response(omega[chosen], speed=RUNNING)
    unit = disturbed(ground.around.point_motion(omega[chosen]), force[:, ground.loads])
    steady = model.unbalance_response(np.array([RUNNING]), machine.case.unbalance)
    random = np.random.default_rng(7)

    def over_time(part, line, factor):
        spectrum = np.zeros(len(omega), dtype=complex)
        spectrum[chosen] = part * displaced[chosen]
        turned = -RUNNING**2 * own * line * np.exp(1j * RUNNING * time)
        return np.fft.irfft(factor * spectrum, number), turned.real

    def acceleration(part, line):
        return sum(over_time(part, line, -omega**2)) + noise * random.normal(size=number)

    columns = {channel: column for column, channel in enumerate(model.channels)
               if channel.is_housing}
    beside = ground.own(np.array([RUNNING]), steady.force)[0]
    sensors = np.array([[acceleration(unit[:, row, axis, 0], beside[row, axis])
                         for axis in range(3)] for row in range(len(beside))])
    sensors[:, 2] += GRAVITY
    return Felt(
        time, {channel: acceleration(ratio[:, column, 0], steady.displacement[0, column])
               for channel, column in columns.items()}, sensors,
        {channel: over_time(ratio[:, column, 0], 0.0, 1j * omega)[0]
         for channel, column in columns.items()})


def watched(
    machine, found, *, turns=60.0, sensors=('yard',), angle=True, events=None,
):
    """Return a monitor that has heard all that was felt, second by second."""
    monitor = Monitor('fan', machine.table, machine.case.unbalance,
                      sinks=[] if events is None else [events.append],
                      judging=Judging.of(machine.case, turns=turns), ground=machine.ground)
    # No band: of the judge only zones are asked.
    monitor.judge.take_criteria(Criteria(None, (), (math.inf, math.inf)))
    stamps = START + np.rint(1e9 * found.time).astype(np.int64)
    monitor.begin(START, {})
    step = round(RATE_HZ)
    for first in range(0, len(stamps), step):
        part = slice(first, first + step)
        told = stamps[part][::5]
        turned = np.remainder(RUNNING * found.time[part][::5], 2.0 * np.pi)
        monitor.on_speed(told, np.full(len(told), RUNNING), turned if angle else None)
        for channel, values in found.housings.items():
            monitor.on_samples(Samples('fan', channel, stamps[part], values[part]))
        for name, values in zip(sensors, found.sensors, strict=True):
            monitor.on_ground(name, Samples(
                'fan', Channel(name, '', 'z'), stamps[part], values[2, part], False,
                values[:, part].T))
        monitor.tick(int(stamps[part][-1]), stale_after_s=3.0)
    monitor.finish(int(stamps[-1]))
    return monitor


def shares(monitor):
    """Return what the ground did to every channel."""
    return {one.channel: one for one in monitor.ground.account.shares()}
