"""What sensors on the ground of a case can tell, and what they cannot."""

from collections.abc import Iterator
import math

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.case.entries.sensors import GroundSensor
from rotorsoil_ros.ground.soil import extents
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.units import rad_s_to_hz

# Speed of surface waves over that of shear waves (theory manual, several machines).
_RAYLEIGH = 0.93

# Nearer than this many widths a block shapes the motion itself.
_NEAR = 2.0

# A base that averages waves to less than this, and a sensor that a wave passes by more of its
# turn [rad] before or after the block, make another motion of the ground than is taken.
_AVERAGED, _AWAY = 0.9, 0.5


def unknown_beside(case: Case) -> str:
    """Return why nobody can tell what blocks of a case do to the ground beside them, if so."""
    if case.soil is None:
        return 'the case tells no soil'
    if not case.foundations:
        return 'no block of the case stands on the ground'
    if any(embedment.depth for embedment in case.embedments):
        return 'blocks stand below the surface'
    return ''


def sensors_told(case: Case) -> Iterator[tuple[str, str]]:
    """Yield where sensors on the ground are."""
    for sensor in case.sensors.ground:
        told = f'x {sensor.x:g} m, y {sensor.y:g} m'
        if (block := _block(case, sensor)) is not None:
            told += (f', {_clear(sensor, block):.3g} m beside {block.name}; its rotation is taken '
                     'as none')
        yield f'{sensor.name}: sensor on the ground', told


def of_sensors(case: Case) -> Iterator[str]:
    """Yield what of the motion of the ground its sensors do not tell."""
    if case.sensors.ground and (why := unknown_beside(case)):
        yield (f'ground.sensors: what the machine itself does to the ground is not known: {why}; '
               'so is what the ground does to it once per turn, which is not told')
    for sensor in case.sensors.ground:
        block = _block(case, sensor)
        if block is None:
            continue
        width = 2.0 * _half(sensor, block)
        if _clear(sensor, block) < _NEAR * width:
            yield (f'{sensor.name}: stands {_clear(sensor, block):.3g} m beside {block.name}, '
                   f'less than {_NEAR:g} of its widths: so near the ground moves with the block')
        if case.soil is not None and case.support.model != 'rigid':
            yield from _of_waves(case, sensor, block)


def _of_waves(case: Case, sensor: GroundSensor, block: Foundation) -> Iterator[str]:
    """Yield how waves of the highest speed make another motion below a block."""
    assert case.soil is not None
    soil = case.soil if case.ground is None else case.ground.at(0.0)
    fastest = case.speed_range[1]
    wavenumber = fastest / (_RAYLEIGH * soil.shear_wave_speed)
    away = wavenumber * math.dist((sensor.x, sensor.y), (block.centre_x, block.centre_y))
    if away > _AWAY:
        yield (f'{sensor.name}: a wave of {rad_s_to_hz(fastest):.3g} Hz passes it up to '
               f'{away:.2g} rad before or after {block.name}: once per turn the size of the '
               "ground's part is told; its phase, and a residual without it, only of waves that "
               'come from aside, or are longer')
    across = wavenumber * _half(sensor, block)
    averaged = abs(math.sin(across) / across)
    if averaged < _AVERAGED:
        yield (f'{sensor.name}: the base of {block.name} averages waves along the line to it, of '
               f'{rad_s_to_hz(fastest):.3g} Hz to {averaged:.2g} of their vertical motion (rigid, '
               'sin(w b / c) / (w b / c)), which is not taken off'
               + ('; what bends averages less' if block.body is not None else ''))


def _block(case: Case, sensor: GroundSensor) -> Foundation | None:
    return next((block for block in case.foundations if block.name == sensor.of), None)


def _half(sensor: GroundSensor, block: Foundation) -> float:
    """Return half of what a block covers of the line to a sensor [m]."""
    (left, right), (first, last) = extents(block.contact)
    away = math.atan2(sensor.y - block.centre_y, sensor.x - block.centre_x)
    return 0.5 * (abs(math.cos(away)) * (right - left) + abs(math.sin(away)) * (last - first))


def _clear(sensor: GroundSensor, block: Foundation) -> float:
    return math.dist((sensor.x, sensor.y), (block.centre_x, block.centre_y)) - _half(sensor, block)
