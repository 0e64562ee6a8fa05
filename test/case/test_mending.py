"""All that is wrong with a case is told in one run, and nothing else."""

from copy import deepcopy
from pathlib import Path
import random

import pytest

from rotorsoil_ros.case import document
from rotorsoil_ros.case.config import case_of
from rotorsoil_ros.case.entries.stand_in import hints, StandIns
from rotorsoil_ros.case.schema import FoundationEntry
from rotorsoil_ros.errors import InputError

CONFIG = Path(__file__).parents[2] / 'config'
GONE = object()


def put(place, value):
    """Return a breakage: what stands at a place of the document becomes another."""
    def broken(content):
        *above, last = [int(step) if step.isdigit() else step for step in place.split('.')]
        for step in above:
            content = content.setdefault(step, {}) if isinstance(content, dict) else (
                content[step])
        if value is GONE:
            del content[last]
        else:
            content[last] = value
    return broken


def renamed(place, old, new):
    """Return a breakage: a key is misspelled."""
    def broken(content):
        for step in place.split('.'):
            content = content[int(step) if step.isdigit() else step]
        content[new] = content.pop(old)
    return broken


# Each breaks something else, and none hangs on another one.
FAN = [
    (put('name', 'Plant Fan'), 'name: must be a name of at most 64 small letters, digits and _, '
                               "first a letter, got 'Plant Fan'"),
    (put('soil.poisson_ratio', 0.5), 'soil.poisson_ratio: must be in [0, 0.5), of undrained '
                                     '(saturated) soil 0.49, got 0.5'),
    (put('soil.density', '1.9 m'), "soil.density: must be a finite number in kg/m^3, got '1.9 m', "
                                   'which is none of that'),
    (put('soil.shear_wave_velocity', 230.0), 'soil: needs either shear_modulus in Pa or '
                                             'shear_wave_velocity in m/s, got both'),
    (put('soil.loss_factor', 1.5), 'soil.loss_factor: must be in [0, 1), got 1.5'),
    (renamed('support', 'geometry', 'geometri'),
     'support.geometri: is not a known key; did you mean geometry?'),
    (put('support.file', 'k.csv'),
     'support.file: belongs to the support model table or receptance, got cone'),
    (put('foundations.0.half_width', -1.0),
     'foundations.0.half_width: must be > 0 m and finite, got -1'),
    (put('foundations.0.mass', -5.0), 'foundations.0.mass: must be >= 0 kg and finite, got -5'),
    (put('foundations.0.height', 0.0), 'foundations.0.height: must be > 0 m and finite, got 0'),
    (put('foundations.0.embedment', -0.5),
     'foundations.0.embedment: must be >= 0 m and finite, got -0.5'),
    (put('foundations.0.inertia', [1.0, 'two', 3.0]),
     "foundations.0.inertia.1: must be a finite number in kg m^2, got 'two'"),
    (put('rotor.shaft_height', 'high'),
     "rotor.shaft_height: must be a finite number in m, got 'high'"),
    (put('rotor.material.density', -7850.0),
     'rotor.material.density: must be >= 0 kg/m^3 and finite, got -7850'),
    (put('rotor.material.poisson_ratio', 0.7),
     'rotor.material.poisson_ratio: must be in (-1, 0.5], got 0.7'),
    (put('rotor.shaft.2.elements', 0), 'rotor.shaft.2.elements: must be at least 1, got 0'),
    (put('rotor.shaft.3.inner_diameter', 0.2),
     'rotor.shaft.3.inner_diameter: must be >= 0 m and less than the outer diameter 0.18 m, got '
     '0.2'),
    (renamed('rotor.shaft.4', 'outer_diameter', 'outer_diametr'),
     'rotor.shaft.4.outer_diametr: is not a known key; did you mean outer_diameter?'),
    (put('rotor.discs.0.position', 17.0), 'rotor.discs.0.position: position of coupling must be '
                                          'on the shaft, 0 to 1.7 m, got 17'),
    (put('rotor.discs.1.polar_inertia', GONE), 'rotor.discs.1.polar_inertia: is missing'),
    (put('rotor.discs.1.mass', -3.0), 'rotor.discs.1.mass: must be >= 0 kg and finite, got -3'),
    (put('rotor.bearings.0.stiffness.xx', '2.5e8'),
     "rotor.bearings.0.stiffness.xx: must be a finite number in N/m, got '2.5e8'"),
    (put('rotor.bearings.0.damping.qq', 1.0),
     'rotor.bearings.0.damping.qq: is not a known key; known here: xx, xz, zx, zz'),
    (put('rotor.bearings.1.position', -0.5), 'rotor.bearings.1.position: position of fan_end must '
                                             'be on the shaft, 0 to 1.7 m, got -0.5'),
    (put('rotor.bearings.1.foundation', 'blok'),
     'rotor.bearings.1.foundation: must be one of block, got blok'),
    (put('rotor.bearings.1.damping', GONE), 'rotor.bearings.1.damping: is missing'),
    (put('rotor.probes', [{'name': 'drive_end', 'position': 0.5}]),
     'rotor.probes.0.name: must differ from that of rotor.bearings.0, got drive_end twice'),
    (put('rotor.oil_temperatures', [40.0]), 'rotor.oil_temperatures: belongs to a rotor with a '
                                            'journal whose oil is given by grade and temperature'),
    (put('unbalances.0.disc', 'weel'),
     'unbalances.0.disc: must be one of coupling, wheel, got weel'),
    (put('unbalances.0.share', 0.5), 'unbalances.0.share: belongs to a grade, which is missing'),
    (put('unbalances.0.phase', True), 'unbalances.0.phase: must be a finite number in rad, got '
                                      'True'),
    (put('speed_range_rpm', [1800, 100]),
     'speed_range_rpm: must be two rising speeds >= 0 rpm, got [1800, 100]'),
    (put('uncertainty.shear_modulus_factor', 0.5),
     'uncertainty.shear_modulus_factor: must be >= 1 and finite, got 0.5'),
    (put('uncertainty.poisson_ration', 0.1),
     'uncertainty.poisson_ration: is not a known key; did you mean poisson_ratio?'),
    (put('zones.rigid', [1e-3, 2e-3, 3e-3]), 'zones: needs label, rigid and flexible together'),
    (put('zones.baseline', -1.0), 'zones.baseline: must be > 0 m/s and finite, got -1'),
    (put('sensors.range', 0.0), 'sensors.range: must be > 0 m/s^2, got 0'),
    (put('sensors.channels', {'fan_end_housing_y': {}}),
     'sensors.channels.fan_end_housing_y: is not a channel of this machine; did you mean '
     'fan_end_housing_z?'),
    (put('ground.probes', [{'name': 'beside', 'place': {'x': 3.0, 'y': 0.0}}]),
     'ground.probes: need the support model boundary_elements, which alone tells the motion of '
     'the ground beside the blocks, got cone'),
]


