"""One augmented fit: scalars, unbalances, gains and tolerances together, with all their priors."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from rotorsoil_ros.arrays import ComplexArray, FloatArray, IntArray
from rotorsoil_ros.monitor.identification.noise import Worth, worth

Respond = Callable[[FloatArray], ComplexArray]

# Share of a prior's standard deviation by which a scalar is moved for its derivative.
_STEP = 0.02
_MOST_STEPS, _ROUNDS = 12, 3
_SETTLED = 0.05  # of the objective
_ONE_SIDED = 0.97725  # two standard deviations of a normal distribution
_DAMPING = 1e-3


@dataclass(frozen=True)
class Problem:
    """
    What was measured, and what is known before it is looked at.

    Attributes
    ----------
    respond : callable
        From the logarithms of scalars, (k,), to the response (n, c, p + q) per unit of p columns
        that are asked for and q that are not.
    measured : (n, c) complex array
        Measured vectors [m, rad], NaN where there is none.
    stretch : (n,) int array
        Number of the uninterrupted stretch of each row.
    spread : (k,) float array
        Standard deviation of each logarithm before the run is seen.
    named : int
        How many of the scalars are asked for; the rest are tolerances.
    unnamed : (q,) float array
        Standard deviation of each part of the columns that are not asked for.
    gain, angle : float
        Standard deviations of a transducer's gain [-] and angle [rad].

    """

    respond: Respond
    measured: ComplexArray
    stretch: IntArray
    spread: FloatArray
    named: int
    unnamed: FloatArray
    gain: float
    angle: float

    @property
    def given(self) -> np.ndarray:
        """Where there is a vector, (n, c)."""
        return np.isfinite(self.measured)

    @property
    def weight(self) -> FloatArray:
        """One over the root mean square of each channel, (c,)."""
        given = self.given
        power = np.where(given, np.abs(self.measured) ** 2, 0.0).sum(axis=0)
        size = np.sqrt(power / np.maximum(given.sum(axis=0), 1))
        return np.asarray(1.0 / np.where(size > 0.0, size, 1.0))


@dataclass(frozen=True)
class State:
    """A point of the search: logs (k,), columns (p,) and (q,), gains and angles (c,)."""

    logs: FloatArray
    columns: ComplexArray
    others: ComplexArray
    gains: FloatArray
    angles: FloatArray


@dataclass(frozen=True)
class Fit:
    """
    What explains a run best, and how well it is known.

    Attributes
    ----------
    problem : Problem
        What was asked.
    state : State
        The best point.
    covariance : (m, m) float array
        Of logs, then real and imaginary parts of the columns asked for, of those not asked for,
        then gains and angles; in their own units.
    worth : Worth
        Of the residuals.
    explained : float
        Share of the weighted power that is explained.

    """

    problem: Problem
    state: State
    covariance: FloatArray
    worth: Worth
    explained: float

    @property
    def coverage(self) -> float:
        """Standard deviations that cover as two of a normal distribution do."""
        return float(stdtrit(self.worth.freedom, _ONE_SIDED))

    @property
    def deviation(self) -> FloatArray:
        """Standard deviation of everything in the covariance, (m,)."""
        return np.sqrt(np.maximum(np.diagonal(self.covariance), 0.0))

    @property
    def log_width(self) -> FloatArray:
        """Half of the width that covers each logarithm, (k,)."""
        return np.asarray(self.coverage * self.deviation[:len(self.state.logs)])

    @property
    def pulls(self) -> FloatArray:
        """By how many standard deviations each scalar lies off its prior, (k,)."""
        return np.asarray(np.abs(self.state.logs) / self.problem.spread)

    def column_parts(self) -> list[slice]:
        """Return where each column has its two parts in the covariance."""
        first, number = len(self.state.logs), len(self.state.columns) + len(self.state.others)
        return [slice(first + 2 * index, first + 2 * index + 2) for index in range(number)]

    def column_width(self, index: int, *, key_angle: float) -> float:
        """
        Return half of the width that covers a column, the mean of its two parts.

        An error of the key phasor, `key_angle` [rad], turns every vector and leaves no residual.
        """
        part = self.covariance[self.column_parts()[index], self.column_parts()[index]]
        size = abs(np.concatenate([self.state.columns, self.state.others])[index])
        return float(self.coverage * np.sqrt(
            0.5 * np.trace(part) + 0.5 * (key_angle * size) ** 2))


def solve(problem: Problem, logs: FloatArray) -> Fit:
    """
    Return the best fit that starts from logarithms (k,).

    Notes
    -----
    Gauss and Newton with damping on |residual|^2 / variance + |parameters / prior|^2; the
    variance is that of the residuals, inflated by what they are worth, and found with the fit in
    rounds.

    """
    search = _Search(problem, _started(problem, logs))
    variance = max(_power(search.left) / (2 * search.number), 1e-5)
    search.descend(variance)
    for _ in range(_ROUNDS):
        found = search.judged(variance)
        variance = found.variance * found.inflation
        search.descend(variance)
    found = search.judged(variance)
    variance = found.variance * found.inflation
    information = search.jacobian.T @ search.jacobian / variance + np.diag(search.prior)
    covariance = np.linalg.pinv(information) * np.outer(search.scale, search.scale)
    total = _power(np.where(problem.given, problem.measured * problem.weight, 0.0))
    return Fit(problem, search.state, covariance, found, 1.0 - _power(search.left) / total)


def projected(problem: Problem, logs: FloatArray) -> float:
    """Return which share of the weighted power the best columns leave, without gains."""
    state = _started(problem, logs)
    total = _power(np.where(problem.given, problem.measured * problem.weight, 0.0))
    return _power(_residual(problem, state, problem.respond(logs))[0]) / total


def _started(problem: Problem, logs: FloatArray) -> State:
    """Return a state whose columns asked for are the best for some logarithms."""
    response = problem.respond(logs)
    asked = response.shape[2] - len(problem.unnamed)
    given, weight = problem.given, problem.weight
    system = (response[:, :, :asked] * weight[:, None])[given]
    columns, *_ = np.linalg.lstsq(system, (problem.measured * weight)[given], rcond=None)
    channels = problem.measured.shape[1]
    return State(logs, columns, np.zeros(len(problem.unnamed), dtype=complex),
                 np.zeros(channels), np.zeros(channels))


def _residual(
    problem: Problem, state: State, response: ComplexArray,
) -> tuple[ComplexArray, ComplexArray]:
    """Return weighted residuals, (n, c), 0 where nothing is given, and the modelled vectors."""
    error = np.exp(state.gains + 1j * state.angles)
    modelled = error * (response @ np.concatenate([state.columns, state.others]))
    left = np.where(problem.given, (modelled - problem.measured) * problem.weight, 0.0)
    return left, modelled


def _power(values: ComplexArray) -> float:
    return float(np.sum(np.abs(values) ** 2))


def _parameters(state: State) -> FloatArray:
    columns = np.concatenate([state.columns, state.others])
    return np.concatenate([state.logs, np.stack([columns.real, columns.imag], axis=1).ravel(),
                           state.gains, state.angles])


def _moved(state: State, step: FloatArray) -> State:
    """Return a state some way on, in the order of the parameters."""
    values = _parameters(state) + step
    first, asked, others = len(state.logs), len(state.columns), len(state.others)
    channels = len(state.gains)
    parts = values[first:first + 2 * (asked + others)].reshape(-1, 2)
    columns = parts[:, 0] + 1j * parts[:, 1]
    rest = values[first + 2 * (asked + others):]
    return State(values[:first], columns[:asked], columns[asked:], rest[:channels],
                 rest[channels:])


class _Search:
    """Descends from a state; parameters are counted in units that stay as they were at first."""

    def __init__(self, problem: Problem, state: State) -> None:
        size = np.maximum(np.abs(state.columns), 0.1 * np.abs(state.columns).max(initial=0.0))
        size = np.where(size > 0.0, size, 1.0)
        channels = len(state.gains)
        self.scale: FloatArray = np.concatenate([
            problem.spread, np.repeat(size, 2), np.repeat(problem.unnamed, 2),
            np.full(channels, problem.gain), np.full(channels, problem.angle)])
        self.prior = np.ones(len(self.scale))
        first = len(problem.spread)
        self.prior[first:first + 2 * len(size)] = 0.0  # of what is asked for nothing is known
        self._problem = problem
        self.number = max(int(problem.given.sum()), 1)
        self.state = state
        self.left, self.jacobian = self._linearised()

    def descend(self, variance: float) -> None:
        """Go to the best state near by."""
        now, damping = self._objective(self.state, self.left, variance), _DAMPING
        for _ in range(_MOST_STEPS):
            flat = self.left[self._problem.given]
            slope = (self.jacobian.T @ np.concatenate([flat.real, flat.imag]) / variance
                     + self.prior * _parameters(self.state) / self.scale)
            curvature = self.jacobian.T @ self.jacobian / variance + np.diag(self.prior)
            step = -np.linalg.lstsq(
                curvature + damping * np.diag(np.diagonal(curvature)), slope, rcond=None)[0]
            tried = _moved(self.state, step * self.scale)
            left, _ = _residual(self._problem, tried, self._problem.respond(tried.logs))
            then = self._objective(tried, left, variance)
            if not then < now:
                damping *= 10.0
                continue
            fall, now, self.state = now - then, then, tried
            damping /= 10.0
            self.left, self.jacobian = self._linearised()
            if fall < _SETTLED:
                break

    def judged(self, variance: float) -> Worth:
        """Return what the residuals are worth."""
        problem = self._problem
        curvature = self.jacobian.T @ self.jacobian / variance
        fitted = float(np.trace(np.linalg.pinv(curvature + np.diag(self.prior)) @ curvature))
        first = len(problem.spread)
        asked = [*range(problem.named), *range(first, first + 2 * len(self.state.columns))]
        return worth(np.where(problem.given, self.left, np.nan), problem.measured,
                     problem.stretch, fitted=fitted, sensitivity=self.jacobian[:, asked])

    def _objective(self, state: State, left: ComplexArray, variance: float) -> float:
        return _power(left) / variance + float(
            np.sum(self.prior * (_parameters(state) / self.scale) ** 2))

    def _linearised(self) -> tuple[ComplexArray, FloatArray]:
        """Return weighted residuals and their derivatives by scaled parameters, (2 N, m)."""
        problem, state = self._problem, self.state
        response = problem.respond(state.logs)
        left, modelled = _residual(problem, state, response)
        error = np.exp(state.gains + 1j * state.angles)
        columns = []
        for index, spread in enumerate(problem.spread.tolist()):
            logs = state.logs.copy()
            logs[index] += _STEP * spread
            moved, _ = _residual(problem, state, problem.respond(logs))
            columns.append((moved - left) / (_STEP * spread))
        for column in range(response.shape[2]):
            one = error * response[:, :, column] * problem.weight
            columns += [one, 1j * one]
        for turn in (1.0, 1j):
            for channel in range(len(state.gains)):
                own = np.zeros_like(modelled)
                own[:, channel] = turn * modelled[:, channel] * problem.weight[channel]
                columns.append(own)
        matrix = np.stack([column[problem.given] for column in columns], axis=1) * self.scale
        return left, np.concatenate([matrix.real, matrix.imag])
