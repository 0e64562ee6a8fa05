"""By what is a running machine judged? The band of its soil, its resonances, its supports."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import json
from pathlib import Path

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.background import Child, run_as_child
from rotorsoil_ros.case import config, models
from rotorsoil_ros.case.cache import Cache, content_key
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.summary import clipped, unstable
from rotorsoil_ros.case.zone_limits import RIGID_MARGIN
from rotorsoil_ros.channel import ACROSS
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.machine.band import Envelope, ResponseBand
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.modes.critical import critical_speeds, CriticalSpeed
from rotorsoil_ros.machine.modes.natural import lowest_natural_frequency
from rotorsoil_ros.machine.response import Predictor, ResponseTable
from rotorsoil_ros.monitor.quasistatic import Resonance

# Critical speeds are looked for between these multiples of the highest speed.
_LOOKED_FOR = (0.02, 1.3)


@dataclass(frozen=True)
class Expectation:
    """
    A case, solved.

    Attributes
    ----------
    case : Case
        The machine.
    model : CoupledModel
        What it stands for.
    table : ResponseTable
        Its response.
    modes : tuple of CriticalSpeed
        Where omega = Omega, a little beyond the speed range.
    band : ResponseBand or None
        Its response on other soils; None on a support that knows of no soil.
    directory : Path
        Of the cache.
    note : str
        What could not be found, and why; empty if everything was.

    """

    case: Case
    model: CoupledModel
    table: ResponseTable
    modes: tuple[CriticalSpeed, ...]
    band: ResponseBand | None
    directory: Path
    note: str = ''

    @classmethod
    def of(cls, case: Case, directory: Path) -> 'Expectation':
        """Solve a case, with tables out of a cache, on its soil and all of its spread."""
        model = models.coupled_model(case, directory)
        table = models.response_table(case, model, directory)
        band = models.response_band(case, model, table, directory, case.uncertainty)
        notes = list(unstable(table.stability))
        if band is not None and band.unstable:
            notes.append(band.unstable)
        low, high = (share * case.speed_range[1] for share in _LOOKED_FOR)
        span = model.support.within(model.bearings.within_tables(
            (min(low, case.speed_range[0] or low), high)))
        notes += clipped(model, span, (low, high))
        try:
            modes = critical_speeds(model, span)
        except NotSolvedError as error:
            modes = ()
            notes.append(f'critical speeds of the model are not known: {error}')
        return cls(case, model, table, modes, band, directory, '; '.join(notes))

    @property
    def criticals(self) -> tuple[CriticalSpeed, ...]:
        """Critical speeds in the speed range."""
        low, high = self.case.speed_range
        return tuple(mode for mode in self.modes if low <= mode.speed <= high)

    @property
    def resonances(self) -> list[Resonance]:
        """Critical speeds and damping ratios of modes that decay: others have no steady peak."""
        return [Resonance(mode.speed, mode.damping_ratio) for mode in self.modes
                if mode.damping_ratio >= 0.0]

    def lowest_natural_speed(self, axis: str) -> float:
        """Return the lowest frequency of machine and support along x or z [rad/s], or inf."""
        highest = RIGID_MARGIN * _LOOKED_FOR[1] * self.case.speed_range[1]
        return lowest_natural_frequency(self.model, axis=axis, highest=highest)

    def vector(self, unbalances: Mapping[str, complex]) -> ComplexArray:
        """Return the unbalance of every plane [kg m]; a plane that is not named has none."""
        return np.array([unbalances.get(plane, 0.0) for plane in self.table.planes],
                        dtype=complex)

    def criteria(self, unbalance: ComplexArray) -> 'Criteria':
        """
        Return by what a measurement is judged under an unbalance, (p,) [kg m].

        What the cache holds comes first: a judge is right to the last bit, and older linear
        algebra is not the same to the last bit from one solution to the next.
        """
        stored = stored_criteria(self.case, self.model, unbalance, self.directory)
        if stored is not None:
            return stored
        found = Criteria(
            None if self.band is None else self.band.envelope(unbalance),
            tuple(self.resonances), (self.lowest_natural_speed('x'),
                                     self.lowest_natural_speed('z')),
            '' if self.band is None else self.band.unstable)
        Cache(self.directory).store(
            _KIND, criteria_key(self.case, self.model, unbalance), found.to_arrays())
        return found


def answer(predictor: Predictor, speed: FloatArray) -> ComplexArray:
    """Return displacements, (m, c), NaN where the table has none."""
    return predictor.answer(speed).displacement


_KIND, _FORM = 'criteria', 2  # of what is stored under the name
_NICE = 19


@dataclass(frozen=True)
class Criteria:
    """
    What a measurement is held against, besides the prediction itself.

    Attributes
    ----------
    envelope : Envelope or None
        Band of the response under one unbalance; None on a support that knows of no soil.
    resonances : tuple of Resonance
        Critical speeds, a little beyond the speed range.
    natural_speeds : tuple of two floats
        Lowest frequency of machine and support along x and along z [rad/s], inf where none.
    note : str
        What the band leaves out; empty where it holds all machines that this one may be.

    """

    envelope: Envelope | None
    resonances: tuple[Resonance, ...]
    natural_speeds: tuple[float, float]
    note: str = ''

    def lowest_natural_speed(self, axis: str) -> float:
        """Return the lowest frequency of machine and support along x or z [rad/s], or inf."""
        return self.natural_speeds[ACROSS.index(axis)]

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return everything as plain arrays."""
        arrays = {
            'resonances': np.array([(resonance.speed, resonance.damping_ratio)
                                    for resonance in self.resonances]).reshape(-1, 2),
            'natural_speeds': np.array(self.natural_speeds), 'note': np.array(self.note)}
        if self.envelope is not None:
            band = self.envelope
            arrays |= {'speed': band.speed, 'low': band.low, 'high': band.high,
                       'behind': band.behind, 'ahead': band.ahead}
        return arrays

    @classmethod
    def from_arrays(cls, arrays: Mapping[str, np.ndarray]) -> 'Criteria':
        """Rebuild criteria from `to_arrays`."""
        envelope = None
        if 'speed' in arrays:
            envelope = Envelope(*(arrays[name] for name in (
                'speed', 'low', 'high', 'behind', 'ahead')))
        x, z = arrays['natural_speeds'].tolist()
        return cls(envelope, tuple(Resonance(*row) for row in arrays['resonances'].tolist()),
                   (x, z), str(arrays['note']))


