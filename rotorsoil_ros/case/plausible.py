"""Is a number what such a thing ever has? A slip of a unit is asked about, not refused."""

from collections.abc import Iterator, Sequence

import numpy as np

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.journal_entries import Journal
from rotorsoil_ros.ground.soil import Soil
from rotorsoil_ros.machine.foundation import Foundation, solid_inertia
from rotorsoil_ros.rotor.coefficients import values
from rotorsoil_ros.rotor.shaft import Material

# What such a thing ever has, the unit, and by which factors a slip of the unit is off, the
# likeliest first: t/m^3 or g/cm^3, MPa or GPa or N/mm^2, N/mm or N/um, mm.
_SOIL_DENSITY = 800.0, 3500.0, 'kg/m^3', (1e3,)
_SOIL_MODULUS = 2e5, 5e10, 'Pa', (1e6, 1e3, 1e9)
_MATERIAL_DENSITY = 1000.0, 20000.0, 'kg/m^3', (1e3,)
_YOUNG_MODULUS = 1e9, 1e12, 'Pa', (1e9, 1e6)
_DIAMETER = 5e-4, 3.0, 'm', (1e-3,)
_STIFFNESS = 1e4, 1e13, 'N/m', (1e6, 1e3)
_CLEARANCE = 2e-4, 6e-3, 'of the radius', ()
_VISCOSITY = 2e-4, 2.0, 'Pa s', (1e-3,)

# Of a block: its mass over that of the rotor, its density, its inertia over that of a plate.
_LEAST_MASS_RATIO = 0.1
_BLOCK_DENSITY = 300.0, 9000.0
_HEAVIEST_CONCRETE = 2600.0
_LEAST_INERTIA, _LARGEST_INERTIA = 0.2, 50.0

# Eccentricity of an unbalance that is no longer one, of the rotor as a whole [m].
_LARGEST_ECCENTRICITY = 2e-2


def slips(case: Case) -> Iterator[str]:
    """Yield a question for every number that is outside what such a thing ever has."""
    for place, soil in _soils(case):
        yield from asked(f'{place}.density', soil.density, _SOIL_DENSITY)
        yield from asked(f'{place}.shear_modulus', soil.shear_modulus, _SOIL_MODULUS)
    yield from _of_shaft(case)
    yield from _of_bearings(case)
    for index, block in enumerate(case.foundations):
        yield from _of_block(case, f'foundations.{index}', block)
        yield from _of_hole(case, index, block)
    total = float(abs(np.sum(case.unbalance[:len(case.rotor.discs)])))
    if total > _LARGEST_ECCENTRICITY * case.rotor.mass:
        yield (f'unbalances: {total:g} kg m shift the centre of the rotor of '
               f'{case.rotor.mass:.4g} kg by {1e3 * total / case.rotor.mass:.3g} mm; a moment is '
               f'in kg m: did you mean {_number(1e-3 * total)} (given in kg mm) or '
               f'{_number(1e-6 * total)} (in g mm)?')


def _soils(case: Case) -> Iterator[tuple[str, Soil]]:
    """Yield every soil of a case and the key at which it stands."""
    if case.ground is None or not case.ground.layers:
        if case.soil is not None:
            yield 'soil', case.soil
        return
    for index, layer in enumerate(case.ground.layers):
        yield f'soil.layers.{index}', layer.soil
    if case.ground.below is not None:
        yield 'soil.below', case.ground.below


def asked(
    key: str, value: float, known: tuple[float, float, str, Sequence[float]],
) -> Iterator[str]:
    """
    Yield a question about a value that no such thing has.

    Parameters
    ----------
    key : str
        Where it stands.
    value : float
        What it is.
    known : tuple
        Lowest and highest that such a thing has, the unit, and by which factors a slip of the
        unit is off, the likeliest first.

    """
    low, high, unit, factors = known
    if low <= value <= high:
        return
    meant = [factor * value for factor in factors if low <= factor * value <= high]
    question = f': did you mean {_number(meant[0])}?' if meant else ''
    yield (f'{key}: {_number(value)} {unit} is outside {_number(low)} to {_number(high)} {unit}'
           f'{question}')


def _number(value: float) -> str:
    return f'{value:.5g}'


def _of_shaft(case: Case) -> Iterator[str]:
    materials: dict[Material, str] = {}
    for index, section in enumerate(case.rotor.shaft):
        place = f'rotor.shaft.{index}'
        yield from asked(f'{place}.outer_diameter', max(section.outer_diameter), _DIAMETER)
        materials.setdefault(section.material, place)
    for material, place in materials.items():
        if material.density > 0.0:
            yield from asked(f'{place}: density of its material', material.density,
                              _MATERIAL_DENSITY)
        yield from asked(f'{place}: young_modulus of its material', material.young_modulus,
                          _YOUNG_MODULUS)


