"""The band in which the response lies, as far as the soil is known."""

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.errors import require
from rotorsoil_ros.ground.accuracy import StifferGround
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.elements.table import LARGEST_POISSON_RATIO
from rotorsoil_ros.ground.half_space import InfiniteElementModel
from rotorsoil_ros.ground.neighbours import on_soil
from rotorsoil_ros.ground.soil import Soil, SoilModel
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.pieces import refine, Solver
from rotorsoil_ros.machine.response import Predictor, ResponseTable

# A band of amplitudes need not be as sharp as a prediction.
_TOLERANCE = 1e-3

# Speeds per piece at which the band is computed at first.
_POINTS = 8

# Between two speeds the edges may be off by this share of themselves, down to amplitudes of the
# second share of the largest of a channel, after so many halvings.
_EDGE_ERROR = 0.02
_EDGE_FLOOR = 1e-5
_EDGE_HALVINGS = 10

_MOST_SAMPLES = 4096

# Phases further apart than this say nothing about the phase any more [rad].
_NO_PHASE = 0.95 * math.pi


@dataclass(frozen=True, slots=True)
class SoilSpread:
    """
    How far a soil may be from what its case file says.

    Attributes
    ----------
    shear_modulus_factor : float
        G lies between G / factor and G * factor, evenly in its logarithm [-].
    poisson_ratio, loss_factor : float
        Half-widths of the ranges of nu and eta [-], cut where they would leave the possible.
    samples : int
        Number of soils, at least 3: the given one and both extremes of G are among them.
    bearing_stiffness_factor : float
        The stiffness of all bearings lies between that of the case over and times this, evenly
        in its logarithm [-].
    model_form : bool
        Whether the error of the models of the ground themselves is part of the band.

    References
    ----------
    ASCE 4, sec. on soil-structure interaction: G (1 + C_v) and G / (1 + C_v), C_v = 0.5 to 1.

    """

    shear_modulus_factor: float = 2.0
    poisson_ratio: float = 0.05
    loss_factor: float = 0.03
    samples: int = 64
    bearing_stiffness_factor: float = 1.0
    model_form: bool = True

    def __post_init__(self) -> None:
        require(1.0 <= self.shear_modulus_factor < math.inf, 'shear_modulus_factor',
                '>= 1 and finite', self.shear_modulus_factor)
        require(0.0 <= self.poisson_ratio < 0.5, 'poisson_ratio', 'in [0, 0.5)',
                self.poisson_ratio)
        require(0.0 <= self.loss_factor < 1.0, 'loss_factor', 'in [0, 1)', self.loss_factor)
        require(3 <= self.samples <= _MOST_SAMPLES, 'samples',
                'at least 3' if self.samples < 3 else f'at most {_MOST_SAMPLES}', self.samples)
        require(1.0 <= self.bearing_stiffness_factor < math.inf, 'bearing_stiffness_factor',
                '>= 1 and finite', self.bearing_stiffness_factor)

    def soils(self, soil: Soil, *, highest_poisson_ratio: float = 0.49) -> list[Soil]:
        """
        Return the soils to be tried, the given one first and the same in every process.

        Parameters
        ----------
        soil : Soil
            Middle of the spread.
        highest_poisson_ratio : float
            Up to which the support model holds.

        """
        from scipy.stats import qmc  # takes a quarter of a second to import

        factor = self.shear_modulus_factor
        extremes = [Soil(soil.shear_modulus * end, soil.poisson_ratio, soil.density,
                         soil.loss_factor) for end in (1.0, 1.0 / factor, factor)]
        cube = qmc.LatinHypercube(3, seed=0).random(self.samples - len(extremes))
        modulus = soil.shear_modulus * factor ** (2.0 * cube[:, 0] - 1.0)
        poisson = soil.poisson_ratio + self.poisson_ratio * (2.0 * cube[:, 1] - 1.0)
        poisson = np.clip(poisson, 0.0, max(soil.poisson_ratio, highest_poisson_ratio))
        loss = np.maximum(0.0, soil.loss_factor + self.loss_factor * (2.0 * cube[:, 2] - 1.0))
        return extremes + [Soil(g, nu, soil.density, eta) for g, nu, eta in zip(
            modulus.tolist(), poisson.tolist(), loss.tolist(), strict=True)]

    def bearing_factors(self, count: int) -> FloatArray:
        """Return by what the bearings' stiffness is multiplied in each of so many machines."""
        # Golden-ratio steps are even in every part of the sequence, and both ends come first.
        share = np.mod(0.5 + np.arange(count) * (5.0**0.5 - 1.0) / 2.0, 1.0)
        share[1:3] = (0.0, 1.0)[:max(0, min(2, count - 1))]
        share[:1] = 0.5
        return np.asarray(self.bearing_stiffness_factor ** (2.0 * share - 1.0))


