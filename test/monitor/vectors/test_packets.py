"""What packets of samples tell of an amplitude, when a case allows it, against known motions."""

import math

import numpy as np

from rotorsoil_ros.case.entries.sensors import Pickup
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.events import Samples
from rotorsoil_ros.monitor.vectors.demodulation import Demodulator
from rotorsoil_ros.monitor.vectors.history import History
from rotorsoil_ros.monitor.vectors.refusal import Flaw

X = Channel.parse('drive_end_housing_x')
SWING = 20e-6


def demodulated(seed, *, latency, comes_in_packets=True):
    """Return the vectors of a sensor whose packets, 4 to 32, travel up to a latency [s]."""
    random = np.random.default_rng(seed)
    size, frequency = int(2**random.uniform(2.0, 5.0)), random.uniform(10.0, 50.0)
    rate, speed = frequency * random.uniform(20.0, 60.0), 2.0 * math.pi * frequency
    time = np.arange(int(30.5 / frequency * rate) // size * size) / rate
    first = SWING * speed**2
    values = -first * np.cos(speed * time) + 0.3 * first * np.cos(2.0 * speed * time + 1.0)
    values += random.normal(scale=0.05 * first, size=len(time))
    arrival = time[size - 1::size] + random.uniform(0.0, latency, size=len(time) // size)
    stamps = np.repeat(np.rint(arrival * 1e9).astype(np.int64) + 10**9, size)
    history = History()
    told = np.arange(0.0, time[-1] + 1.0, 0.02)
    history.add(np.rint(told * 1e9).astype(np.int64) + 10**9 - 10**7, np.full(len(told), speed),
                np.mod(speed * (told - 0.01), 2.0 * np.pi))
    demodulator = Demodulator('fan', X, history, turns=10.0, pickup=Pickup(
        comes_in_packets=comes_in_packets, has_filter=True))
    demodulator.take(Samples('fan', X, stamps, values))
    return list(demodulator.vectors()), demodulator.refusals


def test_amplitudes_out_of_packets_are_right_within_what_they_say():
    """Transport of 0 to 1 ms, of which nothing is known."""
    found = [(abs(event.amplitude[:, 0] - SWING), event.deviation, event.phase)
             for seed in range(100) for event in demodulated(seed, latency=1e-3)[0]]
    away, said = (np.concatenate(part) for part in list(zip(*found, strict=True))[:2])
    assert len(away) > 150
    assert np.quantile(away, 0.5) < 0.005 * SWING
    assert np.quantile(away, 0.9) < 0.012 * SWING
    assert np.mean(away < 3.0 * said) > 0.98
    assert all(np.isnan(phase).all() for _, _, phase in found)


def test_packets_are_refused_where_the_case_does_not_allow_them():
    found, refusals = demodulated(1, latency=1e-3, comes_in_packets=False)
    assert not found
    assert refusals.counts[Flaw.PACKETS] == refusals.stretches


def test_packets_whose_transport_scatters_too_much_are_refused():
    """By 30 ms, of turns of 20 to 100 ms; what is kept all the same says how far it errs."""
    stretches, kept = 0, []
    for seed in range(40):
        found, refusals = demodulated(seed, latency=0.03)
        stretches += refusals.stretches
        kept += [each for event in found for each in zip(
            np.abs(event.amplitude[:, 0] - SWING), event.deviation, strict=True)]
    assert len(kept) < 0.1 * stretches
    assert all(away < 3.0 * said for away, said in kept)
