"""By what is a running machine judged? The band of its soil, its resonances, its supports."""

from collections.abc import Sequence
from dataclasses import dataclass
import json
import os
from pathlib import Path
import subprocess
import sys

import numpy as np

from rotorsoil_ros.case import config, models
from rotorsoil_ros.case.cache import Cache, content_key
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.expectation import Expectation
from rotorsoil_ros.physics.arrays import ComplexArray
from rotorsoil_ros.physics.band import Envelope
from rotorsoil_ros.physics.coupled import CoupledModel
from rotorsoil_ros.physics.errors import RotorSoilError
from rotorsoil_ros.physics.quasistatic import Resonance

_KIND = 'criteria'
_AXES = 'xz'
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

    """

    envelope: Envelope | None
    resonances: tuple[Resonance, ...]
    natural_speeds: tuple[float, float]

    def lowest_natural_speed(self, axis: str) -> float:
        """Return the lowest frequency of machine and support along x or z [rad/s], or inf."""
        return self.natural_speeds[_AXES.index(axis)]

    def to_arrays(self) -> dict[str, np.ndarray]:
        """Return everything as plain arrays."""
        arrays = {
            'resonances': np.array([(resonance.speed, resonance.damping_ratio)
                                    for resonance in self.resonances]).reshape(-1, 2),
            'natural_speeds': np.array(self.natural_speeds)}
        if self.envelope is not None:
            band = self.envelope
            arrays |= {'speed': band.speed, 'low': band.low, 'high': band.high,
                       'behind': band.behind, 'ahead': band.ahead}
        return arrays

    @classmethod
    def from_arrays(cls, arrays: dict[str, np.ndarray]) -> 'Criteria':
        """Rebuild criteria from `to_arrays`."""
        envelope = None
        if 'speed' in arrays:
            envelope = Envelope(*(arrays[name] for name in (
                'speed', 'low', 'high', 'behind', 'ahead')))
        x, z = arrays['natural_speeds'].tolist()
        return cls(envelope, tuple(Resonance(*row) for row in arrays['resonances'].tolist()),
                   (x, z))


def criteria_key(case: Case, model: CoupledModel, unbalance: ComplexArray) -> str:
    """Return what identifies the criteria of a case under an unbalance, (p,) [kg m]."""
    return content_key(_KIND, models.response_key(case, model), case.uncertainty, unbalance)


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
    if stored is not None:
        return stored
    solved = Expectation.of(case, directory)
    found = Criteria(
        None if solved.band is None else solved.envelope(unbalance), tuple(solved.resonances),
        (solved.lowest_natural_speed('x'), solved.lowest_natural_speed('z')))
    Cache(directory).store(
        _KIND, criteria_key(case, model, unbalance), found.to_arrays())
    return found


def start_aside(
    file: Path, unbalance: ComplexArray, directory: Path,
) -> 'subprocess.Popen[str]':
    """Start a process of low priority that leaves the criteria of a case in the cache."""
    parts = json.dumps(unbalance.view(float).tolist())
    return subprocess.Popen(
        [sys.executable, '-m', __name__, str(file), str(directory), parts],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        env={**os.environ, 'OMP_NUM_THREADS': '1'})


def _main(arguments: Sequence[str]) -> None:
    file, directory, parts = arguments
    os.nice(_NICE)
    try:
        case = config.load(Path(file))
        criteria(case, models.coupled_model(case, Path(directory)),
                 np.array(json.loads(parts), dtype=float).view(complex), Path(directory))
    except RotorSoilError as error:
        raise SystemExit(str(error)) from error


if __name__ == '__main__':
    _main(sys.argv[1:])
