"""What explains the run of a comparison best: a fit as described, and one within tolerances."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
import math

import numpy as np

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case.config import Case
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError, NotSolvedError
from rotorsoil_ros.machine.band import depends_on_soil, on_soils
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.identification import slips
from rotorsoil_ros.monitor.identification.fit import Fit, Problem, projected, solve
from rotorsoil_ros.monitor.identification.unknowns import (
    named,
    Scalar,
    tolerances,
    unnamed_unbalance,
)
from rotorsoil_ros.monitor.identification.used import UsedVectors

COUPLE = '_couple'
GROWTH = 'growth of '
RUNOUT = 'runout of '

_MOST_KNOWN = 256  # responses

# Above this the columns look alike to the sensors: they trade against each other.
_WORST_CONDITION = 30.0

# A run that leaves more than this share of the prior's spread has not told anything.
_UNINFORMED = 0.7

# A model that leaves more than half of the measured power unexplained has identified nothing.
_LEAST_EXPLAINED = 0.5

# Beyond so many standard deviations of its prior a value that was weighed or drawn is refused.
FARTHEST_PULL = 2.5

# Before the fit each scalar in turn is tried at so many values within so many standard deviations
# of the prior, twice over: away from the solution resonances do not overlap, and no slope leads
# from one to the other.
_TRIALS, _REACH, _TURNS = 41, 4.0, 2


@dataclass(frozen=True)
class Wanted:
    """
    What is to be found out, and from which points.

    Attributes
    ----------
    scalars : sequence of str
        Key paths of the case, `*` standing for every entry; all numbers below a path are
        multiplied by one factor.
    planes : sequence of str
        Whose unbalance; empty: every plane of the case.
    growth : bool
        Whether every unbalance also grows evenly, from the first vector that is used to the last.
    runout : bool
        Whether every channel also has a constant vector.
    with_transients : bool
        Whether points that are not quasi-static are used too.
    gain, angle : float
        Standard deviations of a transducer's gain [-] and angle [rad].
    key_angle : float
        Standard deviation of the key phasor's angle [rad].

    """

    scalars: Sequence[str] = ()
    planes: Sequence[str] = ()
    growth: bool = False
    runout: bool = False
    with_transients: bool = False
    gain: float = 0.03
    angle: float = math.radians(2.0)
    key_angle: float = math.radians(2.0)


@dataclass(frozen=True)
class Identification:
    """
    What explains a run best.

    Attributes
    ----------
    case : Case
        As it was described.
    wanted : Wanted
        What was asked.
    scalars, tolerances : list of Scalar
        What was looked for, and what the case may be off by.
    columns, others : tuple of str
        Planes of unbalance, what they grow by and channels with a runout; planes not named.
    described, tolerant : Fit
        For the case exactly as it is described: what explains this run. And within what a case
        may be off by: what may be said of the machine.
    slip : str
        A slip of units or sign that explains the run better; empty of none.
    channels : tuple of Channel
        Where was measured.

    """

    case: Case
    wanted: Wanted
    scalars: list[Scalar]
    tolerances: list[Scalar]
    columns: tuple[str, ...]
    others: tuple[str, ...]
    described: Fit
    tolerant: Fit
    slip: str
    channels: tuple[Channel, ...]

    @property
    def factor(self) -> FloatArray:
        """Best factors on the scalars for the case as described, (k,)."""
        return np.asarray(np.exp(self.described.state.logs))

    @property
    def moment(self) -> ComplexArray:
        """Best columns for the case as described [kg m, kg m^2; m for a runout]."""
        return self.described.state.columns

    @property
    def settings(self) -> list[str]:
        """The identified scalars as `key.path=value`."""
        return [setting for scalar, factor in zip(
            self.scalars, self.factor.tolist(), strict=True)
            for setting in scalar.settings(factor)]


def identify_case(comparison: Comparison, wanted: Wanted) -> Identification:
    """
    Find unbalance and scalars of the case of a comparison.

    Parameters
    ----------
    comparison : Comparison
        A measured run.
    wanted : Wanted
        What is to be found out.

    Raises
    ------
    InputError
        If a path or plane is not in the case.
    NotSolvedError
        If the run cannot tell, or holds nothing with a phase.

    """
    expectation = comparison.expectation
    named(expectation.case, wanted.scalars)
    return identify_vectors(expectation.case, expectation.model,
                            UsedVectors.of(comparison, with_transients=wanted.with_transients),
                            wanted)


def identify_vectors(
    case: Case, nominal: CoupledModel, run: UsedVectors, wanted: Wanted,
) -> Identification:
    """
    Find unbalance and scalars of a case from vectors.

    Parameters
    ----------
    case, nominal : Case, CoupledModel
        The machine as it is described, and its model.
    run : UsedVectors
        What was measured.
    wanted : Wanted
        What is to be found out.

    Raises
    ------
    InputError, NotSolvedError
        As `identify_case`.

    """
    asked = named(case, wanted.scalars)
    for plane in wanted.planes:
        if plane not in nominal.planes:
            raise InputError(f'{case.path}: plane must be one of {", ".join(nominal.planes)}, '
                             f'got {plane}')
    planes = tuple(wanted.planes) or nominal.planes
    others = tuple(plane for plane in nominal.planes
                   if plane not in planes and not plane.endswith(COUPLE))
    columns = (*planes, *(f'{GROWTH}{name}' for name in planes if wanted.growth),
               *(f'{RUNOUT}{name}' for name in run.channels if wanted.runout))
    off = tolerances(case, asked, has_soil=depends_on_soil(nominal))
    respond = _Responding(run, case, nominal, (*asked, *off), planes, others, wanted)
    plain = Problem(respond.asked_only, run.measured, run.stretch,
                    np.array([scalar.spread for scalar in asked]), len(asked), np.zeros(0),
                    wanted.gain, wanted.angle)
    start = _best_start(plain)
    _refuse_blind(plain, start, columns)
    slip = _slip(plain, run)
    described = solve(plain, start)
    _refuse_unexplained(described, asked, slip)
    full = replace(
        plain, respond=respond, spread=np.array([scalar.spread for scalar in (*asked, *off)]),
        unnamed=np.full(len(others), unnamed_unbalance(case)))
    tolerant = solve(full, np.concatenate([described.state.logs, np.zeros(len(off))]))
    return Identification(case, wanted, asked, off, columns, others, described, tolerant, slip,
                          run.channels)


@dataclass(frozen=True)
class _Responding:
    """Responses (n, c, columns) of the case with its scalars multiplied."""

    run: UsedVectors
    case: Case
    nominal: CoupledModel
    scalars: Sequence[Scalar]
    planes: Sequence[str]
    others: Sequence[str]
    wanted: Wanted
    known: dict[tuple[bytes, int], ComplexArray] = field(default_factory=dict)

    def __call__(self, logs: FloatArray) -> ComplexArray:
        """Return columns asked for, then those that are not."""
        return self._of(logs, (*self.planes, *self.others))

    def asked_only(self, logs: FloatArray) -> ComplexArray:
        """Return the columns asked for, for scalars asked for alone."""
        return self._of(logs, self.planes)

    def _of(self, logs: FloatArray, planes: Sequence[str]) -> ComplexArray:
        """Return responses; a search comes back to where it was, so the latest are kept."""
        key = logs.tobytes(), len(planes)
        if key not in self.known:
            if len(self.known) >= _MOST_KNOWN:
                self.known.clear()
            self.known[key] = self._solved(logs, planes)
        return self.known[key]

    def _solved(self, logs: FloatArray, planes: Sequence[str]) -> ComplexArray:
        settings = [setting for scalar, log in zip(self.scalars, logs.tolist(), strict=False)
                    for setting in scalar.settings(math.exp(log))]
        model = _rebuilt(self.case.changed(settings), self.nominal)
        rows = [model.channels.index(name) for name in self.run.channels]
        units = np.eye(len(model.planes), dtype=complex)
        columns = [model.planes.index(plane) for plane in planes]
        response = np.stack([model.unbalance_response(
            self.run.speed, units[column]).displacement[:, rows] for column in columns], axis=-1)
        if self.run.passing is not None:
            response = response + self.run.passing.added(model, self.run.speed, rows, columns)
        asked = response[:, :, :len(self.planes)]
        parts = [asked]
        if self.wanted.growth:
            parts.append(asked * self.run.elapsed[:, None, None])
        if self.wanted.runout:
            channels = len(rows)
            parts.append(np.broadcast_to(np.eye(channels), (len(response), channels, channels)))
        return np.concatenate([*parts, response[:, :, len(self.planes):]], axis=-1)


def _rebuilt(case: Case, nominal: CoupledModel) -> CoupledModel:
    """Return the model of a changed case, on the tables of the nominal one."""
    model = replace(nominal, rotor=case.rotor, foundations=case.foundations)
    if case.soil is None or not depends_on_soil(nominal):
        return model
    return on_soils(model, [case.soil])[0]


def _refuse_blind(problem: Problem, logs: FloatArray, columns: Sequence[str]) -> None:
    """Refuse what the sensors cannot tell apart where the search begins."""
    given, weight = problem.given, problem.weight
    system = (problem.respond(logs) * weight[:, None])[given]
    if len(system) <= system.shape[1]:
        raise NotSolvedError(f'{len(columns)} unbalances need more than as many vectors, got '
                             f'{len(system)}')
    scale = np.linalg.norm(system, axis=0)
    if not np.all(scale > 0.0):
        raise NotSolvedError('a plane moves none of the measured channels')
    singular = np.linalg.svd(system / scale, compute_uv=False)
    if not singular[0] <= _WORST_CONDITION * singular[-1]:
        raise NotSolvedError(
            f'the run cannot tell {", ".join(columns)} apart: condition number '
            f'{singular[0] / max(singular[-1], 1e-300):.3g}, at most {_WORST_CONDITION:g}')


def _refuse_unexplained(found: Fit, asked: Sequence[Scalar], slip: str) -> None:
    """Refuse a fit that has not told what was asked."""
    names = ', '.join(scalar.path for scalar in asked) or 'the unbalance'
    if not found.explained >= _LEAST_EXPLAINED:
        raise NotSolvedError(
            f'no value of {names} explains the run: the best leaves '
            f'{100.0 * (1.0 - found.explained):.0f} % of its power' + (slip and f'; {slip}'))
    for scalar, left, log in zip(asked, found.deviation.tolist(), found.state.logs.tolist(),
                                 strict=False):
        if left > _UNINFORMED * scalar.spread:
            raise NotSolvedError(f'the run cannot tell {scalar.path}: its logarithm stays '
                                 f'uncertain by {left:.2g}, before the run {scalar.spread:.2g}')
        if not scalar.is_guessed and abs(log) > FARTHEST_PULL * scalar.spread:
            raise NotSolvedError(
                f'{scalar.path} would have to be {math.exp(log):.3g} times what the case says, '
                f'{abs(log) / scalar.spread:.2g} times how well such a thing is known: something '
                'else explains the run' + (slip and f'; {slip}'))


def _best_start(problem: Problem) -> FloatArray:
    """Return the best of some logarithms, tried one scalar at a time."""
    count = len(problem.spread)
    logs = np.zeros(count)
    for index in list(range(count)) * (_TURNS if count > 1 else 1):
        tried = np.tile(logs, (_TRIALS, 1))
        tried[:, index] = problem.spread[index] * np.linspace(-_REACH, _REACH, _TRIALS)
        logs = tried[int(np.argmin([projected(problem, each) for each in tried]))]
    return logs


def _slip(problem: Problem, run: UsedVectors) -> str:
    """Return in words which slip of units or sign explains the run better."""
    def left(changed: Problem) -> float:
        return projected(changed, _best_start(changed))

    def implied(changed: Problem, channel: int) -> ComplexArray:
        others = replace(changed, measured=changed.measured.copy())
        others.measured[:, channel] = complex(np.nan, np.nan)
        fit = solve(replace(others, gain=1e-9, angle=1e-9), _best_start(others))
        return np.asarray((others.respond(fit.state.logs) @ fit.state.columns)[:, channel])

    if said := slips.of_all_channels(problem, run.speed, left):
        return said
    found = slips.of_one_channel(problem, left, implied)
    return '' if found is None else f'{run.channels[found[0]]}: {found[1]}'
