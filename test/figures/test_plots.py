"""Pictures: to scale, with units, and of the right numbers."""

from io import BytesIO
from pathlib import Path
import re

from matplotlib.patches import Circle as Round, Rectangle as Box
import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.channel import Channel
from rotorsoil_ros.cli import main
from rotorsoil_ros.figures.comparison import ZONE_COLOURS
from rotorsoil_ros.figures.drawing import machine_drawing
from rotorsoil_ros.figures.modal import modal_figures
from rotorsoil_ros.figures.response import all_figures, COLOURS, compliance_figure, trend
from rotorsoil_ros.ground.layers.model import ThinLayerModel
from rotorsoil_ros.ground.layers.profile import Layer, LayeredSoil
from rotorsoil_ros.ground.soil import Circle, Soil
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.units import rad_s_to_rpm, rpm_to_rad_s

CONFIG = Path(__file__).parents[2] / 'config'
FAN = CONFIG / 'plant_fan.yaml'
SAND = Soil(60e6, 0.3, 1900.0, 0.05)


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


def test_a_shaft_that_stands_is_drawn_standing_beside_a_plan():
    case = load(FAN, ['rotor.orientation=vertical', 'rotor.shaft_height=1.3'])
    side, plan = machine_drawing(case).axes
    wheel = max((patch for patch in side.patches if isinstance(patch, Box)),
                key=lambda box: box.get_y() + box.get_height())
    radius = np.sqrt(2.0 * 51.0 / 320.0)
    assert (wheel.get_x(), wheel.get_width()) == pytest.approx((-radius, 2.0 * radius))
    assert wheel.get_y() + 0.5 * wheel.get_height() == pytest.approx(1.3 + 1.6)
    assert side.get_ylim()[1] > 1.3 + 1.7
    rings = [patch.get_radius() for patch in plan.patches if isinstance(patch, Round)]
    assert max(rings) == pytest.approx(radius)


def test_every_machine_of_a_plant_is_in_the_plan():
    case = load(CONFIG / 'fan_house.yaml', [
        'source=fan_1', 'machines.1.place={x: 1.25, y: 0.8, heading: 90 deg}'])
    side, plan = machine_drawing(case).axes
    assert {'fan_1', 'fan_2'} <= {text.get_text() for text in plan.texts}
    shafts = [line.get_xydata() for line in plan.get_lines() if len(line.get_xydata()) == 2]
    length = case.rotor.length
    for ends in ([(-1.25, -0.2), (-1.25, length - 0.2)], [(1.25, 0.8), (1.25 - length, 0.8)]):
        assert any(np.allclose(ends, shaft) for shaft in shafts), ends
    # Stations are called as their machine calls them.
    assert 'drive_end' in {text.get_text() for text in side.texts}


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


def test_layers_rock_and_the_gap_beside_a_block_are_drawn_to_scale():
    case = load(FAN, [
        'support.model=thin_layers', 'foundations.0.embedment=0.8',
        'foundations.0.side_contact=0.25', 'soil={layers: [{thickness: 1.5, shear_modulus: 1.0e+8,'
        ' poisson_ratio: 0.3, density: 1900, loss_factor: 0.05}], below: rock}'])
    side = machine_drawing(case).axes[0]
    spans = {(round(box.get_y(), 6), round(box.get_y() + box.get_height(), 6))
             for box in side.patches if isinstance(box, Box)}
    # Of the contact at 0: the layer from the surface to the rock, and the free part of the wall.
    assert {(-0.7, 0.8), (0.2, 0.8)} <= spans
    assert {text.get_text() for text in side.texts} >= {'rigid rock', 'c_s = 229 m/s'}


def test_water_and_rock_that_may_be_there_are_drawn_where_they_begin():
    case = load(FAN, ['support.model=infinite_elements',
                      'uncertainty={ground_water: true, rock_depth: [2.5, .inf]}'])
    side = machine_drawing(case).axes[0]
    levels = {float(line.get_ydata()[0]) for line in side.get_lines()
              if line.get_linestyle() == '--'}
    assert levels >= {0.0, -2.5}
    assert side.get_ylim()[0] < -2.5
    said = ' '.join(text.get_text() for text in side.texts)
    assert 'ground water may stand here' in said
    assert 'from here on there may be rock' in said


