"""What was identified, in words with both widths and what speaks against it, and as a case."""

from collections.abc import Iterator
from copy import deepcopy
import math
from pathlib import Path
from typing import Any

import numpy as np

from rotorsoil_ros.case import document
from rotorsoil_ros.case.authoring.comments import edited
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.plant.machines import written_out
from rotorsoil_ros.monitor.identification.case import (
    COUPLE,
    FARTHEST_PULL,
    Identification,
    RUNOUT,
)
from rotorsoil_ros.monitor.identification.fit import Fit

_SMOOTH = 0.5  # correlation of what is left from which on it follows the speed
_FEW = 20.0  # independent vectors
_WIDENING_PULL = 2.0
_LOOKS_UNNAMED = 3.0
_TRADES = 0.98


def describe(found: Identification) -> Iterator[str]:
    """Yield what was identified, line by line."""
    worth = found.described.worth
    yield (f'identified from {worth.vectors} vectors of {", ".join(found.channels)}, worth '
           f'{worth.independent:.0f} independent ones: explains '
           f'{100.0 * found.described.explained:.2f} % of their power')
    if found.slip:
        yield f'  {found.slip}'
    wider = widening(found.tolerant)
    off = ', '.join(scalar.path.rpartition('.')[2] for scalar in found.tolerances) or 'all else'
    for index, scalar in enumerate(found.scalars):
        yield (f'  {scalar.path}: factor {found.factor[index]:.4g} +- '
               f'{_percent(found.described, index)} for this case exactly as described')
        factor = math.exp(found.tolerant.state.logs[index])
        yield (f'  {scalar.path}: factor {factor:.3g} +- '
               f'{_percent(found.tolerant, index, wider)} within tolerances of {off}: '
               'quote this one')
    for index, column in enumerate(found.columns):
        yield from _column(found, index, column, wider)
    yield from _alarms(found, wider)


def _percent(fit: Fit, index: int, wider: float = 1.0) -> str:
    return f'{100.0 * wider * fit.log_width[index]:.2g} %'


def _column(
    found: Identification, index: int, column: str, wider: float,
) -> Iterator[str]:
    unit = 'm' if column.startswith(RUNOUT) else (
        'kg m^2' if column.endswith(COUPLE) else 'kg m')
    key = found.wanted.key_angle
    moment = complex(found.moment[index])
    width = found.described.column_width(index, key_angle=key)
    wide = wider * found.tolerant.column_width(index, key_angle=key)
    yield (f'  {column}: {abs(moment):.4g} {unit} at '
           f'{math.degrees(math.atan2(moment.imag, moment.real)):.1f} deg, +- {width:.2g} {unit} '
           f'(transducers {100.0 * found.wanted.gain:g} %, '
           f'{math.degrees(found.wanted.angle):g} deg assumed); within tolerances +- '
           f'{wide:.2g} {unit}')


def widening(fit: Fit) -> float:
    """Return by how much a case that does not fit widens what is said."""
    pulls = fit.pulls[fit.problem.named:]
    largest = float(np.max(pulls, initial=0.0))
    return 0.5 * largest if largest > _WIDENING_PULL else 1.0


def _alarms(found: Identification, wider: float) -> Iterator[str]:
    worth = found.described.worth
    if worth.in_time > _SMOOTH:
        yield (f'  smooth residual (correlation of neighbours {worth.in_time:.2f}): what is left '
               'follows the speed. It is the model or a drift, not noise; +- widened for it')
    if worth.independent < _FEW:
        yield f'  few independent vectors ({worth.independent:.0f}): +- is itself uncertain'
    for scalar, pull in zip(found.tolerances, found.tolerant.pulls[len(found.scalars):].tolist(),
                            strict=True):
        if pull > FARTHEST_PULL:
            yield (f'  {scalar.path} would have to differ by {pull:.2g} tolerances: this case is '
                   f'not the machine. +- multiplied by {wider:.2g}; a factor is effective, '
                   'for predictions with this case, NOT a property of soil or bearing')
    for scalar, pull in zip(found.scalars, found.described.pulls.tolist(), strict=True):
        if pull > FARTHEST_PULL:
            yield (f'  {scalar.path} is {pull:.2g} prior deviations from the case: check units, '
                   'case and soil before believing it')
    yield from _unnamed(found)
    yield from _trades(found)
    yield ('  not seen: an error of all transducers alike, and a mass that is off by several '
           'tolerances (it trades with the stiffness)')


