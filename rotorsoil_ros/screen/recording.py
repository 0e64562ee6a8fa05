"""Into what do all pictures of a run go? Columns of one recording, thinned to what is seen."""

from collections import defaultdict
from collections.abc import Sequence

import numpy as np
import rerun as rr

from rotorsoil_ros.arrays import FloatArray, IntArray
from rotorsoil_ros.events import NANOSECONDS

TIMELINE = 'time'
TREND_NS = NANOSECONDS // 50  # the log holds everything; a screen cannot


class Recording:
    """
    A stream to a file, a viewer or both.

    A row sent alone costs a hundred times what it costs in a column of a thousand.
    """

    def __init__(self, stream: rr.RecordingStream) -> None:
        self._stream = stream
        self._thinned: defaultdict[str, int] = defaultdict(lambda: -1)
        self._styled: set[str] = set()

    def still(self, entity: str, what: rr.AsComponents) -> None:
        """Log what holds for all times; the last such word of an entity counts."""
        self._stream.log(entity, what, static=True)

    def send(self, entity: str, stamp_ns: IntArray, columns: rr.ComponentColumnList) -> None:
        """Send rows of an entity at stamps (n,) [ns]."""
        times = rr.TimeColumn(TIMELINE, timestamp=stamp_ns.astype('datetime64[ns]'))
        self._stream.send_columns(entity, [times], columns)

    def series(
        self, entity: str, stamp_ns: IntArray, values: FloatArray, *, style: rr.AsComponents,
    ) -> None:
        """Send a trend; its style is sent once."""
        if entity not in self._styled:
            self._styled.add(entity)
            self.still(entity, style)
        self.send(entity, stamp_ns, rr.Scalars.columns(scalars=values))

    def strips(
        self, entity: str, stamp_ns: IntArray, strips: Sequence[Sequence[FloatArray]],
    ) -> None:
        """Send for every stamp its lines in a plane, which may be none."""
        flat = [line for lines in strips for line in lines]
        self.send(entity, stamp_ns, rr.LineStrips2D.columns(strips=flat).partition(
            [len(lines) for lines in strips]))

    def begins(self, what: str, stamp_ns: IntArray, period_ns: int) -> IntArray:
        """Return the rows that begin a new period of message time."""
        if not len(stamp_ns):
            return np.arange(0)
        period = stamp_ns // period_ns
        begins = np.diff(period, prepend=self._thinned[what]) != 0
        self._thinned[what] = int(period[-1])
        return np.flatnonzero(begins)
