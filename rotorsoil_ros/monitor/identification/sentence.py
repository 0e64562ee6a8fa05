"""What a run has told of a machine, in one sentence, and what to do about it."""

from collections.abc import Iterator

from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.identification.case import GROWTH, Identification
from rotorsoil_ros.monitor.verdict import Verdict

# A factor within this of one is told as none, and an unbalance beyond the second is too much.
_SAME, _GROWN = 0.05, 1.5

_FOLD = {2: 'twofold', 3: 'threefold', 4: 'fourfold', 5: 'fivefold', 6: 'sixfold',
         7: 'sevenfold', 8: 'eightfold', 9: 'ninefold', 10: 'tenfold'}
_NEARLY = 0.1  # of a whole number

# How plants call what is looked for most, and what to do where it is not as the case says.
_STIFF = {
    'soil.shear_modulus': (
        'ground', 'put the ground that was found into the case with --write-case'),
    'rotor.bearings.*.stiffness': ('bearings', 'look at bearings, their seats and their bolts'),
    'rotor.bearings.*.pedestal.stiffness': ('pedestals', 'look at the bolts of the pedestals'),
}

_WORDS = {
    Verdict.PASSES: 'The machine behaves as predicted',
    Verdict.FAILS: 'The machine does not behave as predicted',
    Verdict.UNDECIDED: 'Nothing could be held against the prediction',
}


def in_a_sentence(comparison: Comparison, found: Identification | None) -> tuple[str, str]:
    """
    Return what a run told, and what to do next, both without a full stop.

    Parameters
    ----------
    comparison : Comparison
        The run beside its prediction.
    found : Identification or None
        What explains it, where that was asked.

    """
    said, advice = _WORDS[comparison.verdict], []
    if found is not None:
        parts = list(_of_scalars(found)) + list(_of_unbalance(found))
        if parts:
            said += ': ' + ', '.join(part for part, _ in parts)
        advice = [step for _, step in parts if step]
    if not advice:
        advice = [_otherwise(comparison, found)]
    steps = '; '.join(dict.fromkeys(advice))
    return said, f'{steps[0].upper()}{steps[1:]}'


def _of_scalars(found: Identification) -> Iterator[tuple[str, str]]:
    for scalar, factor in zip(found.scalars, found.factor.tolist(), strict=True):
        what, advice = _STIFF.get(scalar.path, (
            scalar.path, f'put {scalar.path} into the case with --write-case'))
        if abs(factor - 1.0) <= _SAME:
            yield f'{what} as in the case', ''
        elif scalar.path in _STIFF:
            way = 'softer' if factor < 1.0 else 'stiffer'
            by = abs(1.0 - factor)
            size = f'{100.0 * by:.0f} %' if by < 1.0 else f'{factor:.2g} times'
            yield f'{what} {size} {way} than in the case', advice
        else:
            yield f'{what} {factor:.2g} times that of the case', advice


def _of_unbalance(found: Identification) -> Iterator[tuple[str, str]]:
    moments = dict(zip(found.columns, found.moment.tolist(), strict=True))
    discs = [disc.name for disc in found.case.rotor.discs]
    for disc, own in zip(discs, found.case.unbalance.tolist(), strict=False):
        if disc not in moments:
            continue
        start = abs(moments[disc])
        end = abs(moments[disc] + moments.get(f'{GROWTH}{disc}', 0.0))
        if start > 0.0 and end > _GROWN * start:
            yield f'unbalance of {disc} grew {_fold(end / start)}', f'clean and balance {disc}'
        elif start > 0.0 and end > (1.0 + 2.0 * _SAME) * start:
            yield (f'unbalance of {disc} grew by {100.0 * (end / start - 1.0):.0f} %',
                   f'look at {disc} at the next stop')
        if abs(own) > 0.0 and abs(start / abs(own) - 1.0) > 2.0 * _SAME:
            yield (f'unbalance of {disc} {start / abs(own):.2g} times that of the case',
                   f'balance {disc}' if start > _GROWN * abs(own) else '')


def _fold(ratio: float) -> str:
    whole = round(ratio)
    if abs(ratio - whole) <= _NEARLY * ratio and whole in _FOLD:
        return _FOLD[whole]
    return f'{ratio:.2g}-fold'


def _otherwise(comparison: Comparison, found: Identification | None) -> str:
    """Return what to do where nothing that was found says it."""
    if any(entry.zone == 'D' and entry.source == 'measured' for entry in comparison.zones):
        return 'stop the machine and balance it: zone D does harm'
    if comparison.verdict == Verdict.PASSES:
        return 'nothing has to be done; keep the log as the record of a healthy machine'
    if comparison.verdict == Verdict.UNDECIDED:
        return 'measure a slow run-up or run-down with a phase reference, and compare it'
    if found is None:
        return ('ask what explains the run: --identify soil.shear_modulus --identify-unbalance '
                '--identify-growth')
    return 'look for what the case leaves out, and at the transducers'