@dataclass(frozen=True)
class Envelope:
    """
    Smallest and largest response of every channel under one unbalance.

    Attributes
    ----------
    speed : (n,) float array
        Ascending [rad/s].
    low, high : (n, c) float array
        Displacement amplitude [m, rad].
    behind, ahead : (n, c) float array
        Phase relative to that of the given soil [rad]; -pi and pi where it is unknown.

    """

    speed: FloatArray
    low: FloatArray
    high: FloatArray
    behind: FloatArray
    ahead: FloatArray

    @cached_property
    def _bounds(self) -> tuple[list[float], FloatArray]:
        """Speeds as plain numbers, and all four bounds side by side, (n, 4, c)."""
        return self.speed.tolist(), np.stack(
            [self.low, self.high, self.behind, self.ahead], axis=1)

    def around(self, nominal: ComplexArray) -> 'Envelope':
        """
        Return the envelope with the response of the given machine inside it.

        Parameters
        ----------
        nominal : (n, c) complex array
            Its displacement at the same speeds; NaN where there is none. Edges are straight
            between some speeds, where it may be as deep as an antiresonance.

        """
        size = np.abs(nominal)
        inside = np.isfinite(self.low)
        return replace(self, low=np.where(inside, np.fmin(self.low, size), self.low),
                       high=np.where(inside, np.fmax(self.high, size), self.high))

    def at(self, speed: FloatArray) -> 'Envelope':
        """Return the envelope between its speeds, NaN outside them."""
        edges, bounds = self._bounds
        if len(speed) == 1:  # what a live node asks: the same bits at a quarter of the cost
            return self._at_one(speed, float(speed[0]))
        inside = (speed >= edges[0]) & (speed <= edges[-1])
        index = np.clip(np.searchsorted(self.speed, np.where(inside, speed, edges[0]),
                                        side='right') - 1, 0, len(edges) - 2)
        share = (speed - self.speed[index]) / (self.speed[index + 1] - self.speed[index])
        share = np.where(inside, share, np.nan)[:, None, None]
        found = bounds[index] + share * (bounds[index + 1] - bounds[index])
        return Envelope(speed, found[:, 0], found[:, 1], found[:, 2], found[:, 3])

    def _at_one(self, speed: FloatArray, place: float) -> 'Envelope':
        edges, bounds = self._bounds
        share, index = math.nan, 0
        if edges[0] <= place <= edges[-1]:
            index = min(bisect_right(edges, place) - 1, len(edges) - 2)
            share = (place - edges[index]) / (edges[index + 1] - edges[index])
        found = bounds[index:index + 1] + share * (bounds[index + 1] - bounds[index])
        return Envelope(speed, found[:, 0], found[:, 1], found[:, 2], found[:, 3])

    def holds(self, response: ComplexArray) -> BoolArray:
        """Return whether each amplitude, (n, c), lies in the band; NaN does not."""
        size = np.abs(response)
        return np.asarray((size >= self.low) & (size <= self.high))


@dataclass(frozen=True)
class ResponseBand:
    """Response tables of a machine on each of its possible soils, the given one first."""

    tables: tuple[ResponseTable, ...]

    @classmethod
    def build(cls, table: ResponseTable, models: Iterable[CoupledModel]) -> 'ResponseBand':
        """
        Solve a machine on other soils.

        Parameters
        ----------
        table : ResponseTable
            Of the given soil; it tells where speeds have to be close.
        models : iterable of CoupledModel
            The machine on the other soils.

        """
        edges = table.pieces.edges
        edges = np.append(edges[:-1:2], edges[-1])
        return cls((table, *(ResponseTable(
            table.channels, table.planes, table.transmits_force,
            refine(_solver(model), edges, groups=model.groups, tolerance=_TOLERANCE,
                   columns=len(model.planes)), _TOLERANCE,
            table.stability) for model in models)))

    def envelope(self, unbalance: ComplexArray) -> Envelope:
        """
        Return the band under one unbalance, (p,) [kg m].

        Where a straight line between two speeds would miss an edge, there is another speed.
        """
        predictors = [table.predictor(unbalance) for table in self.tables]
        edges = np.unique(np.concatenate([table.pieces.edges for table in self.tables]))
        inner = np.arange(_POINTS) / _POINTS
        found = _extremes(predictors, np.append(
            (edges[:-1, None] + np.diff(edges)[:, None] * inner).ravel(), edges[-1]))
        fresh: BoolArray = np.ones(len(found.speed) - 1, dtype=bool)
        for _ in range(_EDGE_HALVINGS):
            left = np.flatnonzero(fresh)
            exact = _extremes(predictors, 0.5 * (found.speed[left] + found.speed[left + 1]))
            missed = _is_missed(found, exact, left)
            if not missed.any():
                break
            found, fresh = _inserted(found, exact, left, missed)
        return found