# Two blocks on layers, a journal, a table, a pedestal: what the fan has not.
TURBINE = """
name: turbine
soil:
  layers:
    - {thickness: 2.0, shear_modulus: 6.0e7, poisson_ratio: 0.3, density: 1900, loss_factor: 0.06}
    - {thickness: 3.0, shear_wave_velocity: 300, poisson_ratio: 0.3, density: 2000,
       loss_factor: 0.06}
  below: rock
support: {model: thin_layers}
foundations:
  - {name: front, radius: 1.0, height: 1.0, density: 2400, embedment: 0.5, side_contact: 0.5}
  - {name: back, half_width: 1.0, half_length: 1.0, height: 1.0, density: 2400}
rotor:
  shaft_height: 2.0
  material: steel
  shaft: [{length: 3.0, outer_diameter: 0.2, elements: 12}]
  discs: [{name: wheel, position: 1.5, outer_diameter: 0.8, width: 0.1, density: 7850}]
  bearings:
    - name: oil
      position: 0.2
      foundation: front
      journal: {type: tilting_pad, pads: 4, arc_deg: 80, diameter: 0.2, length: 0.1,
                radial_clearance: 1.6e-4, oil: {grade: VG46, temperature: 45}}
    - name: ball
      position: 2.8
      foundation: back
      stiffness: {speed_rpm: [0, 6000], xx: [1.0e8, 2.0e8], zz: [1.0e8, 2.0e8]}
      damping: {xx: 1.0e4, zz: 1.0e4}
      pedestal: {mass: 50, stiffness: {xx: 5.0e8, zz: 5.0e8}, damping: {xx: 1.0e3, zz: 1.0e3}}
unbalances: [{disc: wheel, grade: G2.5, rated_speed_rpm: 3000}]
speed_range_rpm: [100, 3600]
"""
ON_LAYERS = [
    (put('soil.layers.0.thickness', -2.0),
     'soil.layers.0.thickness: must be > 0 m and finite, got -2'),
    (put('soil.layers.1.shear_modulus', 1e8), 'soil.layers.1: needs either shear_modulus in Pa or '
                                              'shear_wave_velocity in m/s, got both'),
    (put('soil.below', 'rocks'), "soil.below: must be 'rock', got 'rocks'; did you mean rock?"),
    (put('support.model', 'thin_layer'),
     "support.model: must be 'rigid', 'cone', 'infinite_elements', 'boundary_elements', "
     "'thin_layers', 'table' or 'receptance', got 'thin_layer'; did you mean thin_layers?"),
    (put('foundations.0.half_width', 1.0),
     'foundations.0: needs either half_width and half_length, or parts, or radius, in m'),
    (put('foundations.0.side_contact', 1.5),
     'foundations.0.side_contact: must be in [0, 1], the share of the embedment that is welded, '
     'got 1.5'),
    (put('foundations.1.mass', 5000.0), 'foundations.1.mass: needs a value in kg, or density in '
                                        'kg/m^3 and height in m, got both'),
    (put('rotor.material', 'stele'),
     "rotor.material: must be 'steel', 'stainless_steel', 'cast_iron' or 'aluminium', got "
     "'stele'; did you mean steel?"),
    (put('rotor.discs.0.mass', 100.0),
     'rotor.discs.0: needs either mass, diametral_inertia and polar_inertia or outer_diameter, '
     'width and density, got density, mass, outer_diameter, width'),
    (put('rotor.bearings.0.journal.groove_deg', 20.0),
     'rotor.bearings.0.journal.groove_deg: belongs to the type plain, got tilting_pad'),
    (put('rotor.bearings.0.journal.viscosity', 0.02),
     'rotor.bearings.0.journal.viscosity: needs a value in Pa s, or oil its grade; got both'),
    (put('rotor.bearings.0.journal.least_film', 0.0),
     'rotor.bearings.0.journal.least_film: must be > 0 m and finite, got 0'),
    (put('rotor.bearings.1.stiffness.zz', [1e8]), 'rotor.bearings.1.stiffness.zz: must have as '
                                                  'many entries as speed_rpm, 2, got 1'),
    (put('rotor.bearings.1.pedestal.mass', -1.0),
     'rotor.bearings.1.pedestal.mass: must be >= 0 kg and finite, got -1'),
    (put('unbalances.0.share', 2.0), 'unbalances.0.share: must be in (0, 1], got 2'),
    (put('unbalances.0.grade', '2.5'), 'unbalances.0.grade: must be a balance grade in mm/s with '
                                       "its G, as in G6.3, got '2.5'"),
    (put('speed_range_rpm', [100]), 'speed_range_rpm.1: is missing'),
    (put('uncertainty', {'rock_depth': [0.4, 3.0]}), 'uncertainty.rock_depth: must begin below '
     'the base of front (foundations.0), 0.5 m, got 0.4 m'),
    (put('sensors', {'channels': {'weel_x': {}}}),
     'sensors.channels.weel_x: is not a channel of this machine; did you mean wheel_x?'),
]
CASES = [(document.read(CONFIG / 'plant_fan.yaml'), FAN),
         (document.parse(TURBINE, source='turbine'), ON_LAYERS)]