def test_cut_offs_are_marked_in_the_compliance():
    layers = ThinLayerModel.solved(
        LayeredSoil((Layer(3.0, SAND),), None), Circle(1.0), omega_max=250.0)
    block = Foundation('block', Circle(1.0), 0.0, 1e4, 0.5, (1e4, 1e4, 1e4))
    figure = compliance_figure('a', block, SAND, {'same': layers, 'given': layers},
                               np.linspace(0.0, 250.0, 40))
    marks = {float(line.get_xdata()[0]) for line in figure.axes[0].get_lines()
             if line.get_linestyle() == ':'}
    expected = layers.singular[layers.singular < 250.0] / SAND.shear_wave_speed
    assert len(expected) >= 2
    np.testing.assert_allclose(sorted(marks), expected)


def test_still_directions_of_a_rigid_base_are_not_drawn(tmp_path):
    case = load(CONFIG / 'rk4_rotor_kit.yaml')
    model = coupled_model(case, tmp_path)
    names = [name for name, _ in all_figures(
        case, model, ResponseTable.build(model, case.speed_range))]
    assert names == ['machine', 'bode_journals', 'bode_discs', 'bode_probes', 'orbits', 'shapes']


def test_trend_shows_what_an_instrument_could_see():
    speed = rpm_to_rad_s(np.array([600.0, 1200.0]))
    figure = trend(np.array([0.0, 1.0]), speed, np.array([[1e-6, 2e-6, 3e-6], [4e-6, 5e-6, 6e-6]]),
                   channels=tuple(map(Channel.parse, ('a_housing_x', 'a_journal_x', 'block_rx'))),
                   title='t')
    top, bottom = figure.axes
    np.testing.assert_allclose(top.get_lines()[0].get_ydata(), [600.0, 1200.0])
    [line] = bottom.get_lines()
    assert line.get_label() == 'a_housing_x'
    np.testing.assert_allclose(line.get_ydata(), [1.0, 4.0])


PEDESTAL = '{mass: 60.0, stiffness: {xx: 8.0e7, zz: 2.5e8}, damping: {xx: 5.0e3, zz: 5.0e3}}'


@pytest.fixture(scope='module')
def on_pedestal(tmp_path_factory):
    """Return case, model and figures of the fan with a pedestal, past its shaft's critical."""
    case = load(FAN, [f'rotor.bearings.1.pedestal={PEDESTAL}', 'speed_range_rpm=[100, 4500]'])
    model = coupled_model(case, tmp_path_factory.mktemp('cache'))
    table = ResponseTable.build(model, case.speed_range)
    return case, model, {**dict(all_figures(case, model, table)),
                         **dict(modal_figures(case, model))}


def felt_criticals(case, model):
    """Return the critical speeds that are felt."""
    return [one for one in critical_speeds(model, case.speed_range)
            if one.amplification_factor >= 2.5]


def test_orbits_and_shapes_are_those_at_the_critical_speeds(on_pedestal):
    case, model, figures = on_pedestal
    felt = felt_criticals(case, model)
    assert len(felt) >= 2
    rows, shapes = figures['orbits'].subfigs, figures['shapes'].axes
    assert len(rows) == len(shapes) == len(felt)
    for critical, row, shape in zip(felt, rows, shapes, strict=True):
        title = (f'critical speed {rad_s_to_rpm(critical.speed):.0f} rpm, '
                 f'{"forward" if critical.whirl > 0 else "backward"}, damping ratio '
                 f'{critical.damping_ratio:.2g}, amplification factor '
                 f'{critical.amplification_factor:.3g}')
        assert row.get_suptitle() == shape.get_title() == title
        exact = model.unbalance_response(np.array([critical.speed]), case.unbalance)
        x, z = (exact.displacement[0, model.channels.index(f'wheel_{axis}')] for axis in 'xz')
        [wheel] = [axes for axes in row.axes if axes.get_title() == 'wheel']
        orbit, start = wheel.get_lines()
        # the dot is at t = 0; the table that the orbit comes from is good to 1e-3
        np.testing.assert_allclose(np.ravel(start.get_data()), [1e6 * x.real, 1e6 * z.real],
                                   rtol=5e-3, atol=5e-3 * 1e6 * max(abs(x), abs(z)))
        assert np.abs(orbit.get_xdata()).max() == pytest.approx(1e6 * abs(x), rel=5e-3)


