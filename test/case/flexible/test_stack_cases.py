"""Foundations on foundations in a case file: read, answered, and refused with one line each."""

from boxes import elements, ON_FOUR, RAFT, truss
from flexible_cases import FAN, loaded, STIFF
import numpy as np
import pytest
import scipy.io
import yaml

from rotorsoil_ros.case.summary import derived_quantities
from rotorsoil_ros.channel import DOFS
from rotorsoil_ros.cli import main
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.figures.bending import bending_figure
from rotorsoil_ros.machine.flexible.body import CONTACT, SEAT

ROTOR = {**FAN['rotor'], 'shaft_height': 2.4, 'bearings': [
    {'name': 'b1', 'position': 0.0, 'foundation': 'frame', **STIFF},
    {'name': 'b2', 'position': 1.4, 'foundation': 'frame', **STIFF}]}


def files(name, loss):
    """Return the entry of a body out of the files of a box."""
    return {'stiffness': f'rods_{name}_K.mtx', 'mass': f'rods_{name}_M.mtx',
            'dofs': f'rods_{name}_dofs.csv', 'loss_factor': loss}


STACK = {
    **FAN, 'name': 'stack', 'rotor': ROTOR, 'support': {'model': 'cone'},
    'soil': {'shear_modulus': 1e8, 'poisson_ratio': 0.3, 'density': 1900.0, 'loss_factor': 0.05},
    'foundations': [
        {'name': 'raft', 'flexible': files('raft', 0.04), 'soil_under': 'each', 'centre_x': 1.0,
         'centre_y': 0.7},
        {'name': 'frame', 'flexible': files('frame', 0.01),
         'on': {'foundation': 'raft', 'place': 'pad'}}]}


def written(folder, name, asked, **size):
    """Write a box of rods as matrices with a table of motions."""
    found, nodes = elements(name.partition('_')[0], asked), truss(name, **size)[0]
    for letter, matrix in (('K', found.stiffness), ('M', found.mass)):
        scipy.io.mmwrite(folder / f'rods_{name}_{letter}.mtx', matrix, precision=16,
                         symmetry='symmetric')
    lines = ['index,name,kind,x,y,z,direction,area']
    for station, kind, own, axes in asked:
        for node in own:
            place = ','.join(map(repr, nodes[node].tolist()))
            lines += [f'{3 * node + 1 + DOFS.index(axis.replace("xyz", "x"))},{station},{kind},'
                      f'{place},{axis},0.25' for axis in (axes if len(own) == 1 else ['xyz'])]
    (folder / f'rods_{name}_dofs.csv').write_text('\n'.join(lines))


SEATS = [('b1', SEAT, [4], ('x', 'z')), ('b2', SEAT, [5], ('x', 'z'))]


@pytest.fixture(scope='module')
def stacked(folder):
    """Return the folder with boxes of rods by their matrices and the cases of them."""
    written(folder, 'raft', RAFT, height=0.8, spring=4e8)
    written(folder, 'frame', [*SEATS, ('base', CONTACT, [0, 1, 2, 3], DOFS)], height=1.6,
            spring=1.5e8)
    written(folder, 'frame_4', [*SEATS, *ON_FOUR[2:]], height=1.6, spring=1.5e8)
    (folder / 'stack.yaml').write_text(yaml.safe_dump(STACK))
    legs = {'places': {f'leg_{one}': f'top_{one}' for one in range(4)}, 'foundation': 'raft'}
    (folder / 'legs.yaml').write_text(yaml.safe_dump(STACK | {'foundations': [
        STACK['foundations'][0],
        {'name': 'frame', 'flexible': files('frame_4', 0.01), 'on': legs}]}))
    block = {'name': 'raft', 'half_width': 1.5, 'half_length': 1.2, 'height': 0.8,
             'density': 2400.0, 'centre_x': 1.0, 'centre_y': 0.7}
    (folder / 'mat.yaml').write_text(yaml.safe_dump(STACK | {'foundations': [
        {'name': 'frame', 'flexible': files('frame_4', 0.01), 'on': {'foundation': 'raft'}},
        block]}))
    pedestal = {'name': 'frame', 'half_width': 0.4, 'half_length': 0.5, 'height': 1.0,
                'density': 2400.0, 'on': {'foundation': 'raft', 'place': 'pad'}}
    (folder / 'pedestal.yaml').write_text(yaml.safe_dump(STACK | {'foundations': [
        STACK['foundations'][0], pedestal]}))
    return folder


