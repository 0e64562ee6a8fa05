"""What the residuals of a fit are worth: how many independent vectors."""

from dataclasses import dataclass
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray

# No fit is better than this share of each channel's root mean square, in each part.
_LEAST = 0.003 / math.sqrt(2.0)

_LARGEST_CORRELATION, _SLOWEST = 0.97, 0.95
_FEWEST_FREE = 2.5


@dataclass(frozen=True)
class Worth:
    """
    What the residuals of a fit say of themselves.

    Attributes
    ----------
    variance : float
        Of each real part of a weighted residual [-].
    in_time : float
        Correlation of successive vectors, corrected for what a short run hides [-].
    between_channels : float
        Correlation of the channels [-].
    inflation : float
        By which the variance of a mean exceeds that of independent residuals [-].
    vectors : int
        Number of vectors.

    """

    variance: float
    in_time: float
    between_channels: float
    inflation: float
    vectors: int

    @property
    def independent(self) -> float:
        """How many independent vectors they are worth."""
        return self.vectors / self.inflation

    @property
    def freedom(self) -> float:
        """Degrees of freedom for the distribution of Student."""
        return max(_FEWEST_FREE, 2.0 * self.independent - 3.0)


def worth(
    residual: ComplexArray, measured: ComplexArray, stretch: IntArray, *, fitted: float,
    sensitivity: FloatArray,
) -> Worth:
    """
    Tell how much the residuals of a fit are worth.

    Parameters
    ----------
    residual, measured : (n, c) complex array
        Weighted residuals, and measured vectors; NaN where there is none.
    stretch : (n,) int array
        Number of the uninterrupted stretch that each row belongs to.
    fitted : float
        Effective number of fitted parameters.
    sensitivity : (2 N, k) float array
        Of real then imaginary parts of the given residuals to what was asked for.

    Notes
    -----
    Successive vectors are taken as ARMA(1, 1): a drift of correlation phi under white noise,
    whose first correlation is r: the variance of a mean grows by 1 + 2 r / (1 - phi). Common
    noise of C channels adds 1 + (C - 1) r_c, and residuals that are large where the unknowns
    are sensitive a factor of their own (White 1980).

    """
    given = np.isfinite(residual)
    number = int(np.count_nonzero(given))
    left = np.where(given, residual, 0.0)
    power = max(float(np.sum(np.abs(left) ** 2)), np.finfo(float).tiny)
    variance = max(power / max(2.0 * number - fitted, 1.0), _LEAST**2)
    rows = len(residual)
    raw = [_lagged(left, stretch, lag) / power for lag in (1, 2, 3)]
    in_time = raw[0]
    in_time = (in_time + (1.0 + 4.0 * in_time) / rows
               if in_time > 2.0 / math.sqrt(2.0 * rows) else 0.0)
    in_time = min(in_time, _LARGEST_CORRELATION)
    slow = 0.0
    if in_time > 0.0:
        slow = float(np.clip((raw[1] + raw[2]) / max(raw[0] + raw[1], 1e-12),
                             min(in_time, _SLOWEST), _SLOWEST))
    channels = residual.shape[1]
    between = 0.0
    if channels > 1:
        turned = left * np.exp(-1j * np.angle(np.where(given, measured, 1.0)))
        together = float(np.sum(np.abs(turned.sum(axis=1)) ** 2))
        between = max(0.0, (together - power) / ((channels - 1) * power))
    uneven = _unevenness(left[given], sensitivity, variance)
    inflation = (1.0 + 2.0 * in_time / (1.0 - slow)) * (1.0 + (channels - 1) * between) * uneven
    return Worth(variance, in_time, between, inflation, number)


def _lagged(residual: ComplexArray, stretch: IntArray, lag: int) -> float:
    """Return the sum of products of residuals some rows apart, within stretches only."""
    if len(residual) <= lag:
        return 0.0
    together = stretch[lag:] == stretch[:-lag]
    return float(np.sum((residual[lag:] * residual[:-lag].conj()).real[together]))


def _unevenness(residual: ComplexArray, sensitivity: FloatArray, variance: float) -> float:
    """Return by how much residuals are larger where the unknowns are told."""
    if not sensitivity.shape[1]:
        return 1.0
    squared = np.concatenate([residual.real, residual.imag]) ** 2
    inverse = np.linalg.pinv(sensitivity)
    robust = np.sum(inverse**2 * squared, axis=1)
    plain = variance * np.sum(inverse**2, axis=1)
    return max(1.0, float(np.max(robust / np.maximum(plain, np.finfo(float).tiny))))
