"""
Measure which stretches of raw samples are refused, wrongly or rightly, and what a vector costs.

    python -m benchmarks.data_quality
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
import time as clock

import numpy as np

from rotorsoil_ros.case.entries.sensors import Pickup
from rotorsoil_ros.monitor.vectors.orders import demodulate, OrderVector, SpeedTrack, Turning
from rotorsoil_ros.monitor.vectors.stretch import Finding, Stretch

RECORDS = 400
TURNS = 10.0


@dataclass(frozen=True)
class Record:
    """Samples of eleven turns whose 1X is known: times [s], values [m/s^2], truth [m]."""

    time: np.ndarray
    values: np.ndarray
    track: SpeedTrack
    truth: complex
    speed: float
    step: float
    first: float
    random: np.random.Generator


def record(random: np.random.Generator, *, frequency: float | None = None,
           rate: float | None = None, plain: bool = False) -> Record:
    """
    Return a record as a sound sensor would give it.

    1X of 5 to 60 Hz and 0.1 to 20 m/s^2 at 8 to 200 samples a turn, harmonics to 10X below half
    the rate, a bearing's tone, noise, ramps, true jitter, lost samples, gravity and resolution;
    plain: 1X, 2X and noise of 2 % only.
    """
    f = frequency or random.uniform(5.0, 60.0)
    fs = rate or float(np.exp(random.uniform(np.log(max(200.0, 8.0 * f)), np.log(4000.0))))
    speed = 2.0 * np.pi * f
    alpha = 0.0 if plain or random.random() < 0.5 else random.uniform(-1.0, 1.0) * 10.5
    seconds = (TURNS + 2.0) / f
    time = np.arange(0.0, seconds, 1.0 / fs)
    if not plain and random.random() < 0.5:
        time = time + random.uniform(-0.1, 0.1, len(time)) / fs
    if not plain and random.random() < 0.3:
        time = time[random.random(len(time)) > random.uniform(0.0, 0.2)]
    time = time - time[0]
    first = float(np.exp(random.uniform(np.log(0.1), np.log(20.0))))
    marks = np.linspace(0.0, seconds * 1.2, 60)
    track = SpeedTrack(marks, speed + alpha * marks, angle_at_start=0.0)
    angle, omega, _ = track.at(time)
    truth = first / speed**2 * np.exp(1j * random.uniform(0.0, 2.0 * np.pi))
    values = ((1j * alpha - omega**2) * truth * np.exp(1j * angle)).real
    for order in ((2,) if plain else range(2, 11)):
        if order * f < 0.45 * fs:
            values += first * random.uniform(0.0, 0.5) * np.cos(
                order * angle + random.uniform(0.0, 6.3))
    if not plain and random.random() < 0.7:
        tone = random.uniform(3.1, 12.7)
        if tone * f < 0.45 * fs:
            values += first * random.uniform(0.0, 1.0) * np.cos(
                tone * angle + random.uniform(0.0, 6.3))
    values += first * (0.02 if plain else random.uniform(0.01, 0.2)) * random.normal(
        size=len(time))
    values += 9.81 if random.random() < 0.5 else 0.0
    resolution = 0.0006 if plain else float(np.exp(random.uniform(np.log(0.0006), np.log(0.038))))
    return Record(time, np.rint(values / resolution) * resolution, track, complex(truth), speed,
                  1.0 / fs, first, random)


def find(made: Record, *, has_filter: bool = True) -> tuple[OrderVector | str, Record]:
    """Return the vector of the first ten turns of a record, or the flaw that refuses it."""
    order = np.lexsort((made.values, made.time))
    time, values = made.time[order], made.values[order]
    again = np.concatenate([[False], (np.diff(time) == 0.0) & (np.diff(values) == 0.0)])
    time, values = time[~again], values[~again]
    inside = (time >= made.track.time[0]) & (time <= made.track.time[-1])
    time, values = time[inside], values[inside]
    angle = made.track.at(time)[0]
    end = int(np.argmax(angle - angle[0] >= TURNS * 2.0 * np.pi)) or len(time) - 1
    stretch = Stretch(Turning.of(time[:end], made.track), values[:end], np.abs(values[:end]),
                      float(time[end]), TURNS, Pickup(has_filter=has_filter))
    found = Finding(stretch, made.track).vector()
    return (found if isinstance(found, OrderVector) else str(found.flaw)), replace(
        made, time=time[:end], values=values[:end])


def clipped(made: Record) -> Record:
    """Clip at 50 to 95 % of the peak, both ways about the mean."""
    middle = float(np.median(made.values))
    rail = made.random.uniform(0.5, 0.95) * float(np.max(np.abs(made.values - middle)))
    return replace(made, values=np.clip(made.values, middle - rail, middle + rail))


def frozen(made: Record) -> Record:
    """Freeze from somewhere on."""
    at = int(made.random.uniform(0.0, 0.7) * len(made.values))
    values = made.values.copy()
    values[at:] = values[at]
    return replace(made, values=values)


def few_spikes(made: Record) -> Record:
    """Add one to three spikes of 20 to 100 times the root mean square."""
    return _spiked(made, int(made.random.integers(1, 4)))


def many_spikes(made: Record) -> Record:
    """Add eight to nineteen of them."""
    return _spiked(made, int(made.random.integers(8, 20)))


def jumping(made: Record) -> Record:
    """Let the offset jump by 1 to 20 times 1X."""
    at = int(made.random.uniform(0.2, 0.6) * len(made.values))
    values = made.values.copy()
    values[at:] += made.first * made.random.uniform(1.0, 20.0)
    return replace(made, values=values)


def drifting(made: Record) -> Record:
    """Let the offset drift by 1 to 20 times 1X."""
    height = made.first * made.random.uniform(1.0, 20.0)
    return replace(made, values=made.values + height * made.time / made.time[-1])


def noisy_stamps(made: Record) -> Record:
    """Let stamps scatter by 0.5 to 2 rad of 1X, whatever was taken when."""
    spread = made.random.uniform(0.5, 2.0) / made.speed
    return _stamped(made, made.time + made.random.normal(scale=spread, size=len(made.time)))


def late_stamps(made: Record) -> Record:
    """Let a queue delay stamps by a random walk that keeps their order, 0.5 to 2 rad of 1X."""
    delay = made.random.exponential(made.random.uniform(0.5, 2.0) / made.speed,
                                    size=len(made.time))
    return _stamped(made, np.maximum.accumulate(made.time + delay))


def stepping_clock(made: Record) -> Record:
    """Set the clock on by 0.5 to 2 rad of 1X."""
    at = made.random.uniform(0.2, 0.6) * made.time[-1]
    step = made.random.uniform(0.5, 2.0) / made.speed
    return _stamped(made, made.time + step * (made.time > at))


def packets(made: Record) -> Record:
    """Stamp packets of 4 to 64 samples when they come, 0 to 20 us apart."""
    size = int(made.random.integers(4, 65))
    number = np.arange(len(made.time))
    last = np.minimum(number // size * size + size - 1, len(number) - 1)
    apart = made.random.choice([0.0, 1e-6, 2e-6, 20e-6])
    return _stamped(made, made.time[last] + apart * (number % size))


def held(made: Record) -> Record:
    """Tell each value two to five times."""
    times = int(made.random.integers(2, 6))
    rows = np.arange(len(made.values)) // times * times
    return replace(made, values=made.values[rows])


def twice(made: Record) -> Record:
    """Tell each sample twice."""
    return replace(made, time=np.repeat(made.time, 2), values=np.repeat(made.values, 2))


def lossy(made: Record) -> Record:
    """Lose 60 % of the samples."""
    kept = made.random.random(len(made.time)) > 0.6
    return replace(made, time=made.time[kept], values=made.values[kept])


def holed(made: Record) -> Record:
    """Lose 50 % in one piece."""
    share = made.time / made.time[-1]
    kept = (share < 0.2) | (share > 0.7)
    return replace(made, time=made.time[kept], values=made.values[kept])


FAMILIES: dict[str, Callable[[Record], Record]] = {
    'sound': lambda made: made, 'sound, 60 % lost': lossy, 'sound, told twice': twice,
    'sound, drift of 1-20 a1': drifting, '1-3 spikes': few_spikes, '8-19 spikes': many_spikes,
    'clipped at 50-95 %': clipped, 'frozen from somewhere on': frozen,
    'offset jumps by 1-20 a1': jumping, 'stamp noise': noisy_stamps,
    'late stamps': late_stamps, 'clock step': stepping_clock, 'packets': packets,
    'held 2-5 times': held, 'half missing in one piece': holed,
}


@dataclass(frozen=True)
class Outcome:
    """Of one family: shares of records, and why they were refused."""

    wrong: float
    refused_wrong: float
    refused_harmless: float
    missed: float
    flaws: Counter[str]


def outcome(spoil: Callable[[Record], Record], records: int, *, seed: int = 0) -> Outcome:
    """
    Return what becomes of spoiled records.

    Wrong: 1X of the plain fit is off by more than 10 %. Missed: kept, off by more than 10 % and
    by three standard errors.
    """
    wrong, refused, missed, flaws = [], [], [], Counter[str]()
    for number in range(records):
        made = spoil(record(np.random.default_rng([seed, number])))
        found, cut = find(made)
        size = abs(made.truth)
        try:
            plain = demodulate(cut.time, cut.values, made.track)
            error = abs(abs(plain.displacement[0]) - size)
            wrong.append(error > 0.1 * size)
        except ValueError:
            wrong.append(True)
        refused.append(isinstance(found, str))
        if isinstance(found, str):
            flaws[found] += 1
            missed.append(False)
        else:
            error = abs(abs(found.displacement[0]) - size)
            missed.append(bool(error > max(0.1 * size, 3.0 * found.deviation[0])))
    bad, gone = np.array(wrong), np.array(refused)
    return Outcome(bad.mean(), gone[bad].mean() if bad.any() else np.nan,
                   gone[~bad].mean() if not bad.all() else np.nan, float(np.mean(missed)), flaws)


def _spiked(made: Record, number: int) -> Record:
    values = made.values.copy()
    at = made.random.choice(int(0.7 * len(values)), number, replace=False)
    values[at] += made.random.choice([-1.0, 1.0], number) * np.std(values) * made.random.uniform(
        20.0, 100.0, number)
    return replace(made, values=values)


def _stamped(made: Record, time: np.ndarray) -> Record:
    return replace(made, time=np.maximum(time, 0.0))


def cost() -> None:
    """Print what a vector costs, with its gates and without."""
    made = find(record(np.random.default_rng(1), frequency=25.0, rate=1010.0, plain=True))[1]
    stretch = Stretch(Turning.of(made.time, made.track), made.values,
                      np.abs(made.values), float(made.time[-1] + made.step), TURNS, Pickup())
    for name, run in (
            ('with gates', lambda: Finding(stretch, made.track).vector()),
            ('fit alone', lambda: demodulate(made.time, made.values, made.track))):
        seconds = []
        for _ in range(300):
            start = clock.perf_counter()
            run()
            seconds.append(clock.perf_counter() - start)
        print(f'vector of {len(made.time)} samples, {name}: {1e6 * min(seconds):.0f} us best, '
              f'{1e6 * float(np.median(seconds)):.0f} us median')


def main() -> int:
    """Print the table of docs/comparison.md."""
    print('| samples | 1X wrong by 10 % unguarded | of these refused | of the others refused | '
          'kept though wrong | reasons |\n|---|---|---|---|---|---|')
    for name, spoil in FAMILIES.items():
        seen = outcome(spoil, RECORDS)
        shares = ' | '.join('-' if np.isnan(share) else f'{100 * share:.1f} %' for share in (
            seen.wrong, seen.refused_wrong, seen.refused_harmless, seen.missed))
        print(f'| {name} | {shares} | '
              f'{", ".join(flaw for flaw, _ in seen.flaws.most_common(3))} |', flush=True)
    cost()
    return 0


if __name__ == '__main__':
    raise SystemExit(main())
