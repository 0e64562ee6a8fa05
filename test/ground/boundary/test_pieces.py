"""Closed forms at rest, sums over lattices, and places on the ground."""

import math

import numpy as np
import pytest

from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.ground.boundary.lattice import lattice_errors
from rotorsoil_ros.ground.boundary.site import Site
from rotorsoil_ros.ground.boundary.statics import primitives
from rotorsoil_ros.ground.plan import Part, Plan
from rotorsoil_ros.ground.soil import Circle, Rectangle

# From an L of a square of 2 m and a foot of 1 m x 2 m on its right, below.
L_PARTS = (Part(1.0, 1.0, 0.0, 0.0), Part(0.5, 0.5, 1.5, -0.5))


def differences(x, y, x0, y0):
    """Return what two rectangles say of each primitive: its fourth difference."""
    found = {}
    for name, values in primitives((x[:, None] - x0)[:, :, None, None], y[:, None] - y0).items():
        for axis in range(4):
            values = np.diff(values, axis=axis)
        found[name] = values.item()
    return found


def test_unit_square_moves_itself_by_the_closed_form():
    edges = np.array([-0.5, 0.5])
    closed = 4.0 * math.log(1.0 + math.sqrt(2.0)) - 4.0 / 3.0 * (math.sqrt(2.0) - 1.0)
    assert differences(edges, edges, edges, edges)['r'] == pytest.approx(closed, rel=1e-13)


def test_static_integrals_are_those_of_quadrature():
    point, weight = np.polynomial.legendre.leggauss(12)
    sides = [np.array(side) for side in ((2.0, 3.0), (-1.0, 0.5), (-0.5, 0.7), (1.0, 1.6))]
    x, y, x0, y0 = (0.5 * (side[1] - side[0]) * point + side.mean() for side in sides)
    share = np.einsum('i,k,j,l->ijkl', *[0.5 * weight] * 4)  # order of axes: x, x0, y, y0
    dx, dy = (x[:, None] - x0)[:, :, None, None], y[:, None] - y0
    r = np.hypot(dx, dy)
    kernels = {'r': 1.0 / r, 'xx': dx**2 / r**3, 'xy': dx * dy / r**3, 'x': dx / r**2,
               'y': dy / r**2}
    area = math.prod(float(np.diff(side)[0]) for side in sides)
    for name, found in differences(sides[0], sides[1], sides[2], sides[3]).items():
        assert found / area == pytest.approx((kernels[name] * share).sum(), rel=1e-11), name


def test_a_square_lattice_errs_by_its_zeta_function():
    of_r, of_difference = lattice_errors(np.array(1.0), np.array(1.0))
    # 4 zeta(-1/2) beta(-1/2)
    assert of_r == pytest.approx(4.0 * -0.2078862249773545 * 0.2751900529, rel=1e-4)
    assert of_difference == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize('ratio', [0.5, 1.0, 3.0])
def test_lattice_sums_are_those_of_a_smooth_window(ratio):
    """Sum less integral of r exp(-r^2 / W^2), extrapolated in W^-2 to no window."""
    def excess(width, power):
        count = int(7.0 * width / min(ratio, 1.0))
        m, n = np.meshgrid(np.arange(-count, count + 1), ratio * np.arange(-count, count + 1))
        r = np.hypot(m, n)
        shape = r if power else np.divide(m**2 - n**2, r, out=np.zeros_like(r), where=r > 0.0)
        window = shape * np.exp(-(r / width) ** 2)
        integral = math.pi**1.5 * width**3 / (2.0 * ratio) if power else 0.0
        return window.sum() - integral

    width = 6.0 * max(ratio, 1.0)
    for power, found in zip((1, 0), lattice_errors(np.array(1.0), np.array(ratio)), strict=True):
        narrow, wide = excess(width, power), excess(1.5 * width, power)
        assert found == pytest.approx((2.25 * wide - narrow) / 1.25, abs=2e-4)


def test_an_l_has_the_moments_of_its_integrals():
    plan = Plan(L_PARTS)
    assert plan.area == 5.0
    assert plan.centroid == pytest.approx((0.3, -0.1))
    x, y = (np.linspace(low, high, 3001)[:-1] + 0.5 * (high - low) / 3000.0
            for low, high in ((-1.0, 2.0), (-1.0, 1.0)))
    inside = (x[:, None] < 1.0) | (y < 0.0)
    cell = 3.0 / 3000.0 * 2.0 / 3000.0
    u, v = x[:, None] - 0.3, y + 0.1
    moments = [(inside * v**2).sum() * cell, (inside * u**2).sum() * cell]
    assert plan.second_moments == pytest.approx([*moments, sum(moments)], rel=1e-5)
    assert plan.product_moment == pytest.approx((inside * u * v).sum() * cell, rel=1e-5)
    np.testing.assert_allclose(plan.extents, ((-1.3, 1.7), (-0.9, 1.1)))


@pytest.mark.parametrize('parts, said', [
    ((L_PARTS[0], Part(0.5, 0.5, 1.2, -0.5)),
     r'parts must not overlap, got 0\.3 m of overlap of parts 0 and 1'),
    ((L_PARTS[0], Part(0.5, 0.5, 2.0, -0.5)), r'must touch along an edge, got 0\.5 m between'),
    ((L_PARTS[0], Part(0.5, 0.5, 1.5, 1.5)), r'got no more than a corner of part 1'),
    (tuple(Part(0.5, 0.5, x, y) for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0, 2.0)
           if (x, y) != (1.0, 1.0)), r'must not enclose a hole, got one about x 1 m, y 1 m'),
    ((), r'parts must at least one rectangle|parts must be at least one rectangle'),
])
def test_parts_that_make_no_contact_are_refused(parts, said):
    with pytest.raises(RotorSoilError, match=said):
        Plan(parts)


def test_a_court_that_is_open_is_no_hole():
    ring = tuple(Part(0.5, 0.5, x, y) for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0, 2.0)
                 if (x, y) not in ((1.0, 1.0), (2.0, 1.0)))
    assert Plan(ring).area == 7.0


@pytest.mark.parametrize('contacts, centres, points, said', [
    ((Rectangle(1.0, 1.0), Circle(1.0)), ((0.0, 0.0), (5.0, 0.0)), (), 'got a circle of radius'),
    ((Rectangle(1.0, 1.0),) * 2, ((0.0, 0.0), (1.5, 0.0)), (), r'must not overlap, got 0\.5 m'),
    ((Rectangle(1.0, 1.0),), ((0.0, 0.0),), ((1.2, 0.0),),
     r'at least 0\.5 m away from every block .* got 0\.2 m at x 1\.2 m'),
    ((Rectangle(1.0, 1.0),), ((0.0, 0.0),), ((0.2, 0.0),), r'got 0 m at x 0\.2 m'),
])
def test_a_layout_that_is_none_is_refused(contacts, centres, points, said):
    with pytest.raises(RotorSoilError, match=said):
        Site.of(contacts, centres, points)


def test_layouts_of_one_shape_share_a_table():
    small = Site.of((Rectangle(0.7, 1.4),), ((3.0, -2.0),))
    large = Site.of((Rectangle(2.1, 4.2),), ((0.0, 0.0),))
    assert small.scaled() == large.scaled()
