"""The numbers of a case that may be other than it says, and by how much."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math
from typing import Any

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.rotor.disc import permissible_unbalance

_SPEEDS = 'speed_rpm'

# Standard deviation of the logarithm of what is looked for, by the last key of its path that is
# known: soil and bearings are guessed, masses and dimensions are weighed and drawn.
_GUESSED = math.log(2.0)
_SPREADS = {
    'stiffness': math.log(3.0), 'damping': math.log(3.0), 'shear_modulus': _GUESSED,
    'mass': 0.05, 'density': 0.10, 'inertia': 0.10, 'diametral_inertia': 0.10,
    'polar_inertia': 0.10, 'poisson_ratio': 0.10, 'young_modulus': 0.05,
    'shaft_height': 0.03, 'height': 0.03, 'centre_of_gravity_height': 0.03, 'position': 0.03,
    'length': 0.03, 'outer_diameter': 0.02, 'inner_diameter': 0.02, 'half_width': 0.03,
    'half_length': 0.03, 'radius': 0.03,
}
_IS_GUESSED = 0.3  # a spread from which on a value was guessed, not measured

# What a case is taken to be off by where nothing else is known of it.
_TOLERANCES = {
    'foundations.*.mass': 0.05, 'foundations.*.inertia': 0.10, 'soil.loss_factor': 0.50,
    'rotor.bearings.*.stiffness': 0.30, 'rotor.shaft_height': 0.03, 'soil.density': 0.10,
    'foundations.*.centre_of_gravity_height': 0.03,
}
_SOIL = ('soil',)

# Of an unbalance that nobody names: each part, as a share of what balance grade G6.3 allows.
_GRADE, _SHARE_OF_GRADE = 6.3e-3, 0.5


@dataclass(frozen=True)
class Scalar:
    """
    Numbers of a case that are multiplied by one factor.

    Attributes
    ----------
    path : str
        Key path, `*` standing for every entry.
    places : tuple of (str, float)
        Key paths below it and their values in the case.
    spread : float
        Standard deviation of the logarithm of the factor before a run is seen.

    """

    path: str
    places: tuple[tuple[str, float], ...]
    spread: float

    @property
    def is_guessed(self) -> bool:
        """Whether the value in a case is a guess, and not weighed or drawn."""
        return self.spread >= _IS_GUESSED

    def settings(self, factor: float) -> list[str]:
        """Return the numbers times a factor, as `key.path=value`."""
        return [f'{place}={value * factor!r}' for place, value in self.places]


def named(case: Case, paths: Sequence[str]) -> list[Scalar]:
    """
    Return what is asked for.

    Raises
    ------
    InputError
        If a path names no number of the case.

    """
    found = [Scalar(path, tuple(_numbers(case.content, path.split('.'), ())), _spread(path))
             for path in paths]
    for scalar in found:
        if not any(value != 0.0 for _, value in scalar.places):
            raise InputError(f'{case.path}: --identify {scalar.path}: names no number of the case')
    return found


def tolerances(case: Case, asked: Sequence[Scalar], *, has_soil: bool) -> list[Scalar]:
    """Return what the case may be off by; what is asked for, or has no effect, is not."""
    taken = {place for scalar in asked for place, _ in scalar.places}
    found = []
    for path, spread in _TOLERANCES.items():
        steps = path.split('.')
        places = tuple((place, value) for place, value in _numbers(case.content, steps, ())
                       if place not in taken and value != 0.0)
        if places and (has_soil or steps[0] not in _SOIL):
            found.append(Scalar(path, places, spread))
    return found


def unnamed_unbalance(case: Case) -> float:
    """Return the standard deviation of each part of an unbalance that nobody names [kg m]."""
    return _SHARE_OF_GRADE * permissible_unbalance(
        grade=_GRADE, mass=case.rotor.mass, speed=case.speed_range[1])


def _spread(path: str) -> float:
    return next((_SPREADS[step] for step in reversed(path.split('.')) if step in _SPREADS),
                _GUESSED)


def _numbers(
    value: Any, steps: Sequence[str], place: tuple[str, ...],
) -> Iterator[tuple[str, float]]:
    """Yield key path and value of every number at or below a path with wildcards."""
    entries: dict[str, Any] = {}
    if isinstance(value, dict):
        entries = {str(key): entry for key, entry in value.items()}
    elif isinstance(value, list):
        entries = {str(index): entry for index, entry in enumerate(value)}
    if not entries:
        if not steps and isinstance(value, (int, float)) and not isinstance(value, bool):
            yield '.'.join(place), float(value)
        return
    for key, entry in entries.items():
        # The speeds at which a stiffness is given are not part of it.
        if (steps and steps[0] in ('*', key)) or (not steps and key != _SPEEDS):
            yield from _numbers(entry, steps[1:], (*place, key))
