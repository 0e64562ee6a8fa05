"""The seed paper's figures against its own equations, and the page that quotes them."""

from pathlib import Path
import re

import numpy as np
import pytest

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.figures.paper import claim_numbers, paper_figures, peak_numbers, PEDESTALS
from rotorsoil_ros.ground.cone import ConeModel

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope='module')
def case():
    """Return the paper's machine on infinite elements."""
    return load(ROOT / 'config' / 'paper_rotor.yaml', ['support.model=infinite_elements'])


@pytest.fixture(scope='module')
def infinite(case, tmp_path_factory):
    """Return the infinite elements below it."""
    return coupled_model(case, tmp_path_factory.mktemp('cache')).soil_models[0]


@pytest.fixture(scope='module')
def figures(case, infinite):
    """Return the three figures by name."""
    return {figure.name: figure for figure in paper_figures(case, infinite)}


def test_figure_6_is_equations_9_and_10(case, figures):
    columns = figures['figure_6'].columns
    omega = 2.0 * np.pi * columns['frequency_hz']
    height, mass = case.rotor.shaft_height, 11.0 * PEDESTALS
    compliance = ConeModel(case.soil, case.foundations[0].contact).compliance(omega)
    s_uu = 1.0 / compliance[:, 0, 0] - omega**2 * mass
    s_pp = 1.0 / compliance[:, 4, 4] - omega**2 * (10.0 * PEDESTALS / 12.0 + 0.939)
    np.testing.assert_allclose(columns['k_zz cone mf/ms 10 [N/m]'],
                               1.0 / compliance[:, 2, 2] - omega**2 * mass, rtol=1e-9)
    np.testing.assert_allclose(columns['k_xx cone mf/ms 10 [N/m]'],
                               s_uu * s_pp / (s_pp + s_uu * height**2), rtol=1e-9)


def test_figure_8_is_the_static_deflection_at_low_frequency(figures):
    columns = figures['figure_8'].columns
    low = {name.split()[1]: values[0].real for name, values in columns.items() if '[m/N]' in name}
    # Soil gives way where rigid ground does not; both methods by nearly the same.
    assert low['rigid'] < low['cone'] < low['infinite'] * 1.01
    assert low['cone'] - low['rigid'] == pytest.approx(low['infinite'] - low['rigid'], rel=0.10)


def test_figure_9_has_no_peak_on_soil_as_high_as_on_rigid_ground(figures):
    numbers = {name: value for name, value, _ in peak_numbers(figures['figure_9'])}
    rigid = numbers['figure_9: peak below 100 Hz of disc_1_x rigid']
    soil = [value for name, value in numbers.items()
            if 'below 100 Hz' in name and 'mf/m' in name and not name.endswith('where')]
    assert len(soil) == 6
    assert max(soil) < 1e-3 * rigid


def test_figure_9_is_drawn_to_the_scale_of_the_soil(figures):
    numbers = {name: value for name, value, _ in peak_numbers(figures['figure_9'])}
    soil = max(value for name, value in numbers.items()
               if 'mf/m' in name and not name.endswith('where'))
    _, top = figures['figure_9'].figure.axes[0].get_ylim()
    assert soil < top < 10.0 * soil
    assert top < 1e-3 * numbers['figure_9: peak below 100 Hz of disc_1_x rigid']


def test_page_quotes_what_is_computed(case, infinite, figures):
    page = (ROOT / 'docs' / 'paper.md').read_text(encoding='utf-8')
    numbers = {name: value for name, value, _ in claim_numbers(case, infinite)}
    for name in ('figure_8', 'figure_9'):
        numbers |= {name: value for name, value, _ in peak_numbers(figures[name])}
    vertical = [numbers[f'a0 = {a0}: cone over infinite elements, real part of the stiffness z']
                for a0 in ('0.1', '0.5', '1', '2.5')]
    quoted = re.search(r'elements: ([\d.]+) at a0 = 0.1, ([\d.]+) at 0.5, ([\d.]+) at 1, '
                       r'([\d.]+) at 2.5', page)
    assert [f'{value:.2f}' for value in vertical] == list(quoted.groups())
    for name, digits in (('figure_9: peak below 100 Hz of disc_1_x mf/m 100 cone', '0.88'),
                         ('figure_9: peak below 100 Hz of disc_1_x mf/m 1 infinite elements',
                          '1.23')):
        assert f'{numbers[name]:.2f}' == digits
        assert digits in page
    assert f'{numbers["speed at a0 = 0.1"]:.0f} to {numbers["speed at a0 = 2.5"]:.0f} rpm' in page
