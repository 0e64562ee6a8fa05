"""Which journal bearing it is: its bore, its pads and how thick its oil is."""

from dataclasses import dataclass
import math

from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.rotor.journal.film import Pad

KINDS = ('plain', 'axial_groove', 'elliptic', 'tilting_pad')

# Points over the angle of a pad. The edge of the film lies on one of them: with half as many some
# coefficients jump by two percent from speed to speed (theory manual, journal bearings).
_CELLS = {'plain': 320, 'axial_groove': 160, 'elliptic': 160, 'tilting_pad': 100}

# Beyond such a shape no bearing has been built, and none of the laws of a thin film holds.
_WIDEST_CLEARANCE, _SLENDEREST, _STOUTEST = 0.02, 0.05, 4.0


@dataclass(frozen=True, slots=True)
class JournalBearing:
    """
    Bore of a hydrodynamic bearing.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    diameter, length : float
        Of the journal [m] and along it [m].
    radial_clearance : float
        Smallest distance of journal and bore when the journal is centred, assembled [m].
    preload : float
        1 - assembled over machined clearance, 0 <= m < 1 [-]; of elliptic and tilting pads.
    arc : float
        Of each pad [rad].
    pads : int
        How many tilt.
    pivot : float
        Where a pad tilts, share of its arc from the edge that the journal meets first [-].
    on_pad : bool
        Whether the lowest pad, or the gap between the two lowest, is straight below.
    groove : float
        Where a plain bearing takes its oil, from z (up) towards x [rad].

    """

    kind: str
    diameter: float
    length: float
    radial_clearance: float
    preload: float = 0.0
    arc: float = math.radians(160.0)
    pads: int = 5
    pivot: float = 0.5
    on_pad: bool = False
    groove: float = 0.0

    def __post_init__(self) -> None:
        require(0.0 < self.diameter < math.inf, 'diameter', '> 0 m and finite', self.diameter)
        require(_SLENDEREST * self.diameter <= self.length <= _STOUTEST * self.diameter, 'length',
                f'{_SLENDEREST * self.diameter:.4g} to {_STOUTEST * self.diameter:.4g} m, '
                f'{_SLENDEREST:g} to {_STOUTEST:g} times the diameter', self.length)
        widest = _WIDEST_CLEARANCE * self.radius
        require(0.0 < self.radial_clearance <= widest, 'radial_clearance',
                f'> 0 m and at most {widest:.4g} m, {_WIDEST_CLEARANCE:g} of the radius',
                self.radial_clearance)
        require(0.0 <= self.preload < 1.0, 'preload', 'in [0, 1)', self.preload)
        if self.kind == 'tilting_pad':
            self._require_pads()
        elif self.kind in ('axial_groove', 'elliptic'):
            require(0.0 < self.arc <= math.pi, 'arc_deg', 'in (0, 180] deg',
                    math.degrees(self.arc))

    def _require_pads(self) -> None:
        if not 3 <= self.pads <= 16:
            raise RotorSoilError(f'pads must be 3 to 16, got {self.pads}')
        most = 2.0 * math.pi / self.pads
        require(0.0 < self.arc <= most, 'arc_deg',
                f'> 0 deg and at most {math.degrees(most):.4g} deg, {self.pads} of them on a bore',
                math.degrees(self.arc))
        require(0.3 <= self.pivot <= 0.8, 'pivot', 'in [0.3, 0.8]', self.pivot)

    @property
    def radius(self) -> float:
        """Of the journal [m]."""
        return 0.5 * self.diameter

    @property
    def slenderness(self) -> float:
        """D / L [-]."""
        return self.diameter / self.length

    @property
    def cells(self) -> int:
        """Points over the angle of each pad."""
        return _CELLS[self.kind]

    @property
    def bore(self) -> tuple[Pad, ...]:
        """Its fixed pads; those that tilt are at `pivots`."""
        if self.kind == 'plain':
            return (Pad(self.groove, self.groove + 2.0 * math.pi, 0.0, 0.0),)
        preload = self.preload if self.kind == 'elliptic' else 0.0
        return tuple(Pad(middle - 0.5 * self.arc, middle + 0.5 * self.arc, middle, preload)
                     for middle in (math.pi, 0.0))

    @property
    def pivots(self) -> tuple[float, ...]:
        """Direction of the pivot of each tilting pad, from z (up) towards x [rad]."""
        first = math.pi + (0.0 if self.on_pad else math.pi / self.pads)
        return tuple(first + 2.0 * math.pi * pad / self.pads for pad in range(self.pads))

    @property
    def tilting(self) -> Pad:
        """One of the tilting pads, its pivot at the angle zero."""
        return Pad(-self.pivot * self.arc, (1.0 - self.pivot) * self.arc, 0.0, self.preload)
