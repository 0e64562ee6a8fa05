"""What would sensors say of a machine whose soil and unbalance are known? Labelled synthetic."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rclpy.serialization import serialize_message
from sensor_msgs.msg import Imu

from rotorsoil_ros.live.bag_writer import LogFile
from rotorsoil_ros.live.cdr import ARRAYS, STAMP
from rotorsoil_ros.live.events import NANOSECONDS
from rotorsoil_ros.live.imu import IMU, SYNTHETIC
from rotorsoil_ros.live.inlets import ROTOR_JOINT
from rotorsoil_ros.live.messages import JOINT_STATE, JointStateWriter, Records
from rotorsoil_ros.physics.arrays import FloatArray, IntArray
from rotorsoil_ros.physics.coupled import CoupledModel
from rotorsoil_ros.physics.soil_neighbours import on_soils
from rotorsoil_ros.physics.time_domain import shake, Shaking
from rotorsoil_ros.physics.units import rpm_to_rad_s

GRAVITY = 9.81
BATCH = 4096


@dataclass(frozen=True, slots=True)
class Truth:
    """
    What is put into synthetic signals.

    Attributes
    ----------
    shear_modulus_factor : float
        G of the ground over that of the case.
    growth : float
        By which share the unbalance grows, evenly from the first sample to the last.
    noise : float
        Standard deviation of the noise over the root mean square of each signal's vibration.
    slowest_rpm, fastest_rpm : float
        Between which the machine runs up, dwells, and coasts down.
    ramp_s, dwell_s : float
        How long each of the ramps and the dwell last.
    rate_hz : float
        Samples per second; it should be forty times the running frequency or more.
    seed : int
        Of the noise.

    """

    shear_modulus_factor: float = 0.7
    growth: float = 0.4
    noise: float = 0.05
    slowest_rpm: float = 360.0
    fastest_rpm: float = 1750.0
    ramp_s: float = 30.0
    dwell_s: float = 10.0
    rate_hz: float = 1000.0
    seed: int = 0


def write_synthetic(
    target: Path, machine: str, model: CoupledModel, unbalance: FloatArray, *, truth: Truth,
    start_ns: int,
) -> None:
    """
    Write speed with angle, and raw acceleration of every housing, as an MCAP file.

    Parameters
    ----------
    target : Path
        File to write.
    machine : str
        Whose topics.
    model : CoupledModel
        The machine as its case has it.
    unbalance : (p,) complex array
        Of every disc at the beginning [kg m].
    truth : Truth
        How the ground and the unbalance differ from the case.
    start_ns : int
        Stamp of the first sample [ns].

    Notes
    -----
    The route is another one than that of the predictions: equations of motion integrated in
    time, sampled, with noise and gravity. Every message of a sensor has `synthetic` in its
    frame.

    """
    time, speed = profile(truth)
    moment = np.abs(unbalance) * (1.0 + truth.growth * time / time[-1])[:, None]
    shaken = shake(on_ground(model, truth.shear_modulus_factor), time, speed, moment=moment,
                   phase=np.angle(unbalance))
    stamp_ns = start_ns + np.rint(time * NANOSECONDS).astype(np.int64)
    random = np.random.default_rng(truth.seed)
    with LogFile(target) as log:
        every = max(1, round(truth.rate_hz / 50.0))
        log.write(_speeds(machine, stamp_ns[::every], speed[::every], shaken.angle[::every]))
        for channel in shaken.channels:
            for records in _samples(machine, channel, stamp_ns, shaken, truth.noise, random):
                log.write(records)


def profile(truth: Truth) -> tuple[FloatArray, FloatArray]:
    """Return time [s] and speed [rad/s]: run-up, dwell, coast-down."""
    total = 2.0 * truth.ramp_s + truth.dwell_s
    time = np.arange(round(total * truth.rate_hz)) / truth.rate_hz
    speed_rpm = np.interp(time, [0.0, truth.ramp_s, truth.ramp_s + truth.dwell_s, total], [
        truth.slowest_rpm, truth.fastest_rpm, truth.fastest_rpm, truth.slowest_rpm])
    return time, np.asarray(rpm_to_rad_s(speed_rpm))


def on_ground(model: CoupledModel, factor: float) -> CoupledModel:
    """Return a machine on ground whose shear modulus is multiplied by a factor."""
    soils = [soil.soil for soil in model.soil_models if hasattr(soil, 'soil')]
    if not soils:
        return model
    return on_soils(model, [replace(
        soils[0], shear_modulus=factor * soils[0].shear_modulus)])[0]


def _speeds(machine: str, stamp_ns: IntArray, speed: FloatArray, angle: FloatArray) -> Records:
    values = np.full((len(speed), len(ARRAYS), 1), np.nan)
    values[:, ARRAYS.index('velocity'), 0] = speed
    values[:, ARRAYS.index('position'), 0] = angle
    stamps = stamp_ns.tolist()
    return Records(f'/{machine}/joint_states', JOINT_STATE, stamps,
                   JointStateWriter([ROTOR_JOINT]).write(stamps, values))


def _samples(
    machine: str, channel: str, stamp_ns: IntArray, shaken: Shaking, noise: float,
    random: np.random.Generator,
) -> Iterator[Records]:
    """Yield the Imu messages of one sensor, whose axes are those of the machine."""
    station = channel.rpartition('_')[0]
    acceleration = np.zeros((len(stamp_ns), 3))
    for axis, column in (('x', 0), ('z', 2)):
        clean = shaken.acceleration[:, shaken.channels.index(f'{station}_{axis}')]
        deviation = noise * float(np.sqrt(np.mean(clean**2)))
        acceleration[:, column] = clean + random.normal(scale=deviation, size=len(clean))
    acceleration[:, 2] += GRAVITY
    message = Imu()
    message.header.frame_id = f'{SYNTHETIC}_{channel}'
    message.orientation_covariance[0] = -1.0  # not measured
    message.angular_velocity_covariance[0] = -1.0
    blank = np.frombuffer(serialize_message(message), dtype=np.uint8)
    # Nothing but the covariance of the acceleration follows it: nine doubles and, of some
    # middlewares, padding.
    mark = Imu()
    mark.header.frame_id = message.header.frame_id
    mark.linear_acceleration.x = 1.0
    plain = Imu()
    plain.header.frame_id = message.header.frame_id
    changed = np.flatnonzero(np.frombuffer(serialize_message(mark), dtype=np.uint8)
                             != np.frombuffer(serialize_message(plain), dtype=np.uint8))
    at = int(changed[-1]) - 7
    kind = np.dtype({'names': ['sec', 'nanosec', 'acceleration'],
                     'formats': ['<i4', '<u4', '(3,)<f8'],
                     'offsets': [STAMP.start, STAMP.start + 4, at], 'itemsize': len(blank)})
    for start in range(0, len(stamp_ns), BATCH):
        part = slice(start, start + BATCH)
        rows = np.tile(blank, (len(stamp_ns[part]), 1)).view(kind)[:, 0]
        rows['sec'], rows['nanosec'] = np.divmod(stamp_ns[part], NANOSECONDS)
        rows['acceleration'] = acceleration[part]
        yield Records(f'/{machine}/measured/{channel}/imu', IMU, stamp_ns[part].tolist(),
                      [row.tobytes() for row in rows])