EACH = [(content, *one) for content, breakages in CASES for one in breakages]


def faults_of(content, breakages, tmp_path, file='case.yaml'):
    """Return what is wrong with a broken document, a line each."""
    content = deepcopy(content)
    for breakage in breakages:
        breakage(content)
    with pytest.raises(InputError) as caught:
        case_of(Path(file), content, cache_directory=tmp_path)
    return [line.removeprefix(f'{file}: ') for line in str(caught.value).splitlines()]


@pytest.mark.parametrize('content, breakage, line', EACH, ids=[line[:40] for *_, line in EACH])
def test_each_alone_is_one_line(tmp_path, content, breakage, line):
    assert faults_of(content, [breakage], tmp_path) == [line]


@pytest.mark.parametrize('seed', range(12))
@pytest.mark.parametrize('content, breakages', CASES, ids=lambda value: len(value))
def test_all_are_told_in_one_run_and_no_other(tmp_path, content, breakages, seed):
    chosen = random.Random(seed).sample(breakages, 2 + seed % 9)
    assert sorted(faults_of(content, [breakage for breakage, _ in chosen], tmp_path)) == sorted(
        line for _, line in chosen)


@pytest.mark.parametrize('content, breakages', CASES, ids=lambda value: len(value))
def test_everything_is_told_at_once(tmp_path, content, breakages):
    assert sorted(faults_of(content, [breakage for breakage, _ in breakages], tmp_path)) == sorted(
        line for _, line in breakages)


