"""What several machines do together, and who shakes whom."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, Numbers
from rotorsoil_ros.case import document
from rotorsoil_ros.case.machine import Machine, seats_moved
from rotorsoil_ros.case.quantities import is_name
from rotorsoil_ros.channel import across, Channel
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.machine.support import Support
from rotorsoil_ros.prediction import columns_of
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, rpm_to_rad_s, to_mm_s_rms

# Machines nearer than this are heard to beat [Hz].
BEATING_HZ = 2.0


class Beat(NamedTuple):
    """Two machines whose speeds are close: between which amplitudes the worst housing swings."""

    first: str
    second: str
    period_s: float
    channel: Channel
    lowest: float
    highest: float


@dataclass(frozen=True)
class Shaken:
    """
    What every machine of a plant does to every channel, each at its own frequency.

    Parts of different frequency have no phase to each other: their squares add up, not they.

    Attributes
    ----------
    sources : tuple of str
        Machines that turn, m of them.
    channels : tuple of Channel
        Of the whole plant.
    speed : (m,) float array
        Of each source, which is also its frequency [rad/s].
    displacement : (m, c) complex array
        Its part, zero-to-peak [m, rad].

    """

    sources: tuple[str, ...]
    channels: tuple[Channel, ...]
    speed: FloatArray
    displacement: ComplexArray

    @property
    def velocity_rms(self) -> FloatArray:
        """All parts together, (c,) [m/s rms, rad/s rms]."""
        return np.asarray(np.sqrt((self._velocity**2).sum(axis=0) / 2.0))

    def velocity_mm_s_rms(self) -> FloatArray:
        """Return all parts together, (c,) [mm/s rms], of rotations [mrad/s rms]."""
        return to_mm_s_rms(math.sqrt(2.0) * self.velocity_rms)

    @property
    def own_rms(self) -> FloatArray:
        """Part of each source by itself, (m, c) [m/s rms, rad/s rms]."""
        return np.asarray(self._velocity / math.sqrt(2.0))

    @property
    def highest(self) -> FloatArray:
        """Displacement that all parts reach where their peaks meet, (c,) [m, rad]."""
        return np.asarray(np.abs(self.displacement).sum(axis=0))

    @property
    def share(self) -> FloatArray:
        """Share of each source in the square of the velocity, (m, c); NaN where nothing moves."""
        square = self._velocity**2
        with np.errstate(invalid='ignore'):
            return np.asarray(square / square.sum(axis=0))

    def __getitem__(self, names: str | tuple[str, ...]) -> 'Shaken':
        """Return some channels only, as a `Response` does."""
        columns = columns_of(self.channels, names)
        return Shaken(self.sources, tuple(self.channels[column] for column in columns),
                      self.speed, self.displacement[:, columns])

    @property
    def _velocity(self) -> FloatArray:
        return np.abs(self.speed)[:, None] * np.abs(self.displacement)

    def beats(self) -> Iterator[Beat]:
        """Yield which two sources are close in frequency, and what that does to a housing."""
        housings = [index for index, channel in enumerate(self.channels) if channel.is_housing]
        size = np.abs(self.displacement[:, housings])
        for first, second in combinations(range(len(self.sources)), 2):
            apart = abs(float(rad_s_to_hz(self.speed[first] - self.speed[second])))
            if apart < BEATING_HZ and min(self.speed[first], self.speed[second]) > 0.0:
                both = size[first] + size[second]
                worst = int(both.argmax())
                yield Beat(self.sources[first], self.sources[second],
                           1.0 / apart if apart else math.inf, self.channels[housings[worst]],
                           abs(float(size[first, worst] - size[second, worst])),
                           float(both[worst]))


@dataclass(frozen=True)
class Plant:
    """
    Several machines on the same blocks, each of them a `Machine` among its neighbours.

    Attributes
    ----------
    name : str
        Of the plant.
    machines : mapping of str to Machine
        Those that turn.

    """

    name: str
    machines: Mapping[str, Machine]

    @classmethod
    def load(
        cls, case: str | Path, *, cache_directory: str | Path | None = None,
        overrides: Sequence[str] = (),
    ) -> 'Plant':
        """
        Read a case file with several machines.

        Parameters
        ----------
        case : str or Path
            The YAML file.
        cache_directory : str, Path or None
            Where computed tables lie; None for the usual place.
        overrides : sequence of str
            Settings `key.path=value` on top of it.

        Raises
        ------
        InputError
            If the file is wrong, or tells of one machine only.

        """
        path = Path(case)
        names = sources_of(path, overrides)
        if not names:
            raise InputError(f'{path}: machines: is missing; a plant has several')
        machines = {name: Machine.load(path, cache_directory=cache_directory,
                                       overrides=[*overrides, f'source={name}'])
                    for name in names}
        berth = machines[names[0]].case.berth
        assert berth is not None
        return cls(berth.plant, machines)

    @property
    def rated_rpm(self) -> dict[str, float]:
        """Speed of every machine at which its neighbours take it to run [rpm]."""
        berths = {name: machine.case.berth for name, machine in self.machines.items()}
        return {name: float(rad_s_to_rpm(berth.rated_speed))
                for name, berth in berths.items() if berth is not None}

    @property
    def _support(self) -> Support:
        """The blocks below all bearings, the same for every machine."""
        return next(iter(self.machines.values())).model.support

    @property
    def seats(self) -> tuple[Channel, ...]:
        """What `seat_receptance` is over: x and z of every bearing of every machine."""
        return tuple(channel for bearing in self._support.bearings
                     for channel in across(bearing.name))

    def seat_receptance(self, *, hz: Numbers) -> ComplexArray:
        """
        Solve for the motion of what all bearings stand on, without any rotor.

        Parameters
        ----------
        hz : float or (n,) floats
            Frequencies [Hz].

        Returns
        -------
        (n, 2 b, 2 b) complex array
            Displacement per force over `seats`, response first [m/N].

        Raises
        ------
        OutOfTableError, NotSolvedError
            As `Machine.seat_receptance`.

        """
        return seats_moved(self._support, hz)

    def shaken(self, *, rpm: Mapping[str, float] | None = None) -> Shaken:
        """
        Solve for what every machine does to every channel.

        Parameters
        ----------
        rpm : mapping of str to float
            Speed of machines [rpm], 0 for one that stands; those not named run at their rated
            speed.

        Raises
        ------
        RotorSoilError
            If there is no such machine.
        OutOfTableError, NotSolvedError
            As `Machine.response`.

        """
        for name in rpm or {}:
            if name not in self.machines:
                raise RotorSoilError(f'rpm must be of one of {", ".join(self.machines)}, '
                                     f'got {name}')
        speeds = self.rated_rpm | dict(rpm or {})
        channels = next(iter(self.machines.values())).model.channels
        parts = [machine.response(rpm=speeds[name]).displacement[0] if speeds[name] else
                 np.zeros(len(channels), dtype=complex)
                 for name, machine in self.machines.items()]
        return Shaken(tuple(self.machines), channels,
                      rpm_to_rad_s(np.array([speeds[name] for name in self.machines])),
                      np.array(parts))


def plants_of(machines: Mapping[str, Machine]) -> dict[str, dict[str, Machine]]:
    """
    Return the machines of every plant, by its name.

    That is what comes before the slash in `<plant>/<machine>`, or else what the case calls it;
    one machine alone under a name of its own is no plant.
    """
    whole, loose = dict[str, dict[str, Machine]](), dict[str, dict[str, Machine]]()
    for name, machine in machines.items():
        berth, plant = machine.case.berth, name.rpartition('/')[0]
        if plant:
            whole.setdefault(plant, {})[name] = machine
        elif berth is not None:
            loose.setdefault(berth.plant, {})[name] = machine
    return whole | {plant: among for plant, among in loose.items() if len(among) > 1}


def sources_of(path: Path, overrides: Sequence[str] = ()) -> tuple[str, ...]:
    """
    Return which machines of a case file each want an answer of their own.

    Nothing where the file tells of one machine, or says itself which one is meant.
    """
    path, own = document.chosen(path)
    content = document.read(path)
    document.override(content, [*own, *overrides])
    if 'machines' not in content or content.get('source') is not None:
        return ()
    machines = content['machines']
    named = [machine for machine in (machines if isinstance(machines, list) else [])
             if isinstance(machine, dict) and is_name(machine.get('name'))]
    # What else is wrong with a file is told where one of its machines is read.
    return tuple(machine['name'] for machine in named if machine.get('idle') is not True) or ('',)
