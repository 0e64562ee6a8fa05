"""Campbell diagram, soil, polar and mass ratio: pictures of the right numbers, with units."""

from pathlib import Path
import re

import numpy as np
import pytest

from rotorsoil_ros.case import models
from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.design.tables import infinite_element_model
from rotorsoil_ros.figures.bearings import bearing_figures
from rotorsoil_ros.figures.modal import mass_ratios, modal_figures, polar
from rotorsoil_ros.figures.response import compliance_figure, main_peaks
from rotorsoil_ros.figures.site import site_plan
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, rpm_to_rad_s

CONFIG = Path(__file__).parents[2] / 'config'
PAPER = CONFIG / 'paper_rotor.yaml'


@pytest.fixture(scope='module')
def paper(tmp_path_factory):
    """Return case, model, response table, cache and the new figures of the paper's machine."""
    directory = tmp_path_factory.mktemp('cache')
    case = load(PAPER)
    model = models.coupled_model(case, directory)
    table = models.response_table(case, model, directory)
    predictor = table.predictor(case.unbalance)
    figures = dict(modal_figures(case, model))
    infinite = infinite_element_model(
        case.soil, case.foundations[0].contact, 'disc', cache=Cache(directory),
        speed_range=case.speed_range)
    figures['compliance'] = compliance_figure(
        case.name, case.foundations[0], case.soil,
        {'cone': ConeModel(case.soil, case.foundations[0].contact), 'infinite elements': infinite},
        np.linspace(*infinite.omega_range, 241))
    figures['polar'] = polar(case, predictor, main_peaks(case, predictor))
    figures['mass_ratios'] = mass_ratios(case, model)
    return case, model, infinite, predictor, figures


def test_every_axis_says_its_unit(paper):
    for name, figure in paper[-1].items():
        for axes in figure.axes:
            for label in filter(None, (axes.get_xlabel(), axes.get_ylabel())):
                assert re.search(r'\[[^\]]+\]$', label), f'{name}: {label}'


def test_criticals_are_dots_where_frequency_is_speed(paper):
    case, model, _, _, figures = paper
    top = figures['campbell'].axes[0]
    dots = sorted(float(line.get_xdata()[0]) for line in top.get_lines()
                  if line.get_marker() == 'o')
    expected = [critical.speed for critical in critical_speeds(model, case.speed_range)]
    np.testing.assert_allclose(dots, rad_s_to_rpm(np.array(expected)))
    for line in top.get_lines():
        if line.get_marker() == 'o':
            np.testing.assert_allclose(line.get_ydata(), line.get_xdata()[0] / 60.0)


def test_curves_of_the_campbell_diagram_pass_through_the_criticals(paper):
    case, model, _, _, figures = paper
    curves = [line for line in figures['campbell'].axes[0].get_lines()
              if line.get_marker() != 'o' and len(line.get_xdata()) > 2]
    for critical in critical_speeds(model, case.speed_range):
        speed, frequency = rad_s_to_rpm(critical.speed), rad_s_to_hz(critical.speed)
        nearest = min(abs(np.interp(speed, curve.get_xdata(), curve.get_ydata()) - frequency)
                      for curve in curves)
        assert nearest < 1e-3 * frequency  # straight between 121 speeds


def test_soil_is_drawn_as_cone_and_as_infinite_elements(paper):
    case, _, infinite, _, figures = paper
    scale = 0.5 / case.soil.shear_wave_speed
    cone = ConeModel(case.soil, case.foundations[0].contact)
    rows = np.array(figures['compliance'].axes).reshape(6, 3)
    for dof, (real, imaginary, difference) in enumerate(rows):
        a0 = real.get_lines()[0].get_xdata()
        ours, theirs = (model.compliance(a0 / scale)[:, dof, dof] for model in (cone, infinite))
        for axes, part in ((real, np.real), (imaginary, np.imag)):
            for line, values in zip(axes.get_lines(), (ours, theirs), strict=False):
                np.testing.assert_allclose(line.get_ydata(), 1e9 * part(values), rtol=1e-9)
        np.testing.assert_allclose(difference.get_lines()[0].get_ydata(),
                                   100.0 * np.abs(ours - theirs) / np.abs(theirs), rtol=1e-6)