def test_shapes_show_the_housings_beside_the_shaft(on_pedestal):
    case, model, figures = on_pedestal
    for critical, axes in zip(felt_criticals(case, model), figures['critical_shapes'].axes,
                              strict=True):
        lines = {line.get_label(): line for line in axes.get_lines()}
        marks = lines['x of the housings'].get_ydata()
        # x of the support in the mode, at the seat: u + theta x r, and the pedestal's own
        sway, _, _, _, rocking, twist = critical.support[:6]
        seats = [sway + 2.0 * rocking - (place - 0.2) * twist for place in (0.25, 1.25)]
        seats[1] += critical.support[6]
        shaft = critical.deflection[:, 0]
        turn = np.exp(-1j * np.angle(shaft[np.abs(shaft).argmax()]))
        np.testing.assert_allclose(marks, np.real(np.array(seats) * turn), rtol=1e-9, atol=1e-12)


def test_pedestal_is_a_housing_on_spring_and_dashpot_and_says_what_it_is(on_pedestal):
    _, _, figures = on_pedestal
    side, end = figures['machine'].axes
    texts = [text.get_text() for text in side.texts]
    assert 'drive_end' in texts
    assert 'fan_end\npedestal: 60 kg\n80 (x), 250 (z) N/um' in texts
    for axes in (side, end):
        # below the shaft of 2 m, above the block of 1.2 m, under its bearing
        springs = [line for line in axes.get_lines() if len(line.get_xdata()) > 8]
        [spring] = springs
        low, high = spring.get_ydata().min(), spring.get_ydata().max()
        assert 1.2 < low < 1.3
        assert 1.7 < high < 2.0
        assert np.abs(spring.get_xdata() - (1.25 if axes is side else 0.0)).max() < 0.2


def test_block_is_drawn_as_high_as_the_case_says(on_pedestal):
    _, _, figures = on_pedestal
    for axes in figures['machine'].axes:
        assert any(isinstance(patch, Box) and patch.get_height() == pytest.approx(1.2)
                   for patch in axes.patches)


def test_machine_whose_modes_are_not_known_is_drawn_without_them(tmp_path, capsys):
    rows = '\n'.join(f'{hz},{k},{0.1 * k}' for hz, k in zip(
        np.linspace(1.0, 150.0, 10), 6e7 * (1.0 + 0.5 * (-1.0) ** np.arange(10)), strict=True))
    (tmp_path / 's.csv').write_text(f'hz,xx_re,xx_im\n{rows}\n')
    assert main(['plot', str(CONFIG / 'paper_rotor.yaml'), '-o', str(tmp_path / 'plots'), '--set',
                 f'support={{model: table, file: {tmp_path / "s.csv"}}}', '--set',
                 'foundations.0.mass=900', '--cache', str(tmp_path / 'cache')]) == 0
    said = capsys.readouterr()
    assert said.err.startswith('no pictures campbell, critical_shapes, damping, orbits, '
                                   'shapes: ')
    assert 'support.file: ' in said.err
    drawn = {path.stem for path in (tmp_path / 'plots').iterdir()}
    assert {'machine', 'bode_discs', 'polar'} <= drawn
    assert not {'campbell', 'orbits', 'shapes'} & drawn


def test_no_legend_lies_over_data(fan):
    case, _, figures = fan
    model = coupled_model(case, Path('unused'))
    every = {**figures, **dict(modal_figures(case, model))}
    for name, figure in every.items():
        figure.savefig(BytesIO())  # lays it out
        assert [axes for axes in figure.axes if axes.get_legend() is not None] == [], name
        for legend in figure.legends:
            box = legend.get_window_extent()
            assert not any(box.overlaps(axes.get_window_extent()) for axes in figure.axes), name


def test_campbell_gives_one_number_to_a_mode_in_both_panels(fan):
    case, _, _ = fan
    figure = dict(modal_figures(case, coupled_model(case, Path('unused'))))['campbell']
    top, bottom = figure.axes
    numbers = [sorted(text.get_text() for text in axes.texts if text.get_text().isdigit())
               for axes in (top, bottom)]
    assert numbers[0] == numbers[1] != []
    for axes in (top, bottom):
        lines = [line for line in axes.get_lines() if len(line.get_xdata()) > 2]
        assert len(lines) == len(numbers[0])


def test_limits_and_channels_differ_in_colour():
    assert not set(ZONE_COLOURS.values()) & set(COLOURS)
