"""Where a journal floats at every speed, and what its bearing is to the rotor there."""

from contextlib import suppress
from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.rotor.coefficients import SpeedTable
from rotorsoil_ros.rotor.journal.fixed import FixedPads
from rotorsoil_ros.rotor.journal.geometry import JournalBearing
from rotorsoil_ros.rotor.journal.oil import Viscosity
from rotorsoil_ros.rotor.journal.tilting import TiltingPads
from rotorsoil_ros.units import rad_s_to_rpm

# To be raised whenever a film gets other coefficients: old tables must go.
FILM_ALGORITHM = 1

# Points of a table for each doubling of the speed: the monotone cubic between them is then as
# close as the mesh of the film (theory manual, journal bearings).
_PER_OCTAVE = 4

# Film over the clearance below which the mesh does not know it, and within which share of a speed
# the first one above is found.
THINNEST_FILM, _FOUND = 0.02, 1e-3

# Sommerfeld numbers beyond which the film is thinner than that, or the load is none.
_HEAVIEST, _LIGHTEST = 1e-5, 1e6

# Share of the last speed at which a film is looked for at all.
_SLOWEST = 1e-4


@dataclass(frozen=True)
class JournalStates:
    """
    A journal in its bearing, over speeds (n,).

    Attributes
    ----------
    bearing : JournalBearing
        Which it is.
    load : (2,) float array
        Force on the journal over (x, z) [N].
    speed, viscosity : (n,) float arrays
        [rad/s], [Pa s].
    place : (n, 2) float array
        Displacement of the journal over (x, z) [radial clearances].
    stiffness, damping : (n, 2, 2) float arrays
        Over (x, z), force first [N/m], [N s/m].
    least : (n,) float array
        Least film [m].

    """

    bearing: JournalBearing
    load: FloatArray
    speed: FloatArray
    viscosity: FloatArray
    place: FloatArray
    stiffness: FloatArray
    damping: FloatArray
    least: FloatArray

    @classmethod
    def at(
        cls, bearing: JournalBearing, viscosity: Viscosity, load: FloatArray, speed: FloatArray,
        *, whirl: float = 1.0,
    ) -> 'JournalStates':
        """
        Solve for the film at every speed.

        Parameters
        ----------
        bearing, viscosity
            Bore and oil.
        load : (2,) float array
            Force on the journal over (x, z) [N].
        speed : (n,) float array
            Rotor speeds [rad/s].
        whirl : float
            Frequency over speed for which tilting pads are reduced [-].

        Raises
        ------
        NotSolvedError
            If at some speed no film carries the load.

        """
        search = (TiltingPads(bearing, whirl) if bearing.kind == 'tilting_pad'
                  else FixedPads.of(bearing))
        thick = viscosity.at(speed)
        unit = thick * speed * bearing.radius**3 * bearing.length / bearing.radial_clearance**2
        place, k, c, least = (np.zeros((len(speed), *shape)) for shape in (
            (2,), (2, 2), (2, 2), ()))
        # The lightest load first: from there on the film is followed.
        for index in np.argsort(-unit).tolist():
            if not unit[index] > 0.0:
                raise NotSolvedError('a journal at rest has no film')
            place[index], film = search.settle(load / unit[index])
            k[index], c[index], least[index] = film.stiffness, film.damping, film.least
        stiffness = (unit / bearing.radial_clearance)[:, None, None] * k
        damping = (unit / (bearing.radial_clearance * speed))[:, None, None] * c
        return cls(bearing, load, speed, thick, place, stiffness, damping,
                   bearing.radial_clearance * least)

    @property
    def arrays(self) -> dict[str, FloatArray]:
        """What a file has to keep of it."""
        return {name: getattr(self, name) for name in (
            'speed', 'viscosity', 'place', 'stiffness', 'damping', 'least')}

    @property
    def tables(self) -> tuple[SpeedTable, SpeedTable]:
        """Stiffness and damping for the rotor."""
        return SpeedTable(self.speed, self.stiffness), SpeedTable(self.speed, self.damping)

    @property
    def carried(self) -> float:
        """Size of the load [N]."""
        return float(np.hypot(*self.load))

    @property
    def eccentricity(self) -> FloatArray:
        """Displacement of the journal over the radial clearance, (n,) [-]."""
        return np.hypot(self.place[:, 0], self.place[:, 1])

    @property
    def attitude(self) -> FloatArray:
        """Angle from the load to the displacement in the sense of spin, (n,) [rad]."""
        turned = np.arctan2(self.place[:, 0], self.place[:, 1]) - math.atan2(*self.load)
        return np.asarray((turned + math.pi) % (2.0 * math.pi) - math.pi)

    @property
    def sommerfeld(self) -> FloatArray:
        """S = mu N L D / W (R / c)^2 with N in turns per second, (n,) [-]."""
        own = self.bearing
        ratio = own.radius / own.radial_clearance
        return np.asarray(self.viscosity * self.speed / (2.0 * math.pi) * own.length
                          * own.diameter / self.carried * ratio**2)

    @property
    def specific_load(self) -> float:
        """W / (L D) [Pa]."""
        return self.carried / (self.bearing.length * self.bearing.diameter)

    @property
    def loss(self) -> FloatArray:
        """Friction of a centred journal (Petroff), (n,) [W]: no bearing has less."""
        own = self.bearing
        return np.asarray(2.0 * math.pi * self.viscosity * self.speed**2 * own.radius**3
                          * own.length / own.radial_clearance)


    def thinner(self, film: float) -> float:
        """Return the speed below which the film is thinner than a limit [m], [rad/s]; or 0."""
        order = np.argsort(self.speed)
        speed, least = self.speed[order], self.least[order]
        thin = np.flatnonzero(least < film)
        if not len(thin):
            return 0.0
        last = int(thin[-1])
        if last == len(speed) - 1:
            return float(speed[-1])
        share = math.log(film / least[last]) / math.log(least[last + 1] / least[last])
        return float(speed[last] * (speed[last + 1] / speed[last]) ** share)

    @property
    def reynolds(self) -> FloatArray:
        """Omega R c / mu, (n,): times the density [kg/m^3] the Reynolds number of the film."""
        own = self.bearing
        return np.asarray(self.speed * own.radius * own.radial_clearance / self.viscosity)

    @property
    def whirl_ratio(self) -> FloatArray:
        """
        Return the frequency at which a rigid rotor begins to whirl over the speed, (n,) [-].

        NaN where no mass makes it whirl.

        References
        ----------
        Lund (1966), ASME J. Lubrication Technology; Hamrock, Schmid & Jacobson (2004), ch. 10:
        the roots of a mass on k and c, on the limit of stability.

        """
        square, _ = self._at_the_limit
        return np.sqrt(np.where(square > 0.0, square, math.nan)) / self.speed

    @property
    def critical_mass(self) -> FloatArray:
        """Mass on the journal of a rigid rotor from which on it whirls, (n,) [kg]; or infinite."""
        square, stiffness = self._at_the_limit
        return np.where(square > 0.0, stiffness / np.where(square > 0.0, square, 1.0), math.inf)

    @property
    def _at_the_limit(self) -> tuple[FloatArray, FloatArray]:
        """Square of the frequency [rad^2/s^2] and stiffness [N/m] on the limit of stability."""
        (kxx, kxz), (kzx, kzz) = self.stiffness.transpose(1, 2, 0)
        (cxx, cxz), (czx, czz) = self.damping.transpose(1, 2, 0)
        stiffness = (kxx * czz + kzz * cxx - kxz * czx - kzx * cxz) / (cxx + czz)
        square = ((kxx - stiffness) * (kzz - stiffness) - kxz * kzx) / (cxx * czz - cxz * czx)
        return square, stiffness

    def rigid_threshold(self, mass: float) -> float:
        """Return the speed from which a rigid mass on the journal whirls [rad/s]; or infinite."""
        over = mass / self.critical_mass - 1.0
        first = np.flatnonzero(over > 0.0)
        if not len(first):
            return math.inf
        right = int(first[0])
        if right == 0:
            return float(self.speed[0])
        left = right - 1
        share = over[left] / (over[left] - over[right])
        return float(self.speed[left] * (self.speed[right] / self.speed[left]) ** share)