def _unnamed(found: Identification) -> Iterator[str]:
    """Tell of planes that nobody named and that explain the run better."""
    fit = found.tolerant
    for index, plane in enumerate(found.others):
        place = fit.column_parts()[len(found.columns) + index]
        vector = complex(fit.state.others[index])
        parts = np.array([vector.real, vector.imag])
        size = math.sqrt(float(parts @ np.linalg.solve(fit.covariance[place, place], parts)) / 2.0)
        if size > _LOOKS_UNNAMED:
            width = fit.column_width(len(found.columns) + index, key_angle=0.0)
            yield (f'  an unbalance on {plane} (not named) of {abs(vector):.3g} +- {width:.2g} '
                   f'kg m explains the run better: try --plane {plane}')


def _trades(found: Identification) -> Iterator[str]:
    """Tell of scalars that cannot be told apart."""
    fit = found.tolerant
    deviation = np.where(fit.deviation > 0.0, fit.deviation, 1.0)
    correlation = fit.covariance / np.outer(deviation, deviation)
    names = [scalar.path for scalar in (*found.scalars, *found.tolerances)]
    for row in range(len(found.scalars)):
        for column in range(row + 1, len(names)):
            if abs(correlation[row, column]) > _TRADES:
                yield (f'  {names[row]} and {names[column]} trade off (correlation '
                       f'{correlation[row, column]:+.3f}): mostly their '
                       f'{"ratio" if correlation[row, column] > 0.0 else "product"} is told')


_HEAD = ('# With what `rotorsoil compare` identified from a measured run: effective values,\n'
         '# which hold for this model and this run.\n')


def write_case(found: Identification, target: Path) -> None:
    """Write the case as described with what was identified, its comments kept."""
    content = deepcopy(dict(found.case.content))
    document.override(content, found.settings)
    entries = {entry['disc']: entry for entry in _entries(found)}
    # Among several machines a disc carries the name of its own, but not in the file.
    berth, machines = found.case.berth, content.get('machines') or []
    holder = content if berth is None else machines[berth.index]
    before = '' if berth is None else f'{found.case.name}_'
    own = holder.get('unbalances') or []
    # Each in the place of the first that its disc has; of several the others are gone.
    kept = [entries.pop(f'{before}{entry["disc"]}', None)
            if f'{before}{entry["disc"]}' in found.columns else entry for entry in own]
    holder['unbalances'] = [entry | {'disc': entry['disc'].removeprefix(before)} for entry in (
        *(entry for entry in kept if entry is not None), *entries.values())]
    for machine in machines:
        machine['rotor'] = written_out(
            machine, found.case.files, on_blocks=bool(content.get('foundations')))
    for entry in (content.get('support'), *(content.get('foundations') or [])):
        for key in ('file', 'stiffness_file'):
            if isinstance(entry, dict) and isinstance(entry.get(key), str):
                entry[key] = str((found.case.path.parent / entry[key]).resolve())
    text = _written(found.case.path)
    text = document.text_of(content, []) if text is None else edited(text, content)
    target.write_text(text if text.startswith(_HEAD) else _HEAD + text, encoding='utf-8')
    load(target, cache_directory=found.case.cache_directory)


def _written(path: Path) -> str | None:
    """Return the text of a case file; None where a case came from elsewhere."""
    try:
        text = path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError):  # a log is no text
        return None
    return text


def _entries(found: Identification) -> Iterator[dict[str, Any]]:
    """Yield the unbalances that were identified, as entries of a case."""
    moments = {column: complex(moment) for column, moment in zip(
        found.columns, found.moment.tolist(), strict=True)}
    for disc in found.case.rotor.discs:
        entry: dict[str, Any] = {'disc': disc.name}
        for name, size, phase in ((disc.name, 'moment', 'phase'),
                                  (f'{disc.name}{COUPLE}', 'couple', 'couple_phase')):
            if name in moments:
                entry[size] = abs(moments[name])
                entry[phase] = math.atan2(moments[name].imag, moments[name].real)
        if len(entry) > 1:
            yield entry
