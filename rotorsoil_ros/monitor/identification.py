"""Which unbalance, and which soil or bearing, explain a measured run of a case best."""

from collections.abc import Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
import math
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from rotorsoil_ros.arrays import ComplexArray, FloatArray
from rotorsoil_ros.case import document
from rotorsoil_ros.case.config import Case, load
from rotorsoil_ros.errors import InputError, NotSolvedError
from rotorsoil_ros.events import Reason
from rotorsoil_ros.ground.neighbours import on_soil
from rotorsoil_ros.machine.band import depends_on_soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.identify import Identified, identify, identify_unbalance, Unbalance
from rotorsoil_ros.monitor.points import ChannelPoints

# Before the run is seen, a scalar is known to within this factor, one standard deviation.
PRIOR_FACTOR = 2.0

# Speeds beyond these say no more, and each costs a solution.
_MOST_ROWS = 240

_COUPLE = '_couple'
_GROWTH = 'growth of '
_RUNOUT = 'runout of '
_SPEEDS = 'speed_rpm'


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

    """

    scalars: Sequence[str] = ()
    planes: Sequence[str] = ()
    growth: bool = False
    runout: bool = False
    with_transients: bool = False


@dataclass(frozen=True)
class Identification:
    """
    What explains a run best.

    Attributes
    ----------
    case : Case
        As it was described.
    scaled : tuple of (str, list of (str, float))
        Each wanted path with the key paths below it and their values in the case.
    columns : tuple of str
        Planes of unbalance, then what they grow by, then channels with a runout.
    unbalance : Unbalance
        Of those columns [kg m, kg m^2; m for a runout].
    scalars : Identified or None
        Factors on the wanted paths, if there are any.
    used : int
        Number of vectors.
    channels : tuple of str
        Where they were measured.

    """

    case: Case
    scaled: tuple[tuple[str, list[tuple[str, float]]], ...]
    columns: tuple[str, ...]
    unbalance: Unbalance
    scalars: Identified | None
    used: int
    channels: tuple[str, ...]

    @property
    def settings(self) -> list[str]:
        """The identified scalars as `key.path=value`."""
        factors = () if self.scalars is None else self.scalars.factor.tolist()
        return [setting for (_, places), factor in zip(self.scaled, factors, strict=True)
                for setting in _settings(places, factor)]


def identify_case(comparison: Comparison, wanted: Wanted) -> Identification:
    """
    Find unbalance and scalars of the case of a comparison.

    Parameters
    ----------
    comparison : Comparison
        With its case.
    wanted : Wanted
        What is to be found out.

    Raises
    ------
    InputError
        If a path or plane is not in the case, or nothing was measured with a phase.
    NotSolvedError
        If the run cannot tell.

    """
    case, nominal = comparison.expectation.case, comparison.expectation.model
    scaled = _scaled(case, wanted.scalars)
    channels, elapsed, speed, measured = _vectors(comparison, wanted)
    for plane in wanted.planes:
        if plane not in nominal.planes:
            raise InputError(f'{case.path}: plane must be one of {", ".join(nominal.planes)}, '
                             f'got {plane}')
    planes = tuple(wanted.planes) or nominal.planes
    chosen = [nominal.planes.index(plane) for plane in planes]
    columns = (*planes, *(f'{_GROWTH}{name}' for name in planes if wanted.growth),
               *(f'{_RUNOUT}{name}' for name in channels if wanted.runout))

    def respond(factors: FloatArray) -> ComplexArray:
        settings = [setting for (_, places), factor in zip(scaled, factors.tolist(), strict=True)
                    for setting in _settings(places, factor)]
        model = _rebuilt(case.changed(settings), nominal)
        rows = [model.channels.index(name) for name in channels]
        response = np.stack([
            model.unbalance_response(speed, unit).displacement[:, rows]
            for unit in np.eye(len(model.planes), dtype=complex)[chosen]], axis=-1)
        if wanted.growth:
            response = np.concatenate([response, response * elapsed[:, None, None]], axis=-1)
        if not wanted.runout:
            return response
        constant = np.broadcast_to(np.eye(len(channels)), (len(speed), *[len(channels)] * 2))
        return np.concatenate([response, constant], axis=-1)

    used = int(np.isfinite(measured).sum())
    if not scaled:
        found = identify_unbalance(respond(np.ones(0)), measured)
        return Identification(case, scaled, columns, found, None, used, channels)
    scalars = identify(respond, measured, names=list(wanted.scalars),
                       prior_deviation=math.log(PRIOR_FACTOR))
    return Identification(case, scaled, columns, scalars.unbalance, scalars, used,
                          channels)


def _rebuilt(case: Case, nominal: CoupledModel) -> CoupledModel:
    """Return the model of a changed case, on the tables of the nominal one."""
    soils = nominal.soil_models
    if case.soil is not None and depends_on_soil(nominal):
        soils = tuple(on_soil(own, case.soil, block.contact)
                      for own, block in zip(soils, case.foundations, strict=True))
    return replace(nominal, rotor=case.rotor, foundations=case.foundations, soil_models=soils)


def _vectors(
    comparison: Comparison, wanted: Wanted,
) -> tuple[tuple[str, ...], FloatArray, FloatArray, ComplexArray]:
    """Return channels, share of the run (n,), speeds (n,) and vectors (n, c), NaN for none."""
    chosen: list[tuple[ChannelPoints, Any]] = []
    for points in comparison.points:
        usable = points.used
        if wanted.with_transients:
            usable = usable | (points.reason == Reason.NOT_QUASI_STATIC)
        usable = usable & np.isfinite(points.phase)
        if usable.any():
            chosen.append((points, usable))
    if not chosen:
        raise NotSolvedError('the run holds no vector with a phase that could be used')
    stamps = np.unique(np.concatenate([points.stamp_ns[usable] for points, usable in chosen]))
    if len(stamps) > _MOST_ROWS:
        stamps = stamps[np.linspace(0, len(stamps) - 1, _MOST_ROWS).round().astype(int)]
    speed = np.full(len(stamps), np.nan)
    measured = np.full((len(stamps), len(chosen)), complex(np.nan, np.nan))
    for column, (points, usable) in enumerate(chosen):
        own, first = np.unique(points.stamp_ns[usable], return_index=True)
        _, row, at = np.intersect1d(stamps, own, return_indices=True)
        measured[row, column] = points.measured[usable][first[at]]
        speed[row] = points.speed[usable][first[at]]
    elapsed = (stamps - stamps[0]) / max(int(stamps[-1] - stamps[0]), 1)
    return tuple(points.channel for points, _ in chosen), elapsed, speed, measured


def _scaled(
    case: Case, scalars: Sequence[str],
) -> tuple[tuple[str, list[tuple[str, float]]], ...]:
    found = tuple((scalar, list(_numbers(case.content, scalar.split('.'), ())))
                  for scalar in scalars)
    for scalar, places in found:
        if not any(value != 0.0 for _, value in places):
            raise InputError(f'{case.path}: --identify {scalar}: names no number of the case')
    return found


def _numbers(
    value: Any, steps: Sequence[str], place: tuple[str, ...],
) -> Iterator[tuple[str, float]]:
    """Yield key path and value of every number at or below a path with wildcards."""
    entries: dict[str, Any] = {}
    if isinstance(value, dict):
        entries = {str(key): entry for key, entry in value.items()}
    elif isinstance(value, list):
        entries = {str(index): entry for index, entry in enumerate(value)}
    if not entries:
        if not steps and isinstance(value, (int, float)) and not isinstance(value, bool):
            yield '.'.join(place), float(value)
        return
    for key, entry in entries.items():
        # The speeds at which a stiffness is given are not part of it.
        if (steps and steps[0] in ('*', key)) or (not steps and key != _SPEEDS):
            yield from _numbers(entry, steps[1:], (*place, key))


def _settings(places: Sequence[tuple[str, float]], factor: float) -> list[str]:
    return [f'{place}={value * factor!r}' for place, value in places]


def describe(found: Identification) -> Iterator[str]:
    """Yield what was identified, line by line."""
    unbalance = found.unbalance
    yield (f'identified from {found.used} vectors of {", ".join(found.channels)}: explains '
           f'{100.0 * unbalance.explained:.2f} % of their power, condition number '
           f'{unbalance.condition:.3g}')
    for column, moment, deviation in zip(found.columns, unbalance.moment.tolist(),
                                         unbalance.deviation.tolist(), strict=True):
        unit = 'm' if column.startswith(_RUNOUT) else (
            'kg m^2' if column.endswith(_COUPLE) else 'kg m')
        phase = math.atan2(moment.imag, moment.real)
        yield (f'  {column}: {abs(moment):.4g} {unit} at {phase:.4f} rad, +- {deviation:.2g} '
               f'{unit}')
    if found.scalars is None:
        return
    for (path, places), factor, deviation in zip(
            found.scaled, found.scalars.factor.tolist(), found.scalars.log_deviation.tolist(),
            strict=True):
        values = sorted({value * factor for _, value in places if value != 0.0})
        yield (f'  {path}: factor {factor:.4g} +- {100.0 * deviation:.2g} %, now '
               + ', '.join(f'{value:.5g}' for value in values))
    names = [*found.scalars.names, *(f'{part} {column}' for column in found.columns
                                     for part in ('Re', 'Im'))]
    matrix = found.scalars.correlation
    for row, name in enumerate(found.scalars.names):
        yield f'  correlation of {name} with ' + ', '.join(
            f'{other} {matrix[row, column]:+.2f}' for column, other in enumerate(names)
            if column != row)


def write_case(found: Identification, target: Path) -> None:
    """Write the case file with what was identified; its comments are lost."""
    content = deepcopy(dict(found.case.content))
    document.override(content, found.settings)
    own = [entry for entry in content.get('unbalances') or []
           if entry['disc'] not in found.columns]
    content['unbalances'] = own + list(_entries(found))
    for entry in (content.get('support'), *(content.get('foundations') or [])):
        for key in ('file', 'stiffness_file'):
            if isinstance(entry, dict) and isinstance(entry.get(key), str):
                entry[key] = str((found.case.path.parent / entry[key]).resolve())
    text = yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=99)
    # YAML 1.1, which PyYAML writes, and 1.2, which a case is, read plain numbers alike.
    head = (f'# {found.case.path.name}, with what `rotorsoil compare` identified from a measured '
            'run.\n# Effective values: they hold for this model and this run.\n')
    target.write_text(head + text, encoding='utf-8')
    load(target)


def _entries(found: Identification) -> Iterator[dict[str, Any]]:
    """Yield the unbalances that were identified, as entries of a case."""
    moments = {column: complex(moment) for column, moment in zip(
        found.columns, found.unbalance.moment.tolist(), strict=True)}
    for disc in found.case.rotor.discs:
        entry: dict[str, Any] = {'disc': disc.name}
        for name, size, phase in ((disc.name, 'moment', 'phase'),
                                  (f'{disc.name}{_COUPLE}', 'couple', 'couple_phase')):
            if name in moments:
                entry[size] = abs(moments[name])
                entry[phase] = math.atan2(moments[name].imag, moments[name].real)
        if len(entry) > 1:
            yield entry