def test_places_say_where_everything_stands(stacked):
    stack, legs = (loaded(stacked, name).case.foundations for name in ('stack', 'legs'))
    for blocks in (stack, legs):
        assert (blocks[1].centre_x, blocks[1].centre_y) == pytest.approx((1.0, 0.7))
        assert blocks[1].elevation == pytest.approx(0.8)
    assert legs[1].on.places == ('top_0', 'top_1', 'top_2', 'top_3')
    mat = loaded(stacked, 'mat').case.foundations
    assert mat[0].on.places == ()
    assert mat[0].elevation == 0.8
    # The frame's seats are on the shaft, whichever way it got there.
    assert (mat[0].centre_x, mat[0].centre_y) == pytest.approx((1.0, 0.7))


@pytest.mark.parametrize('name', ['stack', 'legs', 'mat', 'pedestal'])
def test_answers_of_a_case_hold_together(stacked, name):
    machine = loaded(stacked, name)
    found = machine.seat_receptance(hz=[0.5, 11.0, 24.0])
    assert np.abs(found - found.swapaxes(1, 2)).max() < 1e-12 * np.abs(found).max()
    assert np.linalg.eigvalsh(-found.imag).min() > 0.0
    still = machine.transmissibility(hz=[0.01])
    np.testing.assert_allclose(still['b1_housing_x'].ratio[0, 0], [1.0, 0.0, 0.0], atol=1e-4)
    split = machine.damping_split(rpm=900.0)
    assert split.total[0] > 0.0
    soils = [part for kind, part in split.parts if kind in ('radiation', 'soil material')]
    assert set(soils) == {'raft'}


def test_check_tells_what_stands_where(stacked, capsys):
    machine = loaded(stacked, 'legs')
    told = dict(derived_quantities(machine.case, machine.model.soil_models))
    assert told['frame: stands on'] == 'raft at top_0, top_1, top_2, top_3, 0.8 m up'
    assert main(['check', str(stacked / 'mat.yaml')]) == 0
    said = capsys.readouterr()
    assert 'raft, 0.8 m up' in said.out
    assert 'taken as alone on the ground' not in said.err


def test_the_band_of_a_stack_is_that_of_its_soil_and_bodies(stacked):
    machine = loaded(stacked, 'pedestal', 'uncertainty={foundation_stiffness_factor: 1.3, '
                     'samples: 5}', 'speed_range_rpm=[800, 1000]')
    bounds = machine.band(rpm=[900.0])
    assert np.all(bounds.low <= bounds.nominal)
    assert bounds['b1_housing_x'].low[0, 0] < bounds['b1_housing_x'].high[0, 0]


def test_both_bodies_are_drawn_where_they_are(stacked):
    machine = loaded(stacked, 'legs')
    figure = bending_figure(machine.case, machine.model)
    heights = [max(float(np.max(line.get_data_3d()[2])) for line in axes.lines)
               for axes in figure.axes]
    # Of the raft in the first row its top; of the frame in the last the shaft's height and more.
    assert min(heights) == pytest.approx(0.8, abs=0.4)
    assert max(heights) == pytest.approx(2.4, abs=0.6)


def test_a_table_of_the_stack_is_the_stack(stacked):
    machine = loaded(stacked, 'legs')
    assert main(['seats', str(stacked / 'legs.yaml'), '--hz', '2:60:117', '-o',
                 str(stacked / 'legs_seats.csv')]) == 0
    rotor = {**ROTOR, 'bearings': [{key: value for key, value in one.items()
                                    if key != 'foundation'} for one in ROTOR['bearings']]}
    (stacked / 'legs_table.yaml').write_text(yaml.safe_dump(STACK | {
        'foundations': [], 'rotor': rotor,
        'support': {'model': 'receptance', 'file': 'legs_seats.csv'}}))
    rpm = np.linspace(300.0, 1800.0, 40)
    one, two = (made.response(rpm=rpm)['wheel_x'].displacement
                for made in (machine, loaded(stacked, 'legs_table')))
    assert np.abs(two - one).max() < 1e-5 * np.abs(one).max()