def tabulated(
    bearing: JournalBearing, viscosity: Viscosity, load: FloatArray, span: tuple[float, float],
) -> JournalStates:
    """
    Return a journal at the speeds of a table that covers a span.

    Parameters
    ----------
    bearing, viscosity, load
        As `JournalStates.at`.
    span : tuple of two floats
        Lowest and highest speed [rad/s].

    Raises
    ------
    RotorSoilError
        If the film at the lowest speed is thinner than anybody could tell.

    """
    low, high = span
    _require_bearable(bearing, viscosity, load, high)
    slowest = max(low, _SLOWEST * high)
    count = 1 + max(2, math.ceil(_PER_OCTAVE * math.log2(high / slowest)))
    speeds = np.geomspace(slowest, high, count)
    speeds[[0, -1]] = slowest, high  # what covers a span does so to the last bit
    found = None
    with suppress(NotSolvedError):
        found = JournalStates.at(bearing, viscosity, load, speeds)
    thinnest = THINNEST_FILM * bearing.radial_clearance
    if found is None or low < slowest or found.least[0] < thinnest:
        known = _slowest(bearing, viscosity, load, (slowest, high))
        raise RotorSoilError(
            f'film must be at least {1e6 * thinnest:.3g} um thick ({THINNEST_FILM:g} of the '
            f'radial clearance) at the lowest speed, which it is from '
            f'{math.ceil(rad_s_to_rpm(known)):g} rpm on, got {rad_s_to_rpm(low):g} rpm')
    return found


def _require_bearable(
    bearing: JournalBearing, viscosity: Viscosity, load: FloatArray, speed: float,
) -> None:
    """Refuse what no film carries, and what is no load, before it is looked for."""
    [thick] = viscosity.at(np.array([speed])).tolist()
    unit = thick * speed * bearing.radius**3 * bearing.length / bearing.radial_clearance**2
    carried = float(np.hypot(*load))
    number = unit / (math.pi * carried) if carried > 0.0 else math.inf
    if not _HEAVIEST <= number <= _LIGHTEST:
        raise RotorSoilError(
            f'load must give a Sommerfeld number of {_HEAVIEST:g} to {_LIGHTEST:g} at '
            f'{rad_s_to_rpm(speed):g} rpm, got {number:.3g} with {carried:g} N and '
            f'{thick:.4g} Pa s')


def _slowest(
    bearing: JournalBearing, viscosity: Viscosity, load: FloatArray, span: tuple[float, float],
) -> float:
    """Return the lowest speed at which the film is thick enough [rad/s]."""
    thin, thick = span
    while thick > (1.0 + _FOUND) * thin:
        middle = math.sqrt(thin * thick)
        try:
            # From the light load down: a heavy one alone would be sought from far away.
            found = JournalStates.at(bearing, viscosity, load, np.geomspace(middle, thick, 4))
            is_thin = found.least[0] < THINNEST_FILM * bearing.radial_clearance
        except NotSolvedError:
            is_thin = True
        thin, thick = (middle, thick) if is_thin else (thin, middle)
    if thick == span[1]:
        raise NotSolvedError('no film carries the load at any speed of the range')
    return thick
