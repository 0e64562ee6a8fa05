"""The shipped foundations are what their script makes, and they bend as they should."""

from pathlib import Path

import build
import numpy as np
import pytest
import scipy.io

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.figures.bending import bending_figure

HERE = Path(__file__).parent


def test_files_are_those_that_the_script_makes(tmp_path):
    build.write_frame(tmp_path)
    for name in 'KM':
        made, shipped = (scipy.io.mmread(folder / f'frame_{name}.mtx').tocsc()
                         for folder in (tmp_path, HERE))
        assert abs(made - shipped).max() < 1e-9 * abs(shipped).max()
    assert (tmp_path / 'frame_dofs.csv').read_text() == (HERE / 'frame_dofs.csv').read_text()
    body = build.raft()
    with (HERE / 'raft_modes.csv').open() as stream:
        hertz = np.array(stream.readlines()[1].split(',')[1:], dtype=float)
    np.testing.assert_allclose(np.sqrt(body.stiffness) / build.TURN, hertz, rtol=1e-8)
    # A slab of 12 x 4 x 1 m by finer bricks: 24.7 Hz.
    assert hertz[0] == pytest.approx(24.7, rel=0.01)


def test_a_column_of_the_frame_is_a_cantilever_of_the_textbook():
    spring, _ = build._beam(np.array([0.0, 0.0, 4.0]), 0.6, 0.6)
    shear, area, second = build.CONCRETE / 2.4 * 5.0 / 6.0, 0.36, 0.6**4 / 12.0
    exact = 4.0**3 / (3.0 * build.CONCRETE * second) + 4.0 / (shear * area)
    assert np.linalg.inv(spring[6:, 6:])[0, 0] == pytest.approx(exact, rel=1e-9)


@pytest.mark.parametrize('file, settings', [
    ('turbine_deck.yaml', ['speed_range_rpm=[300, 900]']),
    ('raft_house.yaml', ['source=fan_1', 'speed_range_rpm=[300, 1500]'])])
def test_example_bends_where_a_rigid_body_would_not(file, settings, tmp_path):
    machine = Machine.load(HERE / file, cache_directory=tmp_path, overrides=settings)
    support = machine.model.support
    body = machine.model.foundations[0].body
    speed = np.array([machine.case.speed_range[1]])
    stiff = body.stiffer(1e6)
    seats = [support.standing(speed).receptance[0], type(support)(
        support.bearings, support.shaft_height,
        [one if one.body is None else type(one)(**{
            name: getattr(one, name) for name in one.__slots__} | {'body': stiff})
         for one in support.foundations], support.soil_models, support.place,
        support.burden).standing(speed).receptance[0]]
    assert np.abs(seats[0] - seats[1]).max() > 0.05 * np.abs(seats[0]).max()
    assert len(bending_figure(machine.case, machine.model).axes) >= 1