@pytest.mark.parametrize('name, settings, said', [
    ('stack', ['foundations.1.on.foundation=nothing'],
     'foundations.1.on.foundation: must be one of raft, got nothing'),
    ('stack', ['foundations.1.on.foundation=frame'],
     'foundations.1.on.foundation: must be one of raft, got frame'),
    ('mat', ['foundations.1.on={foundation: frame}'],
     'foundations.0.on.foundation: goes round in a circle: frame on raft on frame'),
    ('stack', ['foundations.1.on.place=nowhere'],
     'foundations.1.on.place: must be one of patch_0, patch_1, patch_2, patch_3, top_0'),
    ('stack', ['foundations.1.on.place=top_1'],
     'foundations.1.on.place: must move along rx, top_1 has x, y, z'),
    ('pedestal', ['foundations.1.on.place=top_1'],
     'foundations.1.on.place: must move along rx, top_1 has x, y, z'),
    ('stack', ['foundations.1.on={foundation: raft}'],
     'foundations.1.on: needs either place, of one contact, or places, one for each of several, '
     'got neither'),
    ('legs', ['foundations.1.on={foundation: raft, place: pad}'],
     'foundations.1.on.place: belongs to one contact; places must name one for each of leg_0, '
     'leg_1, leg_2, leg_3'),
    ('legs', ['foundations.1.on.places={leg_0: top_0}'],
     'foundations.1.on.places: must name one for each of leg_0, leg_1, leg_2, leg_3, got leg_0'),
    ('legs', ['foundations.1.on.places.leg_3=top_2'],
     'foundations.1.on.places: must differ, got top_2 twice'),
    ('legs', ['foundations.1.on.places.leg_3=top_2', 'foundations.1.on.places.leg_2=top_3'],
     'foundations.1.on.places: must lie to each other as the contacts do within 0.02 m, got'),
    ('mat', ['foundations.0.on.place=pad'],
     'foundations.0.on.place: belongs to a foundation that bends, and raft is a block'),
    ('mat', ['foundations.1.height=null', 'foundations.1.density=null', 'foundations.1.mass=7000',
             'foundations.1.centre_of_gravity_height=0.4', 'foundations.1.inertia=[4e3,4e3,6e3]'],
     'foundations.0.on.foundation: needs the height of raft in m, on whose top frame stands'),
    ('mat', ['foundations.1.centre_y=null'],
     'foundations.1.centre_y: is missing: no bearing stands on raft'),
    ('stack', ['foundations.1.soil_under=each'],
     'foundations.1.soil_under: belongs to the ground, and frame stands on raft'),
    ('pedestal', ['foundations.1.embedment=0.3'],
     'foundations.1.embedment: belongs to the ground, and frame stands on raft'),
    ('stack', ['foundations.1.centre_x=0.5'],
     'foundations.1.centre_x: must be where its place is, 1 m, or be left out, got 0.5'),
    ('stack', ['rotor.shaft_height=2.5'],
     'rotor.bearings.0.seat: must be on the shaft within 0.02 m, got 0 m across, 0 m along and '
     '0.1 m up from b1 to the bearing'),
])
def test_bad_input_is_told_in_one_line(stacked, name, settings, said):
    with pytest.raises(InputError) as error:
        loaded(stacked, name, *settings)
    told = str(error.value).splitlines()
    assert any(said in line for line in told), told
    assert len(told) == 1, told


def test_two_on_one_place_are_told(stacked):
    second = {'name': 'other', 'half_width': 0.2, 'half_length': 0.2, 'height': 0.5,
              'density': 2400.0, 'on': {'foundation': 'raft', 'place': 'pad'}}
    content = yaml.safe_load((stacked / 'stack.yaml').read_text())
    content['foundations'].append(second)
    (stacked / 'twice.yaml').write_text(yaml.safe_dump(content))
    with pytest.raises(InputError, match=r'foundations\.2\.on\.place: must be free, and pad '
                                         r'carries frame \(foundations\.1\)'):
        loaded(stacked, 'twice')
