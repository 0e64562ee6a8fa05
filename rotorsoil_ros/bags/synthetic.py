"""What would sensors say of a machine whose soil and unbalance are known? Labelled synthetic."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.bags.writer import LogFile
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import NANOSECONDS
from rotorsoil_ros.ground.bed import below_patches
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.soil import Soil
from rotorsoil_ros.machine.band import on_soils
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.time_domain import shake, Shaking
from rotorsoil_ros.machine.transmissibility import disturbed, MovingGround
from rotorsoil_ros.units import GRAVITY, rpm_to_rad_s
from rotorsoil_ros.wire.cdr import ARRAYS, encode, Layout, NOT_MEASURED, SYNTHETIC
from rotorsoil_ros.wire.definitions import IMU, JOINT_STATE
from rotorsoil_ros.wire.messages import JointStateWriter, Records
from rotorsoil_ros.wire.speeds import ROTOR_JOINT

SPEED_RATE_HZ = 50.0
SLICE_S = 0.1
_SPEEDS = 300  # at which fields beside a machine are solved


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
    ground_mm_s_rms, ground_hz : float
        How fast the ground moves by itself, alike along x, y and z, and about which frequency,
        as by traffic.

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
    ground_mm_s_rms: float = 0.0
    ground_hz: float = 18.0


def write_synthetic(
    target: Path, machine: str, model: CoupledModel, unbalance: ComplexArray, *, truth: Truth,
    start_ns: int, beside: MovingGround | None = None, sensors: Sequence[str] = (),
) -> None:
    """
    Write speed with angle, and raw acceleration of housings and of the ground, as an MCAP file.

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
    beside, sensors : MovingGround or None, sequence of str
        Ground of the case, and the names of the sensors that stand on it.

    Notes
    -----
    The route is another one than that of the predictions: equations of motion integrated in
    time, sampled, with noise and gravity. Every message of a sensor has `synthetic` in its
    frame.

    """
    time, speed = profile(truth)
    grown, random = 1.0 + truth.growth * time / time[-1], np.random.default_rng(truth.seed)
    model, ground = on_ground(model, truth.shear_modulus_factor), _traffic(truth, len(time))
    shaken = shake(model, time, speed, moment=np.abs(unbalance) * grown[:, None],
                   phase=np.asarray(np.angle(unbalance), dtype=float), ground=ground)
    stamp_ns = start_ns + np.rint(time * NANOSECONDS).astype(np.int64)
    writers = [Sensor(f'/{machine}/measured/{channel}/imu', channel,
                      _acceleration(channel, shaken, truth.noise, random))
               for channel in shaken.channels]
    if beside is not None:
        if isinstance(beside.around, BoundaryElementModel):
            soil = beside.around.soil
            beside = replace(beside, around=beside.around.on(replace(
                soil, shear_modulus=truth.shear_modulus_factor * soil.shear_modulus)))
        felt = _on_the_ground(model, beside, unbalance, shaken, grown, ground)
        writers += [Sensor(f'/{machine}/ground/{name}/imu', name, one)
                    for name, one in zip(sensors, felt, strict=True)]
    every = max(1, round(truth.rate_hz / SPEED_RATE_HZ))
    with LogFile(target) as log:
        # In the order of time, as a recorder writes: readers live through the file.
        for start in range(0, len(time), round(truth.rate_hz * SLICE_S)):
            part = slice(start, start + round(truth.rate_hz * SLICE_S))
            told = slice(start + -start % every, part.stop, every)
            log.write(_speeds(machine, stamp_ns[told], speed[told], shaken.angle[told]))
            for writer in writers:
                log.write(writer.records(stamp_ns, part))


def profile(truth: Truth) -> tuple[FloatArray, FloatArray]:
    """Return time [s] and speed [rad/s]: run-up, dwell, coast-down."""
    total = 2.0 * truth.ramp_s + truth.dwell_s
    time = np.arange(round(total * truth.rate_hz)) / truth.rate_hz
    speed_rpm = np.interp(time, [0.0, truth.ramp_s, truth.ramp_s + truth.dwell_s, total], [
        truth.slowest_rpm, truth.fastest_rpm, truth.fastest_rpm, truth.slowest_rpm])
    return time, np.asarray(rpm_to_rad_s(speed_rpm))


def on_ground(model: CoupledModel, factor: float) -> CoupledModel:
    """Return a machine on ground whose shear modulus is multiplied by a factor."""
    soils: list[Soil | None] = [getattr(one, 'soil', getattr(one, 'material', None))
                                for own in model.soil_models for one in below_patches(own)]
    given = next(filter(None, soils), None)
    if given is None:
        return model
    return on_soils(model, [replace(
        given, shear_modulus=factor * given.shear_modulus)], of=given)[0]


def _speeds(machine: str, stamp_ns: IntArray, speed: FloatArray, angle: FloatArray) -> Records:
    values = np.full((len(speed), len(ARRAYS), 1), np.nan)
    values[:, ARRAYS.index('velocity'), 0] = speed
    values[:, ARRAYS.index('position'), 0] = angle
    stamps = stamp_ns.tolist()
    return Records(f'/{machine}/joint_states', JOINT_STATE, stamps,
                   JointStateWriter([ROTOR_JOINT]).write(stamps, values))


def _acceleration(
    channel: Channel, shaken: Shaking, noise: float, random: np.random.Generator,
) -> FloatArray:
    """Return what a sensor feels along the axes of the machine, (n, 3) [m/s^2]."""
    felt = np.zeros((len(shaken.acceleration), 3))
    for axis, column in (('x', 0), ('z', 2)):
        clean = shaken.acceleration[:, shaken.channels.index(replace(channel, axis=axis))]
        deviation = noise * float(np.sqrt(np.mean(clean**2)))
        felt[:, column] = clean + random.normal(scale=deviation, size=len(clean))
    felt[:, 2] += GRAVITY
    return felt


def _traffic(truth: Truth, number: int) -> FloatArray:
    """Return the acceleration of ground that moves in a narrow band, (n, 3) [m/s^2]."""
    frequency = np.fft.rfftfreq(number, 1.0 / truth.rate_hz)
    random = np.random.default_rng([truth.seed, 1])
    # A resonance of the road: the velocity in a band of a third of its frequency.
    share = (frequency / truth.ground_hz - truth.ground_hz / np.maximum(frequency, 1e-9)) * 3.0
    spectrum = np.fft.rfft(random.normal(size=(3, number))) / (1.0 + 1j * share)
    velocity = np.fft.irfft(spectrum, number)
    scale = 1e-3 * truth.ground_mm_s_rms / velocity.std(axis=1, keepdims=True)
    return np.asarray(np.fft.irfft(
        2j * np.pi * frequency * spectrum * scale, number)).T


def _on_the_ground(
    model: CoupledModel, beside: MovingGround, unbalance: ComplexArray, shaken: Shaking,
    grown: FloatArray, ground: FloatArray,
) -> FloatArray:
    """Return what sensors on the ground feel of it and of the machine, (s, n, 3) [m/s^2]."""
    speeds = np.linspace(shaken.speed.min(), shaken.speed.max() * (1.0 + 1e-9), _SPEEDS)
    own = beside.own(speeds, model.unbalance_response(speeds, unbalance).force)
    turned = -shaken.speed**2 * grown * np.exp(1j * shaken.angle)
    # What the blocks leave of the motion of the ground does not depend on what turns.
    omega = np.linspace(0.0, min(beside.table.omega[-1], 2.0 * speeds[-1]), _SPEEDS)[1:]
    _, force = model.ground_response(omega, speed=float(speeds[-1]))
    unit = disturbed(beside.beside(omega), force[:, beside.loads])
    frequency = 2.0 * np.pi * np.fft.rfftfreq(len(ground), float(np.diff(shaken.time[:2])[0]))
    spectrum = np.fft.rfft(ground, axis=0)
    felt = np.empty((own.shape[1], len(ground), 3))
    for row, axis in np.ndindex(felt.shape[0], 3):
        through = np.stack([np.interp(frequency, omega, unit[:, row, axis, along],
                                      right=float(axis == along)) for along in range(3)], axis=1)
        felt[row, :, axis] = np.fft.irfft((through * spectrum).sum(axis=1), len(ground)) + (
            turned * np.interp(shaken.speed, speeds, own[:, row, axis])).real
    felt[:, :, 2] += GRAVITY
    return felt


class Sensor:
    """Packs the messages of one sensor by the thousand."""

    def __init__(self, topic: str, name: str, acceleration: FloatArray) -> None:
        self._topic = topic
        self._acceleration = acceleration
        not_measured = [NOT_MEASURED, *[0.0] * 8]
        blank = encode(IMU, {
            'header': {'frame_id': f'{SYNTHETIC}_{name}'},
            'orientation_covariance': not_measured,
            'angular_velocity_covariance': not_measured})
        self._blank = np.frombuffer(blank, dtype=np.uint8)
        self._kind = Layout.of(IMU, blank).dtype

    def records(self, stamp_ns: IntArray, part: slice) -> Records:
        """Return the messages of a part of the run."""
        stamps = stamp_ns[part]
        rows = np.tile(self._blank, (len(stamps), 1)).view(self._kind)[:, 0]
        rows['header.stamp.sec'], rows['header.stamp.nanosec'] = np.divmod(stamps, NANOSECONDS)
        rows['linear_acceleration'] = self._acceleration[part]
        return Records(self._topic, IMU, stamps.tolist(), [row.tobytes() for row in rows])