def criteria_key(case: Case, model: CoupledModel, unbalance: ComplexArray) -> str:
    """Return what identifies the criteria of a case under an unbalance, (p,) [kg m]."""
    return content_key(_KIND, _FORM, models.response_key(case, model), case.uncertainty, unbalance)


def stored_criteria(
    case: Case, model: CoupledModel, unbalance: ComplexArray, directory: Path,
) -> Criteria | None:
    """Return criteria if the cache holds them."""
    arrays = Cache(directory).load(_KIND, criteria_key(case, model, unbalance))
    return None if arrays is None else Criteria.from_arrays(arrays)


def criteria(
    case: Case, model: CoupledModel, unbalance: ComplexArray, directory: Path,
) -> Criteria:
    """
    Return criteria, computed and stored if the cache does not hold them.

    Parameters
    ----------
    case, model : Case, CoupledModel
        The machine, and what it stands for.
    unbalance : (p,) complex array
        Of every plane [kg m]: a band is no sum of the bands of its planes.
    directory : Path
        Of the cache.

    Raises
    ------
    RotorSoilError
        If the case cannot be solved on one of its soils.

    """
    stored = stored_criteria(case, model, unbalance, directory)
    return stored or Expectation.of(case, directory).criteria(unbalance)


def compute_aside(file: Path, unbalance: ComplexArray, directory: Path) -> Child:
    """Start a process that leaves the criteria of a case in the cache."""
    parts = json.dumps(unbalance.view(float).tolist())
    return Child(__name__, [str(file), str(directory), parts])


def _compute(arguments: Sequence[str]) -> None:
    file, directory, parts = arguments
    case = config.load(Path(file), cache_directory=Path(directory))
    criteria(case, models.coupled_model(case, Path(directory)),
             np.array(json.loads(parts), dtype=float).view(complex), Path(directory))


if __name__ == '__main__':
    run_as_child(_compute)