def _of_bearings(case: Case) -> Iterator[str]:
    films = {journal.name: journal for journal in case.journals}
    for index, bearing in enumerate(case.rotor.bearings):
        if bearing.name in films:
            yield from _of_film(f'rotor.bearings.{index}.journal', films[bearing.name])
            continue
        most = values(bearing.stiffness).reshape(-1, 2, 2).max(axis=0)
        for axis, value in zip(('xx', 'zz'), np.diagonal(most).tolist(), strict=True):
            # None at all is a damper or a seal.
            if value > 0.0:
                yield from asked(f'rotor.bearings.{index}.stiffness.{axis}', value, _STIFFNESS)


def _of_film(place: str, journal: Journal) -> Iterator[str]:
    bore, thick = journal.states.bearing, journal.viscosity.values
    yield from asked(f'{place}.radial_clearance', bore.radial_clearance / bore.radius,
                      _CLEARANCE)
    if journal.oil is None:
        yield from asked(f'{place}.viscosity', float(thick.max()), _VISCOSITY)


def _of_block(case: Case, place: str, block: Foundation) -> Iterator[str]:
    carried = case.rotor.mass / len(case.foundations)
    if case.support.model == 'rigid' or block.mass <= 0.0 or block.on is not None:
        return
    if block.mass < _LEAST_MASS_RATIO * carried:
        yield (f'{place}.mass: {_number(block.mass)} kg below a rotor of {case.rotor.mass:.4g} '
               f'kg: did you mean {_number(1e3 * block.mass)}?')
    else:
        yield from _of_inertia(place, block)
    if block.mass >= _LEAST_MASS_RATIO * carried and block.height is not None:
        density = block.mass / (block.contact.area * block.height)
        low, high = _BLOCK_DENSITY
        if not low <= density <= high:
            yield (f'{place}.mass: {_number(block.mass)} kg in its volume make {density:.4g} '
                   f'kg/m^3; a block of concrete would have '
                   f'{_number(2400.0 * block.contact.area * block.height)} kg')
    # The lower end of a shaft that stands may be at the top of its block.
    if (block.height is not None and case.rotor.shaft_height <= block.height
            and not case.rotor.is_upright):
        yield (f'rotor.shaft_height: {_number(case.rotor.shaft_height)} m is not above the top of '
               f'{block.name}, {_number(block.height)} m; it counts from the contact: did you '
               f'mean {_number(case.rotor.shaft_height + block.height)}?')


def _of_hole(case: Case, index: int, block: Foundation) -> Iterator[str]:
    """Ask about a block that is buried, or that seems to weigh its excavated soil too."""
    depth = case.embedments[index].depth
    if not depth or block.height is None or case.soil is None:
        return
    place = f'foundations.{index}'
    if depth > block.height:
        yield (f'{place}.embedment: {_number(depth)} m is more than the height of {block.name}, '
               f'{_number(block.height)} m: its top lies below the surface')
    soil = case.soil.density * block.contact.area * depth
    solid = _HEAVIEST_CONCRETE * block.contact.area * block.height
    if block.mass > solid and block.mass - soil < solid:
        yield (f'{place}.mass: {_number(block.mass)} kg are more than concrete of its size has, '
               f'{_number(solid)} kg; the {_number(soil)} kg of soil that it displaces must not '
               f'be part of it: did you mean {_number(block.mass - soil)}?')


def _of_inertia(place: str, block: Foundation) -> Iterator[str]:
    """Ask about inertias that no body of this mass on this contact has."""
    flat = solid_inertia(block.contact, mass=block.mass, height=0.0)
    high = block.height or 2.0 * block.centre_of_gravity_height
    solid = solid_inertia(block.contact, mass=block.mass, height=max(high, 0.0))
    wrong = [axis for axis, given, plate in zip('xyz', block.inertia, flat, strict=True)
             if given > 0.0
             and not _LEAST_INERTIA * plate <= given <= _LARGEST_INERTIA * max(plate, *solid)]
    if wrong:
        given, meant = (', '.join(map(_number, values)) for values in (block.inertia, solid))
        yield (f'{place}.inertia: [{given}] kg m^2 of {_number(block.mass)} kg on this contact, '
               f'about {" and ".join(wrong)}: a solid block has [{meant}]; did you mean those?')
