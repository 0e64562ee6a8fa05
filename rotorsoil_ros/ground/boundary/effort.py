"""How fine elements have to be for waves of a length, and what may be solved at all."""

from collections.abc import Sequence
import math

from rotorsoil_ros.errors import require, RotorSoilError
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.plan import Part

# Largest Poisson's ratio that was measured.
HIGHEST_POISSON_RATIO = 0.49

# Ends of the ranges of a0 that are solved: soils of another G share them.
HIGHEST_A0 = (1.0, 2.0, 3.0, 4.0, 6.0, 9.0, 12.0)

# What can be solved in a minute or so, on one core.
_MOST_UNKNOWNS = 2100
_MOST_NODES = 2000

# Series on a rectangle: nodes along a half side per a0, and at least; how they grow with the ratio
# of the sides.
_NODES_PER_A0 = 1.4
_LEAST_NODES = 6
_LONGER_NODES = 0.75

# Half of the patches along the longest side of a block, in the coarser of two meshes; along others
# fewer, as the root of their length; at least so many per a0 of the half side.
_HALF_LONGEST, _HALF_PER_A0 = 3, 1.0
# Patches of both meshes over that; their errors fall with h^2.
COARSE, FINE = 2, 3
# Round-off makes no more patches.
_SAME = 1.0 - 1e-9


def nodes_along(ratio: float, highest: float) -> tuple[int, int]:
    """Return the nodes along half of the short and half of the long side, up to an a0."""
    nodes = max(_LEAST_NODES, math.ceil(_NODES_PER_A0 * highest))
    return nodes, math.ceil(nodes * (1.0 + _LONGER_NODES * (ratio - 1.0)))


def halves(part: Part, parts: Sequence[Part], highest: float) -> tuple[int, int]:
    """Return half of the patches along x and y of a part of a block, before they are refined."""
    longest = max(max(one.half_width, one.half_length) for one in parts)
    across, along = (
        max(math.ceil(_HALF_LONGEST * math.sqrt(half / longest) * _SAME),
            math.ceil(_HALF_PER_A0 * highest * half * _SAME))
        for half in (part.half_width, part.half_length))
    return across, along


def patch_unknowns(blocks: Sequence[Sequence[Part]], highest: float) -> int:
    """Return the unknowns of the finer mesh of blocks up to omega / c_s."""
    return 3 * FINE**2 * sum(math.prod(halves(part, parts, highest))
                             for parts in blocks for part in parts)


def highest_a0(site: Site, a0: float) -> float:
    """
    Return the end of the range that is solved for an a0 of a site of unit length.

    Raises
    ------
    RotorSoilError
        If there is none, or it needs more elements than can be solved in reasonable time.

    """
    require(a0 <= HIGHEST_A0[-1], 'a0', f'<= {HIGHEST_A0[-1]:g} [-] (omega b / c_s with the '
            'shortest half side b) for boundary elements: lower speed_range_rpm', a0)
    highest = next(edge for edge in HIGHEST_A0 if edge >= a0)
    require_solvable(site, highest)
    return highest


def require_solvable(site: Site, highest: float) -> None:
    """Raise a RotorSoilError if elements for waves of an a0 cannot be solved in a minute or so."""
    if site.rectangle is None:
        needed, most = patch_unknowns(site.placed, highest), _MOST_UNKNOWNS
    else:
        needed, most = math.prod(nodes_along(site.rectangle.ratio, highest)), _MOST_NODES
    if needed > most:
        raise RotorSoilError(
            f'boundary elements must be at most {most} (a minute or two), got {needed} for the '
            f'size of the blocks at a0 {highest:.3g}: lower speed_range_rpm, or take '
            'infinite_elements')
