"""
Compare ways to tell the vectors of two machines apart that run nearly alike.

    python -m benchmarks.beside

Two machines at 1480 and 1475 rpm, the other of half the amplitude: what ten turns say of the
first, what a mean over one beat says, and what is left when vectors of ten turns are followed.
True is 1. Speeds drift by some rpm with 47 and 31 s, and the other's may be told wrongly.
"""

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.monitor.beside.parting import BesideRow, Parting
from rotorsoil_ros.units import rpm_to_rad_s

RPM, APART_RPM, HALF = 1480.0, 5.0, 0.5
TURN_S = 2.0 * np.pi / rpm_to_rad_s(RPM)
TOTAL_S, NOISE, BEAT_S = 300.0, 0.01, 12.0
FROM_S = 30.0  # on is looked at


def vectors(drift_rpm: float) -> tuple[FloatArray, FloatArray, ComplexArray]:
    """Return times [s], the angle between both [rad] and vectors of ten turns."""
    random = np.random.default_rng(0)
    time = np.arange(5.0 * TURN_S, TOTAL_S, 10.0 * TURN_S)
    angle = rpm_to_rad_s(APART_RPM * time)
    for period_s, size in ((31.0, drift_rpm), (47.0, -drift_rpm)):
        rate = 2.0 * np.pi / period_s
        angle = angle - rpm_to_rad_s(size) / rate * np.cos(rate * time)
    noise = random.normal(scale=NOISE / np.sqrt(2.0), size=(len(time), 2)) @ [1.0, 1.0j]
    return time, angle, 1.0 + HALF * np.exp(1j * angle) + noise


def followed(time: FloatArray, angle: FloatArray, vector: ComplexArray) -> ComplexArray:
    """Return the vectors less what is found to be the other's."""
    parting, left = Parting(), []
    for at, phi, one in zip(time.tolist(), angle.tolist(), vector.tolist(), strict=True):
        turn = np.exp(1j * np.array([phi]))
        found, _ = parting.part(BesideRow(
            at, rpm_to_rad_s(RPM), np.array([one]), np.zeros(1),
            np.array([rpm_to_rad_s(RPM - APART_RPM)]), turn, np.array([[HALF]]), np.ones(1)))
        left.append(one - found[0, 0] * turn[0])
    return np.array(left)


def main() -> None:
    """Print between which sizes each way finds the first machine."""
    print('drift [rpm]  told wrongly by [rpm]  ten turns    mean of a beat  followed')
    for drift in (0.0, 1.0, 4.0):
        for wrong in (0.0, 0.2):
            time, angle, vector = vectors(drift)
            count = round(BEAT_S / (10.0 * TURN_S))
            mean = np.convolve(vector, np.full(count, 1.0 / count), 'valid')
            left = followed(time, angle + rpm_to_rad_s(wrong) * time, vector)
            found = [f'{np.abs(one).min():.2f} - {np.abs(one).max():.2f}'
                     for one in (vector, mean, left[time > FROM_S])]
            print(f'{drift:11g}  {wrong:21g}  {found[0]}  {found[1]:14s}  {found[2]}')


if __name__ == '__main__':
    main()
