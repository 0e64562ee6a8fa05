"""Do successive vectors at one speed differ by more than each of them says? Then all err more."""

from collections import deque
from dataclasses import replace
import math

import numpy as np

from rotorsoil_ros.monitor.vectors.orders import OrderVector

# So many vectors are looked at, at least so many of them; beyond this ratio of what they scatter
# by to what they say, they err by the former: of white noise 1.5 is exceeded once in a hundred.
_LOOKED_AT, _FEWEST, _LARGEST_RATIO = 11, 6, 3.0

# A speed that has moved by this share is another one.
_ONE_SPEED = 0.005

WIDENED = f'vectors scatter over {_LARGEST_RATIO:g} times more than each says: wider'


class Scatter:
    """
    Holds the latest vectors of a channel against each other, as long as the speed stays.

    A tone beside the order, or a speed that is told wrongly, leaves a residual in each stretch
    that looks like that of a better fit than it is; from stretch to stretch it shows.
    """

    def __init__(self) -> None:
        self._latest: deque[OrderVector] = deque(maxlen=_LOOKED_AT)

    def widened(self, vector: OrderVector) -> OrderVector:
        """Return a vector with the deviation of its neighbours, where that is the larger one."""
        known = self._latest
        if known and (abs(vector.speed - known[0].speed) > _ONE_SPEED * known[0].speed
                      or vector.has_phase is not known[0].has_phase):
            known.clear()
        known.append(vector)
        if len(known) < _FEWEST:
            return vector
        scatter = self._deviation()
        stated = math.sqrt(float(np.mean([each.deviation[0]**2 for each in known])))
        if not scatter > _LARGEST_RATIO * stated:
            return vector
        # Of other orders nothing else is known.
        return replace(vector, deviation=np.maximum(vector.deviation, scatter))

    def _deviation(self) -> float:
        """Return by how much one part of a vector errs [m]: what changes steadily drops out."""
        first = np.array([each.displacement[0] for each in self._latest])
        # Without the angle of the rotor, phases of two stretches have nothing to do with another.
        parts, series = (2, first) if self._latest[0].has_phase else (1, np.abs(first))
        second = np.diff(series, 2)
        # A second difference of white noise has (1 + 4 + 1) times its variance.
        return float(np.sqrt(np.mean(np.abs(second)**2) / (6 * parts)))