def test_polar_curve_is_amplitude_at_the_angle_of_the_phase(paper):
    case, _, _, predictor, figures = paper
    line = figures['polar'].axes[1].get_lines()[1]
    peak = int(np.argmax(line.get_ydata()))
    speeds = [peak.speed for peak in main_peaks(case, predictor)]
    column = predictor.channels.index('disc_2_z')
    answers = predictor.predict(np.array(speeds)).displacement[:, column]
    best = answers[np.argmax(np.abs(answers))]
    assert line.get_ydata()[peak] == pytest.approx(1e6 * abs(best), rel=1e-2)  # a sharp peak
    assert line.get_xdata()[peak] == pytest.approx(np.angle(best), abs=0.2)


def test_mass_ratio_of_one_is_the_case_itself(paper):
    _, _, _, predictor, figures = paper
    line = figures['mass_ratios'].axes[0].get_lines()[1]
    speed = line.get_xdata() * np.pi / 30.0
    values = predictor.predict(speed).displacement[:, predictor.channels.index('disc_2_x')]
    np.testing.assert_allclose(line.get_ydata(), 1e6 * np.abs(values), rtol=1e-6)
    assert '42 kg' in line.get_label()


@pytest.mark.parametrize('number, ratio', [(0, 0.25), (2, 4.0), (3, 16.0)])
def test_other_mass_ratios_are_cases_of_that_mass(paper, number, ratio):
    case, model, _, _, figures = paper
    inertia = [ratio * one for one in case.foundations[0].inertia]
    other = load(PAPER, [f'foundations.0.mass={ratio * 42.0}', f'foundations.0.inertia={inertia}'])
    line = figures['mass_ratios'].axes[1].get_lines()[number]
    picks = slice(None, None, 40)
    speed = line.get_xdata()[picks] * np.pi / 30.0
    motion = models.coupled_model(other, Path()).unbalance_response(speed, other.unbalance)
    expected = motion.displacement[:, model.channels.index('disc_2_z')]
    # the table's own tolerance, where the response is not far below its peak
    np.testing.assert_allclose(line.get_ydata()[picks], 1e6 * np.abs(expected), rtol=1e-3)


def test_films_are_drawn_with_what_the_rotor_stands_on():
    case = load(CONFIG / 'turbo_blower.yaml')
    figures = dict(bearing_figures(case))
    assert list(figures) == ['bearing_drive_end', 'bearing_free_end']
    place, film, stiffness, _ = figures['bearing_drive_end'].axes
    states = case.journals[0].states
    drawn = place.get_lines()[1]
    np.testing.assert_allclose(np.transpose(drawn.get_data()), states.place)
    assert film.get_lines()[0].get_ydata()[0] == pytest.approx(1e6 * states.least[0])
    line = stiffness.get_lines()[0]
    table = case.rotor.bearings[0].stiffness
    np.testing.assert_allclose(
        line.get_ydata(), 1e-6 * table(rpm_to_rad_s(line.get_xdata()))[:, 0, 0])
    for axes in figures['bearing_drive_end'].axes:
        assert axes.get_xlabel().endswith(']')
        assert axes.get_ylabel().endswith(']')


def test_plan_of_a_site_is_drawn_where_blocks_and_probes_are():
    case = load(PAPER.parent / 'fan_on_l_block.yaml')
    [axes] = site_plan(case).axes
    drawn = [(patch.get_x(), patch.get_y(), patch.get_width(), patch.get_height())
             for patch in axes.patches]
    np.testing.assert_allclose(drawn, [
        (-1.0, -1.3, 2.0, 3.0), (-1.8, -1.3, 0.8, 1.5), (1.8, -1.3, 2.0, 3.0)], atol=1e-12)
    places = [line.get_xydata()[0].tolist() for line in axes.get_lines()]
    assert [8.8, 0.2] in places
