"""Sensors on the ground in a case: where they stand, what is known of them, what is refused."""

import math

import pytest

import rotorsoil_ros as rs
from rotorsoil_ros.case.entries.sensors import Pickup
from rotorsoil_ros.case.summary import derived_quantities, warnings
from rotorsoil_ros.figures.site import site_plan

FAN = 'config/plant_fan.yaml'
HOUSE = 'config/fan_house.yaml'
YARD = {'name': 'yard', 'place': {'x': 8.0, 'y': 0.2}}


def fan(*sensors, **keys):
    """Return the plant fan with sensors on its ground."""
    return rs.load(FAN, ground={'sensors': list(sensors)} | keys.pop('ground', {}), **keys)


def test_sensor_stands_where_it_is_said_and_is_known_as_other_accelerometers():
    [yard, road] = fan(YARD, {
        'name': 'road', 'place': {'x': '-12 m', 'y': 0.0}, 'units': 'g', 'range': '2 g',
        'heading_deg': 90.0}).case.sensors.ground
    assert (yard.x, yard.y, yard.of) == (8.0, 0.2, 'block')
    assert yard.channels == ('yard_x', 'yard_y', 'yard_z')
    assert yard.pickup == Pickup()
    assert road.pickup == Pickup(range=2.0 * 9.80665, units='g', heading=0.5 * math.pi)


def test_filter_that_all_have_is_that_of_the_ground_too():
    [yard, road] = fan(YARD, {**YARD, 'name': 'road', 'anti_alias': False},
                       anti_alias=True).case.sensors.ground
    assert (yard.pickup.has_filter, road.pickup.has_filter) == (True, False)


def test_machines_of_a_plant_share_their_sensors():
    house = rs.Plant.load(HOUSE, overrides=[
        'ground.sensors=[{name: yard, place: {x: 12.0, y: 0.0}}]'])
    assert [[one.name for one in machine.case.sensors.ground]
            for machine in house.machines.values()] == [['yard'], ['yard']]


@pytest.mark.parametrize('sensors, keys, said', [
    ([{'name': 'yard', 'place': {'x': 1.0, 'y': 0.0}}], {},
     ['ground.sensors.0: point must be at least 0.5 m away from every block (half of the shortest '
      'half side), got 0 m at x 1 m, y 0 m']),
    ([YARD], {'of': 'blok'}, ['ground.of: must be one of the foundations, block, got blok']),
    ([], {'of': 'block'}, ['ground.of: belongs to ground.sensors, of which there are none, got '
                           'block']),
    ([YARD, YARD], {}, ['ground.sensors.1.name: must differ from that of ground.sensors.0, got '
                        'yard twice']),
    ([{**YARD, 'name': 'wheel'}], {},
     ['ground.sensors.0.name: must differ from that of rotor.discs.1, got wheel twice']),
    ([{**YARD, 'stamps': 'packets'}], {},
     ['ground.sensors.0.stamps: must not be packets of a sensor on the ground, whose phase is '
      'needed']),
    ([{**YARD, 'range': -1.0}, {'name': 'road', 'place': {'x': 9.0}}], {'of': 'blok'},
     ['ground.of: must be one of the foundations, block, got blok',
      'ground.sensors.0.range: must be > 0 m/s^2, got -1',
      'ground.sensors.1.place.y: is missing']),
    ([{**YARD, 'heading_deg': 30, 'orientation': 'use'}], {},
     ['ground.sensors.0.heading_deg: must not stand beside orientation: use, which tells it, got '
      '30']),
])
def test_what_is_wrong_is_told_at_its_key(sensors, keys, said):
    with pytest.raises(rs.InputError) as raised:
        fan(*sensors, ground=keys)
    assert sorted(str(raised.value).splitlines()) == [f'{FAN}: {line}' for line in said]


def test_places_are_told_and_drawn():
    machine = fan(YARD)
    case, told = machine.case, dict(derived_quantities(machine.case, machine.model.soil_models))
    assert told['yard: sensor on the ground'].startswith('x 8 m, y 0.2 m, 7 m beside block')
    assert 'yard' in [text.get_text() for text in site_plan(case).axes[0].texts]


def test_what_a_sensor_does_not_tell_is_a_warning():
    said = [one for one in warnings(fan(YARD).case) if one.startswith('yard')]
    # 30 Hz, c_R = 0.93 x 229.4 m/s: 0.883 rad/m over 8 m; 1 m of half a base.
    assert [one for one in said if 'up to 7.1 rad' in one]
    assert [one for one in said if 'to 0.87 of their vertical motion' in one]
    near = [one for one in warnings(fan({**YARD, 'place': {'x': 4.0, 'y': 0.0}}).case)
            if one.startswith('yard')]
    assert [one for one in near if 'less than 2 of its widths' in one]


def test_ground_that_nobody_knows_beside_the_block_is_a_warning():
    embedded = fan(YARD, support={'model': 'thin_layers'}, foundations=[{
        'name': 'block', 'half_width': 1.0, 'half_length': 1.5, 'centre_y': 0.2, 'height': 1.2,
        'density': 2400.0, 'embedment': 0.5}])
    [said] = [one for one in warnings(embedded.case) if one.startswith('ground.sensors')]
    assert 'blocks stand below the surface' in said
