"""The unbalance, and the soil or bearing, that explain a measured run best."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.errors import NotSolvedError, RotorSoilError

# Above this the planes look alike to the sensors: their unbalances trade against each other.
WORST_CONDITION = 30.0

# A run that leaves more than this share of the prior's spread has not told anything.
UNINFORMED = 0.7

# A model that leaves more than half of the measured power unexplained has identified nothing.
LEAST_EXPLAINED = 0.5

# Before the fit each scalar in turn is tried at so many values within so many standard deviations
# of the prior, twice over: away from the solution resonances do not overlap, and no slope leads
# from one to the other.
_TRIALS, _REACH, _ROUNDS = 41, 4.0, 2


@dataclass(frozen=True)
class Unbalance:
    """
    Unbalance vectors that explain a run best.

    Attributes
    ----------
    moment : (p,) complex array
        moment * exp(i phase) of every plane [kg m].
    deviation : (p,) float array
        Standard error of its real and imaginary part, from the residual [kg m].
    condition : float
        Condition number of the planes as the sensors see them.
    explained : float
        1 - |residual|^2 / |measured|^2.

    """

    moment: ComplexArray
    deviation: FloatArray
    condition: float
    explained: float


@dataclass(frozen=True)
class Identified:
    """
    Scalars of a case, and the unbalance, that explain a run best.

    Attributes
    ----------
    names : tuple of str
        What was identified.
    factor : (k,) float array
        Best value over nominal value.
    log_deviation : (k,) float array
        Standard deviation of its logarithm, a relative error when small.
    correlation : (k + 2 p, k + 2 p) float array
        Between the logarithms and the unbalances' real and imaginary parts.
    unbalance : Unbalance
        At the best values.

    """

    names: tuple[str, ...]
    factor: FloatArray
    log_deviation: FloatArray
    correlation: FloatArray
    unbalance: Unbalance


def identify_unbalance(unit_response: ComplexArray, measured: ComplexArray) -> Unbalance:
    """
    Find the unbalance of all planes by linear least squares.

    Parameters
    ----------
    unit_response : (n, c, p) complex array
        Predicted displacement per unit unbalance [m/(kg m)].
    measured : (n, c) complex array
        Measured displacement vectors [m], NaN where there is none.

    Raises
    ------
    NotSolvedError
        If the run cannot tell the planes apart.

    Notes
    -----
    Every channel is weighted by its own size in the run, so that a block that moves
    micrometres counts as much as a disc that moves millimetres.

    """
    system, right = _weighted(unit_response, measured)
    planes = system.shape[1]
    if len(right) <= planes:
        raise NotSolvedError(f'{planes} unbalance planes need more than as many vectors, got '
                             f'{len(right)}')
    scale = np.linalg.norm(system, axis=0)
    if not np.all(scale > 0.0):
        raise NotSolvedError('a plane moves none of the measured channels')
    singular = np.linalg.svd(system / scale, compute_uv=False)
    condition = float(singular[0] / singular[-1]) if singular[-1] > 0.0 else np.inf
    if condition > WORST_CONDITION:
        raise NotSolvedError(f'the run cannot tell the {planes} planes apart: condition number '
                             f'{condition:.3g}, at most {WORST_CONDITION:g}')
    moment, *_ = np.linalg.lstsq(system, right, rcond=None)
    residual = right - system @ moment
    variance = np.vdot(residual, residual).real / (2 * (len(right) - planes))
    covariance = np.linalg.pinv(system.conj().T @ system)
    return Unbalance(
        moment, np.sqrt(variance * np.diagonal(covariance).real), condition,
        float(1.0 - np.vdot(residual, residual).real / np.vdot(right, right).real))


def identify(
    respond: Callable[[FloatArray], ComplexArray], measured: ComplexArray, *,
    names: Sequence[str], prior_deviation: float,
) -> Identified:
    """
    Find scalars of the model together with the unbalance, by variable projection.

    Parameters
    ----------
    respond : callable
        From factors on the nominal scalars, (k,), to the unit response (n, c, p).
    measured : (n, c) complex array
        Measured displacement vectors [m], NaN where there is none.
    names : sequence of str
        Of the scalars.
    prior_deviation : float
        Standard deviation of the logarithm of each factor before the run is seen.

    Raises
    ------
    NotSolvedError
        If the run cannot tell a scalar, or the planes apart, or is not explained at all.

    References
    ----------
    Golub & Pereyra (1973), SIAM J. Numer. Anal. 10, for variable projection.

    """
    if not prior_deviation > 0.0:
        raise RotorSoilError(f'prior_deviation must be > 0, got {prior_deviation:g}')

    def projected(logs: FloatArray) -> FloatArray:
        system, right = _weighted(respond(np.exp(logs)), measured)
        moment, *_ = np.linalg.lstsq(system, right, rcond=None)
        residual = right - system @ moment
        return np.concatenate([residual.real, residual.imag])

    def fit(noise: float, start: FloatArray) -> FloatArray:
        found = least_squares(
            lambda logs: np.concatenate([projected(logs) / noise, logs / prior_deviation]),
            start, x_scale=prior_deviation, max_nfev=60)
        return np.asarray(found.x)

    # The first fit, nearly without a prior, tells the noise that the second weighs it with.
    size = np.sqrt(np.mean(projected(np.zeros(len(names))) ** 2))
    logs = fit(1e-3 * size, _best_start(projected, len(names), prior_deviation))
    noise = max(float(np.sqrt(np.mean(projected(logs) ** 2))), 1e-9 * size)
    logs = fit(noise, logs)
    unbalance = identify_unbalance(respond(np.exp(logs)), measured)
    if unbalance.explained < LEAST_EXPLAINED:
        raise NotSolvedError(f'no value of {", ".join(names)} explains the run: the best leaves '
                             f'{100.0 * (1.0 - unbalance.explained):.0f} % of its power')
    covariance = _covariance(respond, measured, logs, unbalance.moment, noise=noise,
                             prior_deviation=prior_deviation)
    deviation = np.sqrt(np.diagonal(covariance))
    for name, left in zip(names, deviation, strict=False):
        if left > UNINFORMED * prior_deviation:
            raise NotSolvedError(f'the run cannot tell {name}: its logarithm stays uncertain by '
                                 f'{left:.2g}, before the run {prior_deviation:.2g}')
    return Identified(tuple(names), np.exp(logs), deviation[:len(names)],
                      covariance / np.outer(deviation, deviation), unbalance)


def _best_start(
    projected: Callable[[FloatArray], FloatArray], count: int, prior_deviation: float,
) -> FloatArray:
    """Return the best of some logarithms, tried one scalar at a time."""
    trials = prior_deviation * np.linspace(-_REACH, _REACH, _TRIALS)
    logs = np.zeros(count)
    for index in list(range(count)) * (_ROUNDS if count > 1 else 1):
        tried = np.tile(logs, (_TRIALS, 1))
        tried[:, index] = trials
        left = [np.sum(projected(each) ** 2) for each in tried]
        logs = tried[int(np.argmin(left))]
    return logs


def _weighted(
    unit_response: ComplexArray, measured: ComplexArray,
) -> tuple[ComplexArray, ComplexArray]:
    """Return system and right side of all measured vectors, each channel by its own size."""
    given = np.isfinite(measured)
    power = np.where(given, np.abs(measured) ** 2, 0.0).sum(axis=0)
    size = np.sqrt(power / np.maximum(given.sum(axis=0), 1))
    weight = 1.0 / np.where(size > 0.0, size, 1.0)
    system = (unit_response * weight[:, None])[given]
    return system, (measured * weight)[given]


def _covariance(
    respond: Callable[[FloatArray], ComplexArray], measured: ComplexArray, logs: FloatArray,
    moment: ComplexArray, *, noise: float, prior_deviation: float,
) -> FloatArray:
    """Return the covariance of (logarithms, Re and Im of the unbalances), linearised."""
    system, _ = _weighted(respond(np.exp(logs)), measured)
    step = 1e-4
    columns = []
    for index in range(len(logs)):
        shifted = [_weighted(respond(np.exp(logs + sign * step * np.eye(len(logs))[index])),
                             measured)[0] @ moment for sign in (1.0, -1.0)]
        columns.append((shifted[0] - shifted[1]) / (2.0 * step))
    columns += [part for column in system.T for part in (column, 1j * column)]
    jacobian = np.array(columns).T
    jacobian = np.concatenate([jacobian.real, jacobian.imag])
    scale = np.linalg.norm(jacobian, axis=0)
    information = (jacobian / scale).T @ (jacobian / scale) / noise**2
    prior = np.zeros(len(scale))
    prior[:len(logs)] = (prior_deviation * scale[:len(logs)]) ** -2
    return np.asarray(np.linalg.pinv(information + np.diag(prior)) / np.outer(scale, scale))
