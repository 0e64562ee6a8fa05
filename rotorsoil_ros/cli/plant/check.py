"""What `check` says of several machines: each on its own, and who shakes whom."""

from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
import math

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.plant.together import Plant, Shaken, sources_of
from rotorsoil_ros.machine.plant.source import SourceModel
from rotorsoil_ros.units import rad_s_to_rpm, Units

# Above, what the speeds of neighbours change is told as a warning.
_FELT_SPREAD = 0.02


def check_each(
    arguments: Namespace, units: Units, check: Callable[[Sequence[str]], int],
) -> tuple[int, list[tuple[str, str]]]:
    """Check every machine of a file, and return the worst status and what they do together."""
    sources = sources_of(arguments.case, arguments.overrides)
    if not sources:
        return check(arguments.overrides), []
    status = 0
    for name in sources:
        status = max(status, check([*arguments.overrides, f'source={name}']))
        print()
    plant = Plant.load(arguments.case, cache_directory=arguments.cache,
                       overrides=arguments.overrides)
    return status, list(_together(plant, units))


def _together(plant: Plant, units: Units) -> Iterator[tuple[str, str]]:
    yield 'all machines of', f'{plant.name}: ' + ', '.join(
        f'{name} at {rpm:g} rpm' for name, rpm in plant.rated_rpm.items())
    if not all(_is_steady(machine, plant.rated_rpm[name])
               for name, machine in plant.machines.items()):
        yield 'who shakes whom', 'not told: a machine is unstable at its rated speed'
        return
    found = plant.shaken()
    yield from _shares(found, units)
    for beat in found.beats():
        period = ('never ends' if beat.period_s == math.inf else f'{beat.period_s:.4g} s')
        yield (f'beat of {beat.first} and {beat.second}',
               f'{period}, {beat.channel} from {units.displacement(beat.lowest)} to '
               f'{units.displacement(beat.highest)}')


def _shares(found: Shaken, units: Units) -> Iterator[tuple[str, str]]:
    for column, channel in enumerate(found.channels):
        if channel.is_housing:
            shares = ', '.join(f'{name} {share:.1%}' for name, share in zip(
                found.sources, found.share[:, column].tolist(), strict=True))
            yield channel.name, (f'{units.velocity(float(found.velocity_rms[column]))}, of its '
                                 f'square {shares}')


def _is_steady(machine: Machine, rpm: float) -> bool:
    speed = machine.stability(rpm_range=(0.0, rpm))
    return not len(speed.unstable)


def neighbour_warnings(machine: Machine) -> Iterator[str]:
    """Yield where the speeds of neighbours change what a machine does, and what links them."""
    model, berth = machine.model, machine.case.berth
    if berth is None or not isinstance(model, SourceModel):
        return
    yield from berth.remarks
    speed = machine.table.pieces.edges
    speed = speed[machine.table.stability.holds(speed)]
    spread = berth.spread(model, speed, machine.case.unbalance) if len(speed) else speed
    worst = int(spread.argmax()) if len(speed) else 0
    if len(speed) and spread[worst] > _FELT_SPREAD:
        yield (f'the speeds of its neighbours change what {machine.case.name} does by up to '
               f'{spread[worst]:.1%}, near {rad_s_to_rpm(float(speed[worst])):.4g} rpm, where it '
               'passes a resonance of theirs; the band holds them standing and at their fastest')
