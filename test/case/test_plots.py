"""Pictures: to scale, with units, and of the right numbers."""

from io import BytesIO
from pathlib import Path
import re

from matplotlib.patches import Rectangle as Box
import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.drawing import machine_drawing
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.case.plots import all_figures, trend
from rotorsoil_ros.physics.response import ResponseTable
from rotorsoil_ros.physics.units import rpm_to_rad_s

CONFIG = Path(__file__).parents[2] / 'config'
FAN = CONFIG / 'plant_fan.yaml'


@pytest.fixture(scope='module')
def fan(tmp_path_factory):
    """Return case, table and every figure of the fan."""
    case = load(FAN)
    model = coupled_model(case, tmp_path_factory.mktemp('cache'))
    table = ResponseTable.build(model, case.speed_range)
    return case, table, dict(all_figures(case, model, table))


def test_every_axis_says_its_unit(fan):
    _, _, figures = fan
    for name, figure in figures.items():
        outer = [axes for axes in figure.axes if axes.get_xlabel()]
        assert outer
        for axes in figure.axes:
            for label in filter(None, (axes.get_xlabel(), axes.get_ylabel())):
                assert re.search(r'\[[^\]]+\]$', label), f'{name}: {label}'


def test_machine_is_drawn_to_scale_in_both_views(fan):
    _, _, figures = fan
    side, end = figures['machine'].axes
    figures['machine'].savefig(BytesIO())  # lays it out
    scales = [axes.transData.transform([[0.0, 0.0], [1.0, 1.0]]) for axes in (side, end)]
    pixels = np.array([top - origin for origin, top in scales])
    np.testing.assert_allclose(pixels, pixels[0, 0], rtol=0.02)  # layout in whole pixels


def test_block_and_wheel_stand_where_the_case_says():
    figure = machine_drawing(load(FAN))
    boxes = [patch for patch in figure.axes[0].patches if isinstance(patch, Box)]
    spans = {(round(box.get_x(), 6), round(box.get_width(), 6)) for box in boxes}
    assert (0.2 - 1.5, 3.0) in spans
    wheel = max(boxes, key=lambda box: box.get_y() + box.get_height())
    # a solid cylinder of 320 kg and 51 kg m^2 has a radius of 0.565 m
    assert wheel.get_height() == pytest.approx(2.0 * np.sqrt(2.0 * 51.0 / 320.0))
    assert wheel.get_x() + 0.5 * wheel.get_width() == pytest.approx(1.6)
    assert wheel.get_y() + 0.5 * wheel.get_height() == pytest.approx(2.0)


def test_bode_shows_micrometres_and_degrees_of_the_table(fan):
    case, table, figures = fan
    amplitude, phase = figures['bode_discs'].axes
    lines = {line.get_label(): line for line in amplitude.get_lines()}
    assert set(lines) == {'coupling_x', 'coupling_z', 'wheel_x', 'wheel_z'}
    predictor = table.predictor(case.unbalance)
    exact = predictor.predict(rpm_to_rad_s(np.array([1500.0]))).displacement[
        0, predictor.channels.index('wheel_x')]
    drawn = {line.get_label(): np.interp(1500.0, *line.get_data()) for line in
             [*amplitude.get_lines()]}
    turned = {line.get_label(): np.interp(1500.0, *line.get_data()) for line in
              phase.get_lines()}
    assert drawn['wheel_x'] == pytest.approx(1e6 * abs(exact), rel=1e-3)  # between points
    assert turned['wheel_x'] == pytest.approx(np.rad2deg(np.angle(exact)), abs=0.1)


def test_still_directions_of_a_rigid_base_are_not_drawn(tmp_path):
    case = load(CONFIG / 'rk4_rotor_kit.yaml')
    model = coupled_model(case, tmp_path)
    names = [name for name, _ in all_figures(
        case, model, ResponseTable.build(model, case.speed_range))]
    assert names == ['machine', 'bode_journals', 'bode_discs', 'bode_probes', 'orbits', 'shapes']


def test_trend_shows_what_an_instrument_could_see():
    speed = rpm_to_rad_s(np.array([600.0, 1200.0]))
    figure = trend(np.array([0.0, 1.0]), speed, np.array([[1e-6, 2e-6, 3e-6], [4e-6, 5e-6, 6e-6]]),
                   channels=('a_housing_x', 'a_journal_x', 'block_rx'), title='t')
    top, bottom = figure.axes
    np.testing.assert_allclose(top.get_lines()[0].get_ydata(), [600.0, 1200.0])
    [line] = bottom.get_lines()
    assert line.get_label() == 'a_housing_x'
    np.testing.assert_allclose(line.get_ydata(), [1.0, 4.0])
