"""The band in which the response lies, as far as the machine and its soil are known."""

from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
import math

import numpy as np

from rotorsoil_ros.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from rotorsoil_ros.ground.accuracy import StifferGround
from rotorsoil_ros.ground.bed import below_patches
from rotorsoil_ros.ground.boundary.layered_model import LayeredSiteModel
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.elements.table import LARGEST_POISSON_RATIO
from rotorsoil_ros.ground.embedded_cone import EmbeddedConeModel
from rotorsoil_ros.ground.green import GreenModel
from rotorsoil_ros.ground.half_space import InfiniteElementModel
from rotorsoil_ros.ground.layers.model import ThinLayerModel
from rotorsoil_ros.ground.neighbours import on_soil
from rotorsoil_ros.ground.soil import Soil, SoilModel
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.pieces import refine, Solver
from rotorsoil_ros.machine.response import growth_of, Predictor, ResponseTable

# A band of amplitudes need not be as sharp as a prediction.
_TOLERANCE = 1e-3

# Speeds per piece at which the band is computed at first.
_POINTS = 8

# Between two speeds the edges may be off by this share of themselves, down to amplitudes of the
# second share of the largest of a channel, after so many halvings.
_EDGE_ERROR = 0.02
_EDGE_FLOOR = 1e-5
_EDGE_HALVINGS = 10

# Phases further apart than this say nothing about the phase any more [rad].
_NO_PHASE = 0.95 * math.pi


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

    def opened(self, steady: ComplexArray, moved: ComplexArray) -> 'Envelope':
        """
        Return the envelope of machines to which a changing speed does no more than to this one.

        Parameters
        ----------
        steady, moved : (n, c) complex arrays
            Displacement of the given machine, without and with what the change adds: on another
            ground it adds as much, at another phase.

        """
        added = np.abs(moved - steady)
        rows = added > 0.0
        if not rows.any():
            return self
        known = rows & (added < self.low)
        width = np.arcsin(np.divide(added, self.low, out=np.ones(added.shape), where=known))
        turn = np.angle(moved * steady.conj())
        behind = np.where(known, np.maximum(self.behind - turn - width, -math.pi), -math.pi)
        ahead = np.where(known, np.minimum(self.ahead - turn + width, math.pi), math.pi)
        rows &= np.isfinite(self.low)
        return replace(self, low=np.where(rows, np.maximum(self.low - added, 0.0), self.low),
                       high=np.where(rows, self.high + added, self.high),
                       behind=np.where(rows, behind, self.behind),
                       ahead=np.where(rows, ahead, self.ahead))

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


@dataclass(frozen=True)
class ResponseBand:
    """
    Response tables of all machines that a machine may be, the given one first.

    Attributes
    ----------
    tables : tuple of ResponseTable
        Of each.
    unbalance_factor : float
        Within which the unbalance is known [-]: it scales both edges.

    """

    tables: tuple[ResponseTable, ...]
    unbalance_factor: float = 1.0

    @classmethod
    def build(
        cls, table: ResponseTable, models: Iterable[CoupledModel], *,
        unbalance_factor: float = 1.0,
    ) -> 'ResponseBand':
        """
        Solve the other machines.

        Parameters
        ----------
        table : ResponseTable
            Of the given machine; it tells where speeds have to be close.
        models : iterable of CoupledModel
            What it may be instead.
        unbalance_factor : float
            Within which the unbalance is known [-].

        """
        edges = table.pieces.edges
        edges = np.append(edges[:-1:2], edges[-1])
        return cls((table, *(ResponseTable(
            table.channels, table.planes, table.transmits_force,
            refine(_solver(model), edges, groups=model.groups, tolerance=_TOLERANCE,
                   columns=len(model.planes)), _TOLERANCE,
            growth_of(model, float(edges[-1]))) for model in models)), unbalance_factor)

    @property
    def unstable(self) -> str:
        """How many of the other machines grow at some speed, in words; nothing where none does."""
        others = self.tables[1:]
        number = sum(bool(len(table.stability.unstable)) for table in others)
        if not number:
            return ''
        return (f'{number} of the {len(others)} other machines that this one may be are unstable '
                'at some speed: there the band holds the rest only')

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
        return replace(found, low=found.low / self.unbalance_factor,
                       high=found.high * self.unbalance_factor)


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
    """Return displacement amplitudes, (n, c), NaN where there is no steady answer."""
    holds = predictor.table.stability.holds(speed)
    return np.where(holds[:, None], predictor.answer(speed).displacement, math.nan)


def depends_on_soil(model: CoupledModel) -> bool:
    """Return whether a machine stands on a soil that its model knows."""
    return any(isinstance(soil, (BoundaryElementModel, ConeModel, EmbeddedConeModel, GreenModel,
                                 InfiniteElementModel, LayeredSiteModel, ThinLayerModel))
               for own in model.soil_models for soil in below_patches(own))


def on_soils(
    model: CoupledModel, soils: Sequence[Soil], *, of: Soil | None = None,
) -> list[CoupledModel]:
    """
    Return a machine on each of several soils, the same below all of its blocks.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    soils : sequence of Soil
        What may be below its blocks.
    of : Soil or None
        What that stands in the place of; None is what is below the deepest base. Layers are
        stiffened and made heavier in the ratio of the two.

    """
    of = of or _below_deepest(model)
    return [replace(model, soil_models=tuple(
        # What stands on another has no soil; one ground below all blocks needs none of their
        # contacts.
        own if len(model.soil_models) > 1 and block.on is not None else on_soil(
            own, soil, block.contact, of=of)
        for own, block in zip(model.soil_models, model.foundations, strict=False)))
        for soil in soils]


def _below_deepest(model: CoupledModel) -> Soil | None:
    below = [one for own in model.soil_models for one in below_patches(own)
             if isinstance(one, ThinLayerModel)]
    return max(below, key=lambda one: one.embedment.depth).material if below else None


def of_other_form(
    model: CoupledModel, *, solved: Sequence[SoilModel], stiffer: Sequence[float],
    takes_solved: bool, takes_stiffer: bool,
) -> CoupledModel:
    """
    Return a machine whose models of the ground are others.

    Parameters
    ----------
    model : CoupledModel
        The machine.
    solved : sequence of SoilModel
        What may stand in place of the model below each block; empty if there is none.
    stiffer : sequence of float
        Share by which each contact may be stiffer than its disc.
    takes_solved, takes_stiffer : bool
        Whether either is taken.

    """
    soils = tuple(solved) if takes_solved and solved else tuple(model.soil_models)
    if takes_stiffer:
        soils = tuple(StifferGround(soil, share) if share else soil
                      for soil, share in zip(soils, stiffer, strict=True))
    return replace(model, soil_models=soils)


def highest_poisson_ratio(model: CoupledModel) -> float:
    """Return up to which Poisson's ratio the supports of a machine hold."""
    solved = any(isinstance(soil, InfiniteElementModel)
                 for own in model.soil_models for soil in below_patches(own))
    return LARGEST_POISSON_RATIO if solved else 0.49
