"""What if the ground were softer, the block heavier? One machine with all values of some keys."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
import math
from pathlib import Path

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, Numbers, numbers
from rotorsoil_ros.background import Mapper
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.machine import load, Machine
from rotorsoil_ros.case.summary import unstable as grown
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError, RotorSoilError
from rotorsoil_ros.prediction import columns_of
from rotorsoil_ros.units import rpm_to_rad_s, to_mm_s_rms

MOST_VARIANTS = 100_000


@dataclass(frozen=True, slots=True)
class Variant:
    """
    One machine to be tried, in words that another process understands.

    Attributes
    ----------
    case : Case
        The machine as it is.
    directory : Path
        Of the cache.
    settings : tuple of str
        What is different, `key.path=value`.
    rpm : (n,) float array
        Where it is asked.

    """

    case: Case
    directory: Path
    settings: tuple[str, ...]
    rpm: FloatArray


@dataclass(frozen=True, slots=True)
class Tried:
    """Channels, displacements, (n, c) [m, rad], of a variant; why none, or why not all."""

    channels: tuple[Channel, ...] = ()
    displacement: ComplexArray | None = None
    failure: str = ''
    unstable: str = ''


@dataclass(frozen=True, slots=True, eq=False)
class Study:
    """
    The response of a machine with all values of some keys of its case.

    Attributes
    ----------
    values : dict of str to (k,) float array
        By key path what was tried; the first axes of all below follow them.
    rpm : (n,) float array
        Rotor speeds [rpm].
    channels : tuple of Channel
        What moves.
    displacement : (..., n, c) complex array
        [m, rad], zero-to-peak; NaN where a variant has no steady response.
    failures, unstable : dict of tuple to str
        By index why a variant has no answer at all, and why not at every speed.

    """

    values: dict[str, FloatArray]
    rpm: FloatArray
    channels: tuple[Channel, ...]
    displacement: ComplexArray
    failures: dict[tuple[int, ...], str]
    unstable: dict[tuple[int, ...], str] = field(default_factory=dict)

    @property
    def is_steady(self) -> BoolArray:
        """Whether a variant has a steady response at every speed, (...)."""
        return np.asarray(np.isfinite(self.displacement).all(axis=(-2, -1)))

    def velocity_mm_s_rms(self) -> FloatArray:
        """Return velocities, (..., n, c) [mm/s rms], of rotations [mrad/s rms]."""
        return to_mm_s_rms(rpm_to_rad_s(self.rpm)[:, None] * np.abs(self.displacement))

    def highest_mm_s_rms(self, *names: str) -> FloatArray:
        """
        Return the highest velocity of each variant over the speeds, (...) [mm/s rms].

        Parameters
        ----------
        *names : str
            Of which channels; none: of all housings.

        Returns
        -------
        float array
            NaN where one of the speeds has no steady response.

        """
        chosen = names or tuple(str(channel) for channel in self.channels if channel.is_housing)
        columns = columns_of(self.channels, chosen)
        return np.asarray(self.velocity_mm_s_rms()[..., columns].max(axis=(-2, -1)))

    def rows(self) -> Iterator[dict[str, float | str]]:
        """Yield a row for every variant, speed and channel, units in the names."""
        velocity, size = self.velocity_mm_s_rms(), np.abs(self.displacement)
        phase = np.angle(self.displacement)
        for place in np.ndindex(*self.displacement.shape[:-2]):
            tried = {key: float(values[index]) for index, (key, values) in zip(
                place, self.values.items(), strict=True)}
            for row, rpm in enumerate(self.rpm.tolist()):
                for column, channel in enumerate(self.channels):
                    at = (*place, row, column)
                    yield {**tried, 'speed_rpm': rpm, 'channel': str(channel),
                           f'amplitude_{channel.unit}': float(size[at]),
                           'phase_rad': float(phase[at]), **(
                               {} if channel.is_rotation
                               else {'velocity_mm_s_rms': float(velocity[at])}),
                           'failure': '' if np.isfinite(size[at]) else (
                               self.failures.get(place) or self.unstable.get(place, ''))}


def study(
    case: Machine | Path | str, values: Mapping[str, Sequence[float] | FloatArray], *,
    rpm: Numbers, map: Mapper[Variant, Tried] = map,  # noqa: A002, as every executor calls it
    cache_directory: str | Path | None = None,
) -> Study:
    """
    Solve a machine with all combinations of values of some keys of its case.

    Parameters
    ----------
    case : Machine, Path or str
        The machine, or its case file.
    values : mapping of str to floats
        By key path, as in `soil.shear_modulus` or `foundations.0.mass`, what is tried, in the
        unit of the case.
    rpm : float or (n,) floats
        Rotor speeds [rpm]: each is solved, no table is made.
    map : callable
        `map` itself, or that of an executor.
    cache_directory : str, Path or None
        Of tables; the user's by default.

    Returns
    -------
    Study
        A variant that cannot be solved or is no machine has a reason in place of an answer.

    Raises
    ------
    InputError
        If the case is wrong, no key or value is given, a value is not finite, a key is not one
        that a case may have, there are too many variants, or none has an answer.

    """
    machine = case if isinstance(case, Machine) else load(case, cache_directory=cache_directory)
    tried = {key: _finite(key, each) for key, each in values.items()}
    count = math.prod(len(each) for each in tried.values())
    if not tried or count > MOST_VARIANTS:
        raise InputError(f'{machine.case.path}: must have 1 to {MOST_VARIANTS} variants, got '
                         f'{count if tried else 0}')
    speeds = numbers('rpm', rpm)
    variants = [Variant(machine.case, machine.directory, tuple(
        f'{key}={value!r}' for key, value in zip(tried, chosen, strict=True)), speeds)
        for chosen in product(*(each.tolist() for each in tried.values()))]
    return _study(tried, speeds, list(map(try_variant, variants)))


def _finite(key: str, values: Sequence[float] | FloatArray) -> FloatArray:
    found = np.asarray(values, dtype=float)
    if found.ndim != 1 or not len(found) or not np.isfinite(found).all():
        raise InputError(f'{key}: must be one or more finite numbers, got {values!r}')
    return found


def try_variant(variant: Variant) -> Tried:
    """Solve one variant; what cannot be solved is a reason."""
    try:
        machine = Machine(variant.case.changed(variant.settings), variant.directory)
        found = machine.response(rpm=variant.rpm).displacement
        # What has no steady response says why, beside those of its speeds that have one.
        why = '' if np.isfinite(found).all() else '; '.join(grown(machine.stability(
            rpm_range=(float(variant.rpm.min()), float(variant.rpm.max())))))
        return Tried(machine.model.channels, found, unstable=why)
    except RotorSoilError as error:
        return Tried(failure=str(error))


def _study(
    values: dict[str, FloatArray], rpm: FloatArray, tried: Sequence[Tried],
) -> Study:
    answered = [each for each in tried if each.displacement is not None]
    if not answered:
        raise InputError(f'no variant has an answer; the first: {tried[0].failure}')
    channels = answered[0].channels
    shape = tuple(len(each) for each in values.values())
    found = np.full((len(tried), len(rpm), len(channels)), complex(np.nan, np.nan))
    failures: dict[tuple[int, ...], str] = {}
    unstable: dict[tuple[int, ...], str] = {}
    for index, each in enumerate(tried):
        place = tuple(int(number) for number in np.unravel_index(index, shape))
        if each.displacement is None:
            failures[place] = each.failure
        elif each.channels != channels:
            failures[place] = 'its channels are others than those of the first variant'
        else:
            found[index] = each.displacement
            unstable |= {place: each.unstable} if each.unstable else {}
    return Study(values, rpm, channels, found.reshape(*shape, len(rpm), len(channels)), failures,
                 unstable)
