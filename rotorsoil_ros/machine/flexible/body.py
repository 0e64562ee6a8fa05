"""What a foundation that bends is, whatever it was described by: rigid motion, modes, residual."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, Self

import numpy as np
import scipy.linalg

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import require, RotorSoilError

SEAT, CONTACT, PROBE = 'seat', 'contact', 'probe'
# How the ground stands below several contacts; GROUNDED below a body that its own stiffness holds.
WINKLER, GREEN, EACH, GROUNDED = 'winkler', 'green', 'each', 'grounded'

# A residual may be negative by so much of its diagonal, six printed digits; and by so much of the
# whole flexibility: where all modes are kept, the highest leave no more digits to the lowest.
_ROUND_OFF, _OF_WHOLE = 1e-5, 1e-6
# Flexibility of less than this share of the whole is round-off.
_NO_SHAPE = 1e-11


@dataclass(frozen=True, slots=True)
class Dof:
    """
    One motion of one place of a body.

    Attributes
    ----------
    station : str
        Name of the place.
    axis : str
        One of x, y, z, rx, ry, rz.
    kind : str
        `seat`, `contact` or `probe`.
    place : tuple of three floats
        x, y and z in the frame of the body [m]; NaN where nobody says.
    area : float
        Of the contact that it stands for [m^2]; 0 where nobody says.

    """

    station: str
    axis: str
    kind: str
    place: tuple[float, float, float]
    area: float = 0.0

    def __post_init__(self) -> None:
        if self.axis not in DOFS:
            raise RotorSoilError(f'direction must be one of {", ".join(DOFS)}, got {self.axis}')

    @property
    def rigid_row(self) -> list[float]:
        """What a unit motion (x, y, z, rx, ry, rz) of the body about its origin does here."""
        x, y, z = self.place
        return {'x': [1.0, 0.0, 0.0, 0.0, z, -y], 'y': [0.0, 1.0, 0.0, -z, 0.0, x],
                'z': [0.0, 0.0, 1.0, y, -x, 0.0], 'rx': [0.0, 0.0, 0.0, 1.0, 0.0, 0.0],
                'ry': [0.0, 0.0, 0.0, 0.0, 1.0, 0.0],
                'rz': [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]}[self.axis]


@dataclass(frozen=True, eq=False)
class FlexibleBody:
    """
    Elastic body that nothing holds, by what moves at its interface.

    Attributes
    ----------
    dofs : tuple of Dof
        The interface, p motions.
    mass : (6, 6) float array
        Of the rigid body about its origin [kg, kg m, kg m^2].
    rows : (p, 6) float array
        Motion of the interface per rigid motion.
    shapes : (p, m) float array
        Of elastic modes of unit mass [1/sqrt(kg)].
    stiffness : (m,) float array
        Squares of their frequencies [1/s^2].
    residual : (p, p) float array
        Static flexibility of everything that the modes leave out [m/N].
    loss : (m,) float array
        Loss factor of each mode [-].
    residual_loss : float
        Loss factor of the rest [-].
    bed : str
        How the ground stands below several contacts: `winkler`, `green` or `each`; empty for one;
        `grounded` where none is needed.
    reach : float
        Frequency up to which no mode is left out [rad/s].

    References
    ----------
    Theory manual, foundations that bend; Craig & Kurdila, Fundamentals of Structural Dynamics
    (2006), ch. 17, for modes with residual flexibility.

    """

    dofs: tuple[Dof, ...]
    mass: FloatArray
    rows: FloatArray
    shapes: FloatArray
    stiffness: FloatArray
    residual: FloatArray
    loss: FloatArray
    residual_loss: float
    bed: str = ''
    reach: float = np.inf

    def __post_init__(self) -> None:
        count, modes = len(self.dofs), len(self.stiffness)
        wanted = {'mass': (6, 6), 'rows': (count, 6), 'shapes': (count, modes),
                  'residual': (count, count), 'loss': (modes,)}
        for name, shape in wanted.items():
            if getattr(self, name).shape != shape:
                raise RotorSoilError(f'{name} must have shape {shape}, got '
                                     f'{getattr(self, name).shape}')
        if len(set(self.names)) < count:
            twice = next(name for name in self.names if self.names.count(name) > 1)
            raise RotorSoilError(f'dofs must differ in their names, got {twice} twice')
        require(bool(np.all(self.stiffness > 0.0)), 'frequency of a mode', '> 0 Hz',
                float(self.stiffness.min(initial=1.0)))

    def __eq__(self, other: object) -> bool:
        """Return whether all is the same."""
        return isinstance(other, FlexibleBody) and all(
            np.array_equal(getattr(self, own.name), getattr(other, own.name))
            if isinstance(getattr(self, own.name), np.ndarray)
            else getattr(self, own.name) == getattr(other, own.name) for own in fields(self))

    __hash__ = None  # type: ignore[assignment]

    @property
    def names(self) -> list[str]:
        """Names of the motions, as channels spell them."""
        return [Channel(dof.station, '', dof.axis).name for dof in self.dofs]

    def of_kind(self, kind: str) -> list[int]:
        """Return which motions are of a kind."""
        return [index for index, dof in enumerate(self.dofs) if dof.kind == kind]

    def seat(self, station: str, axis: str) -> int:
        """
        Return the motion of a seat along an axis.

        Raises
        ------
        RotorSoilError
            If it has no such motion.

        """
        found = next((index for index, dof in enumerate(self.dofs)
                      if (dof.kind, dof.station, dof.axis) == (SEAT, station, axis)), None)
        if found is None:
            seats = dict.fromkeys(dof.station for dof in self.dofs
                                  if dof.kind == SEAT and dof.axis == axis)
            raise RotorSoilError(f'seat must be one that moves along {axis}, '
                                 f'{", ".join(seats) or "there is none"}, got {station}')
        return found

    def motion(self, station: str, axis: str) -> FloatArray:
        """
        Return which of its motions is that of a place along or about an axis, (p,).

        Raises
        ------
        RotorSoilError
            If it has no such motion.

        """
        found = [index for index, dof in enumerate(self.dofs)
                 if (dof.station, dof.axis) == (station, axis)]
        if not found:
            own = ', '.join(dof.axis for dof in self.dofs if dof.station == station)
            known = ', '.join(dict.fromkeys(dof.station for dof in self.dofs))
            raise RotorSoilError(
                f'place must move along {axis}, {station} has {own}' if own else
                f'place must be one of {known}, got {station}')
        return np.asarray(np.eye(len(self.dofs))[found[0]])

    @cached_property
    def contacts(self) -> IntArray:
        """Motions that the ground resists, those of one place together, x before rz."""
        rows = self.of_kind(CONTACT)
        places = list(dict.fromkeys(self.dofs[row].station for row in rows))
        return np.array(sorted(rows, key=lambda row: (
            places.index(self.dofs[row].station), DOFS.index(self.dofs[row].axis))), dtype=int)

    @cached_property
    def patches(self) -> tuple[Dof, ...]:
        """The first motion of every place of contact."""
        return tuple({self.dofs[index].station: self.dofs[index]
                      for index in reversed(self.contacts.tolist())}.values())[::-1]

    def channels(self, name: str) -> tuple[tuple[Channel, ...], tuple[Channel, ...]]:
        """Return its contacts, those of one place called as the body is, and its probes."""
        def of(rows: Sequence[int], station: str = '') -> tuple[Channel, ...]:
            return tuple(Channel(station or self.dofs[row].station, '', self.dofs[row].axis)
                         for row in rows)

        contacts = self.contacts.tolist()
        return of(contacts, name if self.has_one_contact else ''), of(self.of_kind(PROBE))

    @property
    def has_one_contact(self) -> bool:
        """Whether it stands on one place, as a rigid block does."""
        return len(self.patches) == 1

    @property
    def centre(self) -> tuple[float, float, float]:
        """Middle of its contact by area, in its own frame [m]."""
        area = np.array([patch.area or 1.0 for patch in self.patches])
        places = np.array([patch.place for patch in self.patches])
        x, y, z = (area @ places / area.sum()).tolist()
        return x, y, z

    @cached_property
    def mean_rows(self) -> FloatArray:
        """Mean motion of the contact about its centre per motion of its places, (6, c)."""
        about = self.about_centre[self.contacts]
        weight = np.sqrt([self.dofs[index].area or 1.0 for index in self.contacts])
        return np.asarray(np.linalg.pinv(weight[:, None] * about) * weight)

    @cached_property
    def about_centre(self) -> FloatArray:
        """Motion of the interface per rigid motion about the centre of the contact, (p, 6)."""
        return np.asarray(self.rows @ moved_to(self.centre))

    @property
    def mass_about_centre(self) -> FloatArray:
        """Mass matrix about the centre of the contact, (6, 6)."""
        move = moved_to(self.centre)
        return np.asarray(move.T @ self.mass @ move)

    @property
    def highest(self) -> float:
        """Frequency of the highest mode [rad/s]; infinite where the rest is all there is."""
        return float(self.frequencies.max()) if len(self.stiffness) else np.inf

    def stiffer(self, factor: float) -> Self:
        """Return the same body of another modulus."""
        return replace(self, stiffness=factor * self.stiffness, residual=self.residual / factor,
                       reach=np.sqrt(factor) * self.reach)

    def heavier(self, factor: float) -> Self:
        """Return the same body with more mass everywhere."""
        return replace(self, mass=factor * self.mass, stiffness=self.stiffness / factor,
                       shapes=self.shapes / np.sqrt(factor), reach=self.reach / np.sqrt(factor))

    @cached_property
    def static_size(self) -> FloatArray:
        """Root of the elastic motion of each motion per force on it at rest, (p,)."""
        modal = (self.shapes**2 / self.stiffness).sum(axis=1)
        return np.asarray(np.sqrt(np.abs(self.residual.diagonal()) + modal))

    @property
    def frequencies(self) -> FloatArray:
        """Of its elastic modes, rising as they were given, (m,) [rad/s]."""
        return np.asarray(np.sqrt(self.stiffness))

    @classmethod
    def from_modes(
        cls, dofs: Sequence[Dof], *, frequencies: FloatArray, shapes: FloatArray,
        residual: FloatArray, mass: FloatArray, loss_factor: float,
    ) -> Self:
        """
        Return the body of modes.

        Parameters
        ----------
        dofs : sequence of Dof
            The interface, p motions.
        frequencies : (m,) float array
            Of elastic modes [rad/s].
        shapes : (p, m) float array
            Of unit modal mass [1/sqrt(kg)].
        residual : (p, p) float array
            Static flexibility of what these modes leave out [m/N].
        mass : (6, 6) float array
            Of the rigid body about the origin [kg, kg m, kg m^2].
        loss_factor : float
            Of its material [-].

        """
        rows = np.array([dof.rigid_row for dof in dofs])
        return cls(tuple(dofs), mass, rows, shapes, frequencies**2, residual,
                   np.full(len(frequencies), loss_factor), loss_factor,
                   reach=float(np.max(frequencies, initial=0.0)))

    def to_plain(self) -> dict[str, Any]:
        """Return everything as lists and numbers."""
        plain = {own.name: getattr(self, own.name) for own in fields(self)}
        plain['dofs'] = [[dof.station, dof.axis, dof.kind, list(dof.place), dof.area]
                         for dof in self.dofs]
        return {name: value.tolist() if isinstance(value, np.ndarray) else value
                for name, value in plain.items()}

    @classmethod
    def from_plain(cls, plain: dict[str, Any]) -> Self:
        """Rebuild what `to_plain` returned."""
        count, modes = len(plain['dofs']), len(plain['stiffness'])
        arrays = {name: np.array(plain[name], dtype=float).reshape(shape) for name, shape in (
            ('mass', (6, 6)), ('rows', (count, 6)), ('shapes', (count, modes)),
            ('stiffness', (modes,)), ('residual', (count, count)), ('loss', (modes,)))}
        return cls(dofs=tuple(Dof(station, axis, kind, tuple(place), area)
                              for station, axis, kind, place, area in plain['dofs']),
                   residual_loss=plain['residual_loss'], bed=plain['bed'],
                   reach=plain['reach'], **arrays)


def moved_to(place: tuple[float, float, float]) -> FloatArray:
    """Return the rigid motion about the origin per rigid motion about a place, (6, 6)."""
    return np.array([Dof('', axis, PROBE, (-place[0], -place[1], -place[2])).rigid_row
                     for axis in DOFS])


def massless(residual: FloatArray, size: FloatArray) -> FloatArray:
    """
    Return shapes of springs without mass that make up a residual, (p, g): G G^T.

    Parameters
    ----------
    residual : (p, p) float array
        Flexibility [m/N].
    size : (p,) float array
        Root of all the flexibility of each motion: what is small beside it is round-off.

    Raises
    ------
    RotorSoilError
        If the residual pushes back.

    """
    values, vectors = scipy.linalg.eigh(0.5 * (residual + residual.T))
    largest, whole = float(np.abs(values).max(initial=0.0)), float((size**2).max(initial=0.0))
    if values.min(initial=0.0) < -_ROUND_OFF * largest - _OF_WHOLE * whole:
        raise RotorSoilError(f'residual must not be negative in any direction, got '
                             f'{values.min():.3g} m/N beside {largest:.3g} m/N')
    some = values > _NO_SHAPE * whole
    return np.asarray(vectors[:, some] * np.sqrt(values[some]))
