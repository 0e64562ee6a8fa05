"""Where on the ground a shaft lies, and how a point on it rides on what it stands on."""

from dataclasses import dataclass, fields
import math

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.errors import require


@dataclass(frozen=True, slots=True)
class Placement:
    """
    Where the left end of a shaft lies in plan, and where its axis points.

    Attributes
    ----------
    x, y : float
        Of the left end in the axes of the ground, which all blocks share [m].
    heading : float
        Of the shaft's own axes about z, from the x of the ground towards its y [rad]. A shaft
        that turns the other way round is one that points the other way, heading pi: so the spin
        is positive for all.
    is_upright : bool
        Whether the shaft points up, over that place: its own x then is horizontal still, and so is
        its z, which points against the y of the ground where the heading is zero.

    """

    x: float = 0.0
    y: float = 0.0
    heading: float = 0.0
    is_upright: bool = False

    def __post_init__(self) -> None:
        for own, unit in zip(fields(self)[:3], ('m', 'm', 'rad'), strict=True):
            value = getattr(self, own.name)
            require(math.isfinite(value), own.name, f'finite, in {unit}', value)

    def point(self, position: float) -> tuple[float, float]:
        """Return x and y of a place along the shaft, in the axes of the ground [m]."""
        if self.is_upright:
            return self.x, self.y
        return (self.x - math.sin(self.heading) * position,
                self.y + math.cos(self.heading) * position)

    @property
    def axes(self) -> FloatArray:
        """Directions of its own x, along and z in the axes of the ground, (3, 3)."""
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        x, flat, up = (cosine, sine, 0.0), (-sine, cosine, 0.0), (0.0, 0.0, 1.0)
        if self.is_upright:
            return np.array([x, up, (sine, -cosine, 0.0)])
        return np.array([x, flat, up])

    def seat_rows(
        self, *, position: float, height: float, centre: tuple[float, float],
    ) -> FloatArray:
        """
        Return x and z, both across the shaft, of a seat per unit motion of its block.

        Parameters
        ----------
        position, height : float
            Of the seat along the shaft, and of the shaft above the contact: of its axis where it
            lies, of its lower end where it stands [m].
        centre : tuple of two floats
            x and y of the centre of the contact in the axes of the ground [m].

        Returns
        -------
        (2, 6) float array
            Over (x, y, z, rx, ry, rz) of the block in the axes of the ground.

        Notes
        -----
        u(r) = u + theta x r; along a direction e that is [e | r x e].

        """
        cosine, sine = math.cos(self.heading), math.sin(self.heading)
        x, y = self.point(position)
        if self.is_upright:
            x, y, z = x - centre[0], y - centre[1], height + position
            return np.array([
                [cosine, sine, 0.0, -sine * z, cosine * z, sine * x - cosine * y],
                [sine, -cosine, 0.0, cosine * z, sine * z, -cosine * x - sine * y],
            ])
        across, along = x - centre[0], y - centre[1]
        return np.array([
            [cosine, sine, 0.0, -sine * height, cosine * height,
             sine * across - cosine * along],
            [0.0, 0.0, 1.0, along, -across, 0.0],
        ])


# The shaft whose axes are those of the ground: a machine of its own.
AT_ORIGIN = Placement()
