"""At which frequencies waves of a layer begin to travel, as a table of compliances shows it."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray

# Loss factors of layers that are tried, and frequencies per table.
_LOSSES = (0.001, 0.01, 0.02, 0.05, 0.1, 0.2)
_PLACES = 240
# A place is looked at over this share of itself on both sides, farther where rows are few, up to
# this share.
_ABOUT, _FARTHEST = 0.22, 0.6
_ROWS = 11
# Powers that a smooth curve may have there, and one with a branch point or a pole beside them.
_SMOOTH, _BESIDE = 6, 4
# A branch point explains so many times more than either of the others, where they miss this much.
_EXPLAINS, _BEYOND_A_POLE = 8.0, 1.5
_MISSED = 4e-3
# Frequencies closer than this share of themselves are one branch point.
_SAME = 0.05
# Halvings of the step in which a place is found more exactly, where the score is beyond this.
_CLOSER = 5
_WORTH_A_LOOK = 0.2


def branch_points(omega: FloatArray, values: ComplexArray) -> FloatArray:
    """
    Return where a compliance has branch points beside the real axis.

    Parameters
    ----------
    omega : (n,) float array
        Frequencies, rising [rad/s].
    values : (n, d, d) complex array
        Compliance.

    Returns
    -------
    (m,) float array
        Rising [rad/s]; empty where smooth curves and poles explain all of it.

    Notes
    -----
    On a layer over rock a wave of wavenumber k begins to travel at omega_j: k^2 goes through
    zero as omega^2 - omega_j^2 (1 + i eta), and what a disc excites of it as its logarithm. At
    each frequency that is fitted beside a few powers, and compared with more powers and with a
    pole in its place.

    """
    shape = values.shape
    return np.array(_branch_points(
        omega.astype(float).tobytes(), values.astype(complex).tobytes(), shape[:2]))


@lru_cache(maxsize=8)
def _branch_points(
    of_omega: bytes, of_values: bytes, shape: tuple[int, int],
) -> tuple[float, ...]:
    """Find them; a case at fault is built again and again, with the same table."""
    omega = np.frombuffer(of_omega)
    values = np.frombuffer(of_values, dtype=complex).reshape(*shape, shape[1])
    size = np.sqrt(np.abs(np.einsum('kii->ki', values)).max(axis=0))
    unit = np.where(size > 0.0, size, 1.0)
    entries = (values / (unit[:, None] * unit)).reshape(len(omega), -1)
    search = _Search(omega, entries[:, np.abs(entries).max(axis=0) > 1e-9])
    first = omega[0] if omega[0] > 0.0 else omega[1]
    if len(omega) < _ROWS or not search.entries.size:
        return ()
    places = np.geomspace(first, omega[-1], _PLACES)
    score = np.array([search.score(place) for place in places])
    # A light layer shows between two places only: what sticks out is looked at more closely.
    peaks = 1 + np.flatnonzero((score[1:-1] >= score[:-2]) & (score[1:-1] > score[2:])
                               & (score[1:-1] > _WORTH_A_LOOK))
    closer = [search.closer(float(places[peak]), float(places[1] / places[0])) for peak in peaks]
    found: list[float] = []
    for place, gain in sorted(closer, key=lambda one: -one[1]):
        if gain > 1.0 and all(abs(place / other - 1.0) > _SAME for other in found):
            found.append(place)
    return tuple(sorted(found))


@dataclass(frozen=True, slots=True)
class _Search:
    """Rows of a table, (n,) and (n, q), over their own sizes."""

    omega: FloatArray
    entries: ComplexArray

    def score(self, place: float) -> float:
        """Return how much better a branch point explains the rows than it has to; 0 if not."""
        misses = self._misses(place)
        if misses is None:
            return 0.0
        smooth, branch, pole = misses
        gain = np.minimum(smooth / (_EXPLAINS * branch), pole / (_BEYOND_A_POLE * branch))
        return float(np.where(smooth > _MISSED, gain, 0.0).max())

    def closer(self, place: float, step: float) -> tuple[float, float]:
        """Return where near a place the score is highest, and that."""
        best, width = self.score(place), step - 1.0
        for _ in range(_CLOSER):
            width *= 0.5
            tried = [place * (1.0 - width), place * (1.0 + width)]
            scores = [self.score(one) for one in tried]
            if max(scores) > best:
                best, place = max(scores), tried[int(np.argmax(scores))]
        return place, best

    def _misses(self, place: float) -> tuple[FloatArray, FloatArray, FloatArray] | None:
        """Return what powers, a branch point and a pole miss of each entry, (q,) each."""
        away = np.abs(self.omega / place - 1.0)
        rows = np.sort(np.argsort(away)[:max(_ROWS, int((away < _ABOUT).sum()))])
        reach = away[rows].max()
        if reach > _FARTHEST or not self.omega[rows[2]] < place < self.omega[rows[-3]]:
            return None
        along = (self.omega[rows] / place - 1.0) / reach
        powers, values = np.vander(along, _SMOOTH).astype(complex), self.entries[rows]

        def missed(basis: ComplexArray) -> FloatArray:
            q, _ = np.linalg.qr(basis)
            left = values - q @ (q.conj().T @ values)
            return np.asarray(np.maximum(np.linalg.norm(left, axis=0) / len(rows)**0.5, 1e-9))

        few = powers[:, _SMOOTH - _BESIDE:]
        beside = []
        for loss in _LOSSES:
            square = 1.0 + 1j * loss - (self.omega[rows] / place) ** 2
            beside.append([missed(np.column_stack([few, own, own * along]))
                           for own in (np.log(square), 1.0 / square)])
        branch, pole = np.array(beside).transpose(1, 0, 2)
        return (missed(powers), branch[branch.sum(axis=1).argmin()],
                pole[pole.sum(axis=1).argmin()])
