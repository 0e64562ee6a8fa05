"""A case file of what a plant knows: every guess is marked, and has its share of the band."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from rotorsoil_ros.case import config, document
from rotorsoil_ros.case.authoring.estimates import cylinder, Estimates, Known
from rotorsoil_ros.case.authoring.questions import Answers
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.soil import Rectangle
from rotorsoil_ros.machine.foundation import solid_inertia

MARK = '# guess'

# Speeds that a case covers, over the rated one, and finite elements of its shaft.
_LOWEST, _HIGHEST, _ELEMENTS = 0.2, 1.3, 12
# On oil films: below, they are thinner than any that carries.
_LOWEST_ON_FILMS = 0.5
# Models of the ground, the best first: the first that reaches the speeds is taken.
_MODELS = ('boundary_elements', 'infinite_elements', 'cone')
# ISO 10816-3: group 1 above this power [kW].
_LARGE = 300.0
_COMMENT_COLUMN = 46


def text_of(answers: Answers, *, command: str) -> str:
    """
    Return the case file of a machine.

    Parameters
    ----------
    answers : Answers
        What is known of it.
    command : str
        What wrote it, for its head.

    Raises
    ------
    InputError
        If the answers do not fit each other.

    """
    found = Estimates(answers)
    name = answers.name or answers.kind
    head = [
        f'# {found.kind.means[0].upper()}{found.kind.means[1:]}, {answers.power_kw:g} kW at '
        f'{answers.rpm:g} rpm. Written by `{command}`.',
        f'# What ends in "{MARK}" nobody told: replace it by what you know, and take its line out',
        '# of `uncertainty`, which says how far each guess may be off. Axes: x across, y along',
        '# the shaft, z up. SI units; "140 mm" or "100 MPa" may be written too.']
    refusal: InputError | None = None
    for model in _MODELS:
        body = [f'name: {name}', *_ground(found, model), *_foundation(found), *_rotor(found),
                *_unbalance(found), *_spread(found), *_limits(found)]
        text = '\n'.join([*head, *body]) + '\n'
        try:  # what is written has to load
            config.case_of(Path(name), document.parse(text, source=name))
        except InputError as error:
            refusal = refusal or error
        else:
            return text
    assert refusal is not None
    raise refusal


def _line(text: str, comment: str) -> str:
    return f'{text:{_COMMENT_COLUMN}s}  {comment}' if comment else text


def _mark(*known: Known, unit: str = '') -> str:
    """Return the comment of a line: its unit, and whether any of it was guessed."""
    why = '; '.join(dict.fromkeys(one.why for one in known if one.why))
    return f'{MARK}{unit}: {why}' if why else f'#{unit}' if unit else ''


def _number(value: float | Known) -> str:
    """Return a number as people write it: what was told as it is, else what it is worth."""
    digits = 4
    if isinstance(value, Known):
        digits, value = 4 if value.why else 10, value.value
    return f'{value:.{digits}g}'.replace('e+0', 'e').replace('e-0', 'e-')


def _half(known: Known) -> Known:
    return Known(0.5 * known.value, known.why)


def _flow(values: Mapping[str, float]) -> str:
    return '{' + ', '.join(f'{key}: {_number(value)}' for key, value in values.items()) + '}'


def _ground(found: Estimates, model: str) -> Iterator[str]:
    soil, means = found.soil_class, found.soil_class.means
    yield 'soil:'
    yield _line(f'  shear_wave_velocity: {_number(found.wave_velocity)}',
                _mark(found.wave_velocity, unit=' [m/s]'))
    low, high = soil.poisson_ratio
    yield _line(f'  poisson_ratio: {0.5 * (low + high):.4g}',
                f'{MARK}: {means}: {low:g} to {high:g}')
    yield _line(f'  density: {_number(found.soil_density)}',
                _mark(found.soil_density, unit=' [kg/m^3]'))
    low, high = soil.damping_ratio
    yield _line(f'  loss_factor: {low + high:.4g}',
                f'{MARK}: twice a damping ratio of {low:g} to {high:g}')
    yield f'support: {{model: {model}}}'


def _speeds_rpm(found: Estimates) -> tuple[float, float]:
    rpm, lowest = found.answers.rpm, _LOWEST_ON_FILMS if found.bearing.film else _LOWEST
    return float(f'{lowest * rpm:.2g}'), float(f'{_HIGHEST * rpm:.3g}')


def _foundation(found: Estimates) -> Iterator[str]:
    width, length, height = found.block
    concrete, machine = found.concrete_mass, found.machine_mass.value
    total = concrete + machine
    shaft = height.value + found.shaft_height.value
    # The machine is taken to have its mass at the height of its shaft.
    centre = (0.5 * concrete * height.value + machine * shaft) / total
    contact = Rectangle(0.5 * width.value, 0.5 * length.value)
    x, y, z = solid_inertia(contact, mass=concrete, height=height.value)
    apart = concrete * (centre - 0.5 * height.value)**2 + machine * (shaft - centre)**2
    yield 'foundations:'
    yield '  - name: block'
    yield _line(f'    half_width: {_number(_half(width))}', _mark(width, unit=' [m]'))
    yield _line(f'    half_length: {_number(_half(length))}', _mark(length, unit=' [m]'))
    yield _line(f'    height: {_number(height)}', _mark(height, unit=' [m]'))
    weighed = f'{concrete:.3g} kg of concrete, {machine:.3g} kg of machine at its shaft'
    yield _line(f'    mass: {_number(total)}', f'{MARK} [kg]: {weighed}')
    yield _line(f'    centre_of_gravity_height: {_number(centre)}', f'{MARK} [m]: of both')
    inertia = ', '.join(map(_number, (x + apart, y + apart, z)))
    yield _line(f'    inertia: [{inertia}]', f'{MARK} [kg m^2]: of both')


def _rotor(found: Estimates) -> Iterator[str]:
    diameter, seat, span = found.shaft_diameter, found.coupling_seat, found.span
    above = found.shaft_height
    height = Known(found.block[2].value + above.value, above.why)
    yield 'rotor:'
    yield _line(f'  shaft_height: {_number(height)}',
                _mark(above, unit=f' [m]: {_number(above)} above the block'))
    yield '  material: steel'
    yield '  shaft:'
    yield _line(f'    - {{length: {_number(found.shaft_length)}, outer_diameter: '
                f'{_number(diameter)}, elements: {_ELEMENTS}}}',
                _mark(diameter, span, found.overhang, unit=' [m]'))
    yield '  discs:'
    disc, coupling = found.disc_mass, found.coupling_mass
    across = found.disc_diameter
    polar, diametral = cylinder(disc.value, across, found.disc_width)
    # A half coupling is some three diameters of the shaft wide, and one long.
    own_polar, own_diametral = cylinder(coupling, 3.0 * diameter.value, diameter.value)
    yield _line(f'    - {{name: coupling, position: {_number(0.4 * seat)}, mass: '
                f'{_number(coupling)}, diametral_inertia: {_number(own_diametral)}, '
                f'polar_inertia: {_number(own_polar)}}}', f'{MARK}: by the diameter of the shaft')
    yield _line(f'    - {{name: {found.kind.disc}, position: {_number(found.disc_position)}, '
                f'mass: {_number(disc.value)}, diametral_inertia: {_number(diametral)}, '
                f'polar_inertia: {_number(polar)}}}',
                f'{MARK}: {disc.why or "its inertia"}, as a cylinder of {across:.3g} m')
    yield '  bearings:'
    for name, place in (('drive_end', seat), ('free_end', seat + span.value)):
        yield from _bearing(found, name, _line(f'      position: {_number(place)}',
                                               _mark(span, unit=' [m]')))


def _bearing(found: Estimates, name: str, position: str) -> Iterator[str]:
    kind, own = found.answers.bearing or found.kind.bearing, found.bearing
    why = f'a {kind} bearing of this size'
    yield f'    - name: {name}'
    yield position
    size = {'diameter': found.shaft_diameter.value, 'load': found.bearing_load}
    if own.film:
        journal = document.flow(own.journal(size['diameter']))
        yield _line(f'      journal: {journal}', f'{MARK} [m]: {why}')
    else:
        yield _line(f'      stiffness: {_flow(own.stiffness(**size))}', f'{MARK} [N/m]: {why}')
        yield _line(f'      damping: {_flow(own.damping(**size))}', f'{MARK} [N s/m]: {why}')
    pedestal = found.pedestal
    if pedestal is None:
        return
    yield '      pedestal:'
    yield _line(f'        mass: {_number(pedestal.mass_share * found.carried)}',
                f'{MARK} [kg]: {pedestal.mass_share:g} of what it carries')
    yield _line(f'        stiffness: {_flow(pedestal.stiffness)}',
                f'{MARK} [N/m]: {pedestal.means}')
    yield _line(f'        damping: {_flow(pedestal.damping(found.carried))}',
                f'{MARK} [N s/m]: {pedestal.damping_ratio:g} of critical')


def _unbalance(found: Estimates) -> Iterator[str]:
    grade, why = found.grade
    yield 'unbalances:'
    yield _line(f'  - {{disc: {found.kind.disc}, grade: {grade}, rated_speed_rpm: '
                f'{found.answers.rpm:.10g}}}', f'{MARK}: {why}' if why else '')


def _spread(found: Estimates) -> Iterator[str]:
    yield 'uncertainty:'
    for key, value, why in found.spreads():
        yield _line(f'  {key}: {value:g}', f'# {why}')


def _limits(found: Estimates) -> Iterator[str]:
    group = 1 if found.answers.power_kw > _LARGE else 2
    yield _line(f'zones: {{group: {group}}}',
                f'# ISO 10816-3: {"above" if group == 1 else "up to"} {_LARGE:g} kW')
    low, high = _speeds_rpm(found)
    yield f'speed_range_rpm: [{low:g}, {high:g}]'
