"""The shipped foundations are what their script makes, and they bend as they should."""

from dataclasses import replace
from pathlib import Path
import re
import shlex
import shutil

import build
from matplotlib.patches import Rectangle as Box
import numpy as np
import pytest
import scipy.io

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.berth import mounts
from rotorsoil_ros.cli import main
from rotorsoil_ros.figures.bending import bending_figure
from rotorsoil_ros.figures.drawing import machine_drawing
from rotorsoil_ros.machine.flexible.lattice import Lattice

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


@pytest.mark.parametrize('file, settings, joined', [
    # Columns and beams, and the bearings on the two of these that run across.
    ('turbine_deck.yaml', [], [('footing', 'corner')] * 4 + [('corner', 'corner')] * 4
     + [('bearing', 'corner')] * 4),
    # Probes on its top tell how it heaves there, not how it lies.
    ('raft_house.yaml', ['source=fan_1'], [('patch', 'patch')] * 16
     + [('fan_1', 'patch')] * 2 + [('fan_2', 'patch')] * 2)])
def test_seats_stand_on_a_body_of_what_tells_how_it_lies(file, settings, joined):
    case = load(HERE / file, overrides=settings)
    [block] = case.foundations
    drawn = Lattice.whole(block, mounts(case))
    kinds = [name.rpartition('_')[0].removesuffix('_drive').removesuffix('_fan')
             for name in drawn.named]
    assert [(kinds[one], kinds[other]) for one, other in drawn.edges.tolist()
            if max(one, other) < len(kinds)] == joined


@pytest.mark.parametrize('file, settings', [
    ('turbine_deck.yaml', ['speed_range_rpm=[300, 900]']),
    ('turbine_mat.yaml', ['speed_range_rpm=[300, 900]']),
    ('raft_house.yaml', ['source=fan_1', 'speed_range_rpm=[300, 1500]'])])
def test_example_bends_where_a_rigid_body_would_not(file, settings, tmp_path):
    machine = Machine.load(HERE / file, cache_directory=tmp_path, overrides=settings)
    support = machine.model.support
    speed = np.array([machine.case.speed_range[1]])
    stiff = replace(support, foundations=[
        block if block.body is None else replace(block, body=block.body.stiffer(1e6))
        for block in machine.model.foundations])
    seats = [one.standing(speed).receptance[0] for one in (support, stiff)]
    assert np.abs(seats[0] - seats[1]).max() > 0.05 * np.abs(seats[0]).max()
    assert len(bending_figure(machine.case, machine.model).axes) >= 1


def test_a_frame_is_drawn_on_its_legs_and_a_raft_as_a_slab():
    for file, source, slab in (('turbine_deck.yaml', [], None), (
            'raft_house.yaml', ['source=fan_1'], 1.0)):
        side = machine_drawing(load(HERE / file, source)).axes[0]
        boxes = [patch.get_height() for patch in side.patches
                 if isinstance(patch, Box) and patch.get_y() == 0.0]
        assert boxes == [slab] * (slab is not None)
        legs = [line for line in side.get_lines() if line.get_xydata()[:, 1].tolist() == [4.0, 0.0]
                or line.get_xydata()[:, 1].tolist() == [0.0, 4.0]]
        assert len(legs) == (0 if slab else 4)


def test_commands_of_the_readme_run_and_print_what_is_shown(tmp_path, monkeypatch, capsys):
    for file in HERE.glob('*.[cmy][sta][vxm]*'):
        shutil.copy(file, tmp_path)
    # The fans are those of the shipped case.
    house = (tmp_path / 'raft_house.yaml').read_text()
    shipped = HERE.parents[1] / 'config' / 'plant_fan.yaml'
    (tmp_path / 'raft_house.yaml').write_text(house.replace('../../config/plant_fan.yaml',
                                                            str(shipped)))
    monkeypatch.chdir(tmp_path)
    [block] = re.findall(r'```console\n(.*?)```', (HERE / 'README.md').read_text(), re.DOTALL)
    for example in block.split('$ ')[1:]:
        command, *expected = example.strip().splitlines()
        program, *arguments = shlex.split(command)
        assert (program, main(arguments)) == ('rotorsoil', 0), command
        said = capsys.readouterr().out
        assert all(line in said for line in expected), command
    header = (tmp_path / 'raft_seats.csv').read_text().partition('\n')[0]
    assert 'fan_1_drive_end_x__fan_2_fan_end_z_re' in header
