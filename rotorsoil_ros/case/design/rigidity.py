"""Which blocks of a case bend where they are taken as rigid, in words with their numbers."""

from collections.abc import Iterator, Sequence
import math

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.ground.soil import SoilModel
from rotorsoil_ros.machine.flexible.rigidity import (
    ABOVE_EXCITATION,
    ABOVE_HEAVE,
    Rigidity,
    rigidity,
)
from rotorsoil_ros.machine.foundation import Foundation, soils_below
from rotorsoil_ros.units import rad_s_to_hz

# Shares by which a block that bends was off at most, up to so much of its first bending.
_DYNAMIC = ((0.3, 'up to 13%'), (0.5, 'up to 19%'), (1.0, 'up to 60%'),
            (math.inf, 'more than 60%'))


def rigidities(
    case: Case, soil_models: Sequence[SoilModel],
) -> Iterator[tuple[int, Foundation, Rigidity]]:
    """Yield how rigid each block is that could bend, and its place among the foundations."""
    below = soils_below(case.foundations, soil_models)
    for index, (block, ground) in enumerate(zip(case.foundations, below, strict=True)):
        if block.body is not None:
            continue
        found = rigidity(block, ground, case.speed_range)
        if found is not None:
            yield index, block, found


def bending_told(
    case: Case, soil_models: Sequence[SoilModel],
) -> Iterator[tuple[str, str]]:
    """Yield the first bending of each block beside what it has to be above."""
    for _, block, found in rigidities(case, soil_models):
        yield f'{block.name}: first {_moves(found)[:-1]}ing, if it were free', (
            f'{_numbers(block, found)}: {found.over_excitation:.3g} times the highest 1X'
            + (f', {found.over_heave:.3g} times its heave' if found.heave > 0.0 else ''))


def of_rigidity(case: Case, soil_models: Sequence[SoilModel]) -> Iterator[str]:
    """Yield which blocks are not as rigid as they are taken to be, and what that may cost."""
    for index, block, found in rigidities(case, soil_models):
        if found.is_rigid:
            continue
        top = rad_s_to_hz(found.excitation)
        reasons = []
        if found.over_excitation < ABOVE_EXCITATION:
            most = next(error for share, error in _DYNAMIC
                        if found.excitation <= share * found.lowest)
            reasons.append(
                f'{ABOVE_EXCITATION:g} times the highest 1X frequency of {top:.3g} Hz are '
                f'{ABOVE_EXCITATION * top:.3g} Hz (a raft so near was off by {most})')
        if found.over_heave < ABOVE_HEAVE:
            heave = rad_s_to_hz(found.heave)
            reasons.append(
                f'{ABOVE_HEAVE:g} times its heave of {heave:.3g} Hz are '
                f'{ABOVE_HEAVE * heave:.3g} Hz (off by {found.static_error:.0%} at rest)')
        yield (f'foundations.{index}: {block.name} is not rigid: free, it {_moves(found)} at '
               f'{_numbers(block, found)}; {"; ".join(reasons)}; '
               'say flexible instead, with its stiffness and mass')


def _moves(found: Rigidity) -> str:
    return 'twists' if found.twist < found.bending else 'bends'


def _numbers(block: Foundation, found: Rigidity) -> str:
    shape = '' if found.is_slab else ' long at most, a plan that bends lower than such a slab'
    if found.twist < found.bending:
        shape = f' by {found.width:.3g} m'
    return (f'{rad_s_to_hz(found.lowest):.3g} Hz (slab {found.length:.3g} m'
            f'{shape}, {found.thickness:.3g} m thick, E {1e-9 * block.young_modulus:.3g} GPa)')
