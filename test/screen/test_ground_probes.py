"""Probes on the ground are shown as probes, and blocks where they stand."""

from pathlib import Path

import pytest

pytest.importorskip('rerun', reason='rerun-sdk is optional')

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.screen.channels import PROBES, trends
from rotorsoil_ros.screen.scene import Scene

CASE = Path(__file__).parents[2] / 'config' / 'fan_on_l_block.yaml'


@pytest.fixture(scope='module')
def site(tmp_path_factory):
    """Return a case with a probe in the yard, and its channels."""
    case = load(CASE)
    return case, coupled_model(case, tmp_path_factory.mktemp('tables')).channels


def test_a_probe_on_the_ground_has_a_curve_for_each_direction(site):
    shown = trends('fan', *site)
    assert [trend.entity for trend in shown if trend.kind == PROBES] == [
        '/fan/yard/x', '/fan/yard/y', '/fan/yard/z']


def test_blocks_of_a_site_are_drawn_by_their_parts_where_they_stand(site):
    ell, other = Scene(*site).blocks
    assert len(ell.parts) == 2
    # Parts are about the centroid of the plan.
    assert abs(
        sum(part.area * part.x for part in ell.parts)) < 1e-12
    assert (other.centre_x, other.centre_y) == (2.8, 0.2)