def _extremes(predictors: Sequence[Predictor], speed: FloatArray) -> Envelope:
    """Return smallest and largest amplitude and phase of all machines at speeds, exactly."""
    nominal = _response(predictors[0], speed)
    low = high = np.abs(nominal)
    behind = ahead = np.zeros_like(low)
    for predictor in predictors[1:]:
        response = _response(predictor, speed)
        size, turn = np.abs(response), np.angle(response * nominal.conj())
        low, high = np.fmin(low, size), np.fmax(high, size)
        behind, ahead = np.fmin(behind, turn), np.fmax(ahead, turn)
    unknown = ahead - behind > _NO_PHASE
    return Envelope(speed, low, high, np.where(unknown, -math.pi, behind),
                    np.where(unknown, math.pi, ahead))


def _is_missed(found: Envelope, exact: Envelope, left: IntArray) -> BoolArray:
    """Return between which speeds a straight line misses an edge in the middle, (k,)."""
    missed = np.zeros(len(left), dtype=bool)
    for edge, true in ((found.low, exact.low), (found.high, exact.high)):
        line = 0.5 * (edge[left] + edge[left + 1])
        largest = np.nanmax(np.where(np.isfinite(found.high), found.high, 0.0), axis=0)
        allowed = _EDGE_ERROR * np.maximum(true, _EDGE_FLOOR * largest)
        missed |= np.any(np.abs(line - true) > allowed, axis=1)
    return missed


def _inserted(
    found: Envelope, exact: Envelope, left: IntArray, missed: BoolArray,
) -> tuple[Envelope, BoolArray]:
    """Return an envelope with more speeds, and which intervals between them are new."""
    place = left[missed] + 1
    parts = [np.insert(getattr(found, name), place, getattr(exact, name)[missed], axis=0)
             for name in ('speed', 'low', 'high', 'behind', 'ahead')]
    fresh = np.zeros(len(parts[0]) - 1, dtype=bool)
    new = place + np.arange(len(place))
    fresh[new], fresh[new - 1] = True, True
    return Envelope(*parts), fresh


def _solver(model: CoupledModel) -> Solver:
    """Return what `refine` asks: the response per unbalance of each plane, nothing to probe."""
    def solve(speed: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        displacement, force = model.synchronous_response(speed, model.plane_forces)
        rows = np.concatenate([displacement, force[:, model.transmits_force]], axis=1)
        wanted = rows.transpose(0, 2, 1)
        return wanted, wanted[:, :0]

    return solve


def _response(predictor: Predictor, speed: FloatArray) -> ComplexArray:
    """Return displacement amplitudes, (n, c), NaN where the table does not cover a speed."""
    return predictor.answer(speed).displacement


def depends_on_soil(model: CoupledModel) -> bool:
    """Return whether a machine stands on a soil that its model knows."""
    return any(isinstance(soil, (ConeModel, InfiniteElementModel)) for soil in model.soil_models)


def on_soils(model: CoupledModel, soils: Sequence[Soil]) -> list[CoupledModel]:
    """Return a machine on each of several soils, the same below all of its blocks."""
    return [replace(model, soil_models=tuple(
        on_soil(own, soil, block.contact)
        for own, block in zip(model.soil_models, model.foundations, strict=True)))
        for soil in soils]


def of_other_form(
    model: CoupledModel, *, solved: Sequence[SoilModel], stiffer: Sequence[float],
    bearings: float, takes_solved: bool, takes_stiffer: bool,
) -> CoupledModel:
    """
    Return a machine whose models of the ground and of the bearings are others.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    solved : sequence of SoilModel
        What may stand in place of the model below each block; empty if there is none.
    stiffer : sequence of float
        Share by which each contact may be stiffer than its disc.
    bearings : float
        Factor of the stiffness of all bearings.
    takes_solved, takes_stiffer : bool
        Whether either is taken.

    """
    soils = tuple(solved) if takes_solved and solved else tuple(model.soil_models)
    if takes_stiffer:
        soils = tuple(StifferGround(soil, share) if share else soil
                      for soil, share in zip(soils, stiffer, strict=True))
    rotor = model.rotor
    if bearings != 1.0:
        rotor = replace(rotor, bearings=tuple(one.stiffer(bearings) for one in rotor.bearings))
    return replace(model, rotor=rotor, soil_models=soils)


def highest_poisson_ratio(model: CoupledModel) -> float:
    """Return up to which Poisson's ratio the supports of a machine hold."""
    solved = any(isinstance(soil, InfiniteElementModel) for soil in model.soil_models)
    return LARGEST_POISSON_RATIO if solved else 0.49
