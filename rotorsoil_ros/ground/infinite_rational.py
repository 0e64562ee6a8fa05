"""How a few exact solves become a function: rational interpolation that keeps reality."""

from dataclasses import dataclass

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray


@dataclass(frozen=True, slots=True, eq=False)
class RationalFunction:
    """
    Several rational functions with common poles, in barycentric form.

    Every support point s_j stands for itself and its conjugate, with conjugate weight and
    values: f(conj s) = conj f(s), as the response of a real thing must.

    Attributes
    ----------
    support : (p,) complex array
        Points at which the functions take their values exactly.
    values : (p, q) complex array
        Values of the q functions there.
    weights : (p,) complex array
        Barycentric weights.

    """

    support: ComplexArray
    values: ComplexArray
    weights: ComplexArray

    def __call__(self, s: ComplexArray) -> ComplexArray:
        """Return the values at the points (n,), shape (n, q)."""
        with np.errstate(divide='ignore', invalid='ignore'):
            near = self.weights / (s[:, None] - self.support)
            mirrored = self.weights.conj() / (s[:, None] - self.support.conj())
            values = near @ self.values + mirrored @ self.values.conj()
            values /= (near + mirrored).sum(axis=1)[:, None]
        point, index = np.nonzero(s[:, None] == self.support)
        values[point] = self.values[index]
        return values


def fit_rational(
    points: ComplexArray, values: ComplexArray, *, scale: FloatArray, size: int,
) -> RationalFunction:
    """
    Return the rational functions through `size` of the values, close to all others.

    Parameters
    ----------
    points : (n,) complex array
        Where the functions are known, none twice and none the conjugate of another.
    values : (n, q) complex array
        Values of the functions.
    scale : (n, q) float array
        What an error is measured against.
    size : int
        Number of support points, less than n.

    Notes
    -----
    AAA with common support points for all functions: the next support point is where the worst
    error is; the weights minimise the linearised error at all other points, by the smallest
    singular vector. Each support point brings its conjugate, so the unknowns are the real and
    imaginary parts of the weights.

    References
    ----------
    Nakatsukasa, Sete & Trefethen (2018), The AAA algorithm for rational approximation, sec. 3;
    Lietaert, Meerbergen, Perez & Vandereycken (2022), Automatic rational approximation and
    linearization of nonlinear eigenvalue problems, sec. 2 (common weights for several
    functions).

    """
    error = (np.abs(values - values.mean(axis=0)) / scale).max(axis=1)
    chosen: list[int] = []
    function = None
    while len(chosen) < size:
        error[chosen] = -1.0
        chosen.append(int(error.argmax()))
        rest = np.setdiff1d(np.arange(points.size), chosen)
        weights = _weights(points, values, scale, np.array(chosen), rest)
        function = RationalFunction(points[chosen], values[chosen], weights)
        error = (np.abs(function(points) - values) / scale).max(axis=1)
    assert function is not None
    return function


def _weights(
    points: ComplexArray, values: ComplexArray, scale: FloatArray, chosen: IntArray,
    rest: IntArray,
) -> ComplexArray:
    def quotients(support: ComplexArray, heights: ComplexArray) -> ComplexArray:
        """Return the scaled Loewner matrix of all functions, (rest * q, p)."""
        rise = values[rest][:, None, :] - heights
        run = points[rest][:, None, None] - support[:, None]
        slopes: ComplexArray = rise / run / scale[rest][:, None, :]
        return slopes.transpose(0, 2, 1).reshape(-1, support.size)

    own = quotients(points[chosen], values[chosen])
    mirrored = quotients(points[chosen].conj(), values[chosen].conj())
    rows = np.concatenate([own + mirrored, 1j * (own - mirrored)], axis=1)
    # The triangle has the same right singular vectors as the tall matrix, for a tenth of the time.
    triangle = np.linalg.qr(np.concatenate([rows.real, rows.imag]), mode='r')
    unknowns: FloatArray = np.linalg.svd(triangle)[2][-1]
    weights: ComplexArray = unknowns[:len(chosen)] + 1j * unknowns[len(chosen):]
    return weights