def test_machines_on_one_block_tell_all_at_once_though_their_rotors_lie_elsewhere(tmp_path):
    file = CONFIG / 'fan_house.yaml'
    broken = [
        (put('source', 'fan_1'), None),
        (put('soil.poisson_ratio', 0.5), 'soil.poisson_ratio: must be in [0, 0.5), of undrained '
                                         '(saturated) soil 0.49, got 0.5'),
        (put('foundations.0.mass', -1.0),
         'foundations.0.mass: must be >= 0 kg and finite, got -1'),
        (put('machines.0.place.x', 'left'),
         "machines.0.place.x: must be a finite number in m, got 'left'"),
        (put('machines.1.unbalances.0.disc', 'weel'),
         'machines.1.unbalances.0.disc: must be one of coupling, wheel, got weel')]
    told = faults_of(document.read(file), [breakage for breakage, _ in broken], tmp_path, file)
    assert sorted(told) == sorted(line for _, line in broken if line)


def places(content, above=()):
    """Yield every place of a document."""
    steps = content.items() if isinstance(content, dict) else enumerate(content)
    for step, value in steps:
        yield (*above, step)
        if isinstance(value, (dict, list)):
            yield from places(value, (*above, step))


PLACES = [(content, '.'.join(map(str, place))) for content, _ in CASES
          for place in places(content)]


@pytest.mark.parametrize('content, place', PLACES, ids=[place for _, place in PLACES])
def test_what_hangs_on_a_fault_is_not_told(tmp_path, content, place):
    lines = faults_of(content, [put(place, [[True]])], tmp_path)
    assert all(line.startswith(place) for line in lines), lines


@pytest.mark.parametrize('settings, lines', [
    # A shorter shaft may end before the bearing, a longer one may not.
    ([put('rotor.shaft.2.length', 'long'), put('rotor.bearings.1.position', 3.0)],
     ["rotor.shaft.2.length: must be a finite number in m, got 'long'"]),
    # Whoever names the wheel may mean the disc that has no proper name.
    ([put('rotor.discs.1.name', 'Wheel')], ['rotor.discs.1.name: must be a name of at most 64 '
     "small letters, digits and _, first a letter, got 'Wheel'"]),
    ([put('foundations.0.name', 'Block')], ['foundations.0.name: must be a name of at most 64 '
     "small letters, digits and _, first a letter, got 'Block'"]),
    ([put('rotor.discs.1.name', 'Wheel'), put('sensors.channels', {'wheel_x': {}})],
     ['rotor.discs.1.name: must be a name of at most 64 small letters, digits and _, first a '
      "letter, got 'Wheel'"])])
def test_nothing_is_told_that_goes_with_another_fault(tmp_path, settings, lines):
    assert faults_of(CASES[0][0], settings, tmp_path) == lines


def test_a_name_put_in_the_place_of_another_is_nobody_elses():
    """The wheel that unbalances name is there: what stands in for a block is not called so."""
    name = hints(FoundationEntry)['name']
    assert not {StandIns(CASES[0][0], draw).of(name, ('foundations', 1, 'name'))
                for draw in range(32)} & {'wheel', 'block', 'plant_fan', 'drive_end'}
