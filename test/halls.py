"""A plant whose machines shake each other: what its sensors would say, and logs of that."""

from pathlib import Path

import numpy as np

from rotorsoil_ros.bags.synthetic import Sensor
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.case.plant.together import Plant
from rotorsoil_ros.units import rpm_to_rad_s
from rotorsoil_ros.wire.definitions import JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records
from rotorsoil_ros.wire.speeds import ROTOR_JOINT

HOUSE = Path(__file__).parents[1] / 'config' / 'fan_house.yaml'
SECOND = 10**9
START = 1_790_000_000 * SECOND
# Without a spread of the soil: the band is narrow, and costs nothing.
NARROW = ['uncertainty.samples=3', 'uncertainty.shear_modulus_factor=1.05']


def drifting(time, rpm, *, by=1.0, period_s=47.0):
    """Return a speed [rad/s] that drifts about one in rpm, as those of induction motors do."""
    return rpm_to_rad_s(rpm + by * np.sin(2.0 * np.pi * time / period_s))


class Hall:
    """
    Machines at speeds over time, each of which moves every channel at its own frequency.

    Parameters
    ----------
    plant : Plant
        The machines, whose tables tell what each does.
    time : (n,) float array
        Of the samples [s].
    speed : mapping of str to (n,) float array
        Of each machine [rad/s].
    factor : mapping of str to float
        By which the unbalance of a machine is larger than in its case.

    """

    def __init__(self, plant: Plant, time, speed, *, factor=None):
        self.plant, self.time, self.speed = plant, time, speed
        self.factor = dict.fromkeys(speed, 1.0) | (factor or {})
        step = np.diff(time, prepend=time[0])
        self.angle = {name: np.cumsum(step * own) + number
                      for number, (name, own) in enumerate(speed.items())}

    def vectors(self, name, channel):
        """Return the displacement vectors of one machine in a channel, (n,) [m]."""
        machine = self.plant.machines[name]
        column = machine.table.channels.index(channel)
        found = machine.table.predictor(machine.case.unbalance).answer(self.speed[name])
        turns = self.speed[name] > 0.0
        return self.factor[name] * np.where(turns, found.displacement[:, column], 0.0)

    def acceleration(self, channel):
        """Return what a sensor feels in a channel [m/s^2]."""
        return sum(np.real(-self.speed[name]**2 * self.vectors(name, channel)
                           * np.exp(1j * self.angle[name])) for name in self.speed)

    def write(self, target, channels, *, telling=None, until_s=None, noise=0.02, namespace=''):
        """
        Write a log.

        `channels` are those of the sensors of each machine, `telling` the machines that tell
        their speeds (all), and `until_s` until when those do that fall silent.
        """
        random = np.random.default_rng(0)
        stamps = START + np.rint(self.time * SECOND).astype(np.int64)
        sensors = [self._sensor(f'{namespace}/{name}'.strip('/'), channel, noise, random)
                   for name, own in channels.items() for channel in own]
        with LogFile(target) as log:
            for start in range(0, len(stamps), 200):
                for name in telling or self.speed:
                    rows = np.arange(start, min(start + 200, len(stamps)), 20)
                    rows = rows[self.time[rows] <= (until_s or {}).get(name, np.inf)]
                    values = np.full((len(rows), 3, 1), np.nan)
                    values[:, 0, 0] = self.angle[name][rows]
                    values[:, 1, 0] = self.speed[name][rows]
                    told = stamps[rows].tolist()
                    log.write(Records(f'{namespace}/{name}/joint_states', JOINT_STATE, told,
                                      JointStateWriter([ROTOR_JOINT]).write(told, values)))
                for sensor in sensors:
                    log.write(sensor.records(stamps, slice(start, start + 200)))
        return target

    def _sensor(self, machine, channel, noise, random):
        clean = self.acceleration(channel)
        felt = np.zeros((len(clean), 3))
        felt[:, 'xyz'.index(channel.axis)] = clean + random.normal(
            scale=noise * np.sqrt(np.mean(clean**2)), size=len(clean))
        return Sensor(f'/{machine}/measured/{channel}/imu', channel, felt)
