"""What is typical, against published examples, closed forms and the ranges it came from."""

import math
from pathlib import Path

import pytest

from rotorsoil_ros.case.authoring import library
from rotorsoil_ros.case.authoring.library import BearingKind, MachineKind, PedestalKind, SoilClass
from rotorsoil_ros.case.authoring.questions import Answers
from rotorsoil_ros.case.entries.shaft import MaterialEntry, Section
from rotorsoil_ros.ground.soil import Soil

PAGE = Path(__file__).parents[2] / 'docs' / 'library.md'


def test_ball_and_roller_are_those_of_the_published_examples():
    # Friswell et al., as ROSS documents them: eight elements of 30 mm under 500 N, contact angle
    # 30 degrees, which a deep groove bearing does not have.
    ball = BearingKind.named('ball').stiffness(diameter=0.03 / 0.25, load=500.0)
    tilted = math.cos(math.pi / 6.0) ** (5.0 / 3.0)
    assert ball['zz'] * tilted == pytest.approx(1.00906269e8, rel=1e-3)
    assert ball['xx'] * tilted == pytest.approx(4.64168838e7, rel=1e-3)
    roller = BearingKind.named('rolling').stiffness(diameter=0.03 / 0.15, load=500.0)
    tilted, fewer = math.cos(math.pi / 6.0) ** 1.9, (8.0 / 16.0) ** 0.9
    assert roller['zz'] * tilted * fewer == pytest.approx(5.56779444e8, rel=1e-6)


def test_damping_of_rolling_bearings_lies_in_the_published_range():
    # Friswell et al., sec. 5.5.2: 0.25e-5 to 2.5e-5 s times the stiffness.
    for name in ('rolling', 'ball'):
        kind = BearingKind.named(name)
        assert kind.damping_time / kind.damping_factor == pytest.approx(0.25e-5, rel=0.02)
        assert kind.damping_time * kind.damping_factor == pytest.approx(2.5e-5, rel=0.02)
        size = {'diameter': 0.1, 'load': 2000.0}
        assert kind.damping(**size)['zz'] == kind.damping_time * kind.stiffness(**size)['zz']


@pytest.mark.parametrize('name', library.names(library.SOILS))
def test_every_soil_can_be_one_at_both_ends_of_its_ranges(name):
    found = SoilClass.named(name)
    for end in (0, 1):
        density, velocity = found.density[end], found.shear_wave_velocity[end]
        Soil(density * velocity**2, found.poisson_ratio[end], density,
             2.0 * found.damping_ratio[end])
    for low, high in (found.shear_wave_velocity, found.poisson_ratio, found.density,
                      found.damping_ratio):
        assert 0.0 < low < high


def test_soils_lie_where_eurocode_8_puts_them():
    # EN 1998-1:2004, table 3.1: D below 180, C 180 to 360, B 360 to 800 m/s.
    ranges = {name: SoilClass.named(name).shear_wave_velocity
              for name in library.names(library.SOILS)}
    assert ranges['loose_sand'][1] <= 180.0
    assert ranges['soft_clay'][1] <= 180.0
    assert ranges['dense_sand'] == ranges['stiff_clay'] == (180.0, 360.0)
    assert ranges['weathered_rock'][0] > 360.0


def test_undrained_clay_hardly_changes_its_volume():
    for name in ('soft_clay', 'stiff_clay'):
        low, high = SoilClass.named(name).poisson_ratio
        assert low >= 0.45
        assert high < 0.5


def test_pedestal_damps_by_its_ratio():
    found = PedestalKind.named('steel')
    moving = 1.25 * 400.0
    for key, damping in found.damping(400.0).items():
        assert damping / (2.0 * math.sqrt(found.stiffness[key] * moving)) == pytest.approx(0.02)


def test_motor_of_a_torque_carries_it_by_the_stress_on_its_surface():
    kind = MachineKind.named('motor_driven')
    diameter = kind.diameter(torque=723.0, speed=103.7)
    surface = math.pi * diameter * kind.width * diameter
    assert kind.surface_stress * surface * 0.5 * diameter == pytest.approx(723.0)
    fan = MachineKind.named('fan').diameter(torque=723.0, speed=103.7)
    assert 0.5 * fan * 103.7 == pytest.approx(80.0)


@pytest.mark.parametrize('key, shelf', [('soil', library.SOILS), ('bearing', library.BEARINGS),
                                        ('kind', library.MACHINES),
                                        ('pedestal', library.PEDESTALS)])
def test_every_entry_can_be_answered(key, shelf):
    for name in library.names(shelf):
        Answers(**{'kind': 'fan', 'power_kw': 1.0, 'rpm': 1000.0, key: name})


def test_every_material_of_the_schema_is_in_the_library():
    words = MaterialEntry.model_fields
    for name in library.names('materials'):
        assert set(library.entries('materials')[name]) == set(words)
        Section(length=1.0, outer_diameter=0.1, elements=1, material=name)


def rows():
    """Yield every row of the tables of the manual, of the files of the library."""
    def span(values):
        return f'{values[0]:g} to {values[1]:g}'

    for name in library.names(library.SOILS):
        soil = SoilClass.named(name)
        yield (f'`{name}`: {soil.means}', span(soil.shear_wave_velocity),
               span(soil.poisson_ratio), span(soil.density), span(soil.damping_ratio))
    for name in library.names(library.BEARINGS):
        kind = BearingKind.named(name)
        size = {'diameter': 0.1, 'load': 2000.0}
        about = ', '.join(f'{key} {value}' for key, value in kind.film.items() if key != 'type')
        yield (f'`{name}`: {kind.means}', *(
            (about or 'full bore', f'{kind.clearance_per_diameter:g}',
             f'{kind.length_per_diameter:g}') if kind.film else
            (f'{kind.stiffness(**size)["xx"]:.2g}', f'{kind.stiffness(**size)["zz"]:.2g}',
             f'{kind.damping(**size)["zz"]:.2g}')),
            f'{kind.stiffness_factor:g}', f'{kind.damping_factor:g}')
    for name in library.names(library.PEDESTALS):
        own = PedestalKind.named(name)
        yield (f'`{name}`: {own.means}', f'{own.stiffness["xx"]:.2g}',
               f'{own.stiffness["zz"]:.2g}', f'{own.damping_ratio:g}', f'{own.mass_share:g}',
               f'{own.stiffness_factor:g}')
    for name in library.names(library.MACHINES):
        kind = MachineKind.named(name)
        yield f'`{name}`: {kind.means}', kind.grade, kind.bearing, kind.pedestal
    for name in library.names('materials'):
        steel = library.material(name)
        yield (f'`{name}`', f'{1e-9 * steel.young_modulus:g}', f'{steel.poisson_ratio:g}',
               f'{steel.density:g}')


def test_every_table_of_the_library_is_that_of_its_files():
    lines = PAGE.read_text().splitlines()
    said = {line for line in lines if line.startswith('| `')}
    assert said == {f'| {" | ".join(row)} |' for row in rows()}
