"""What a case is, and what has been computed of it, in words."""

from argparse import Namespace
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path
import time

import numpy as np

from rotorsoil_ros.case import cache, models
from rotorsoil_ros.case.config import Case, load
from rotorsoil_ros.case.design.depth import depth_remarks
from rotorsoil_ros.case.design.ground import model_error
from rotorsoil_ros.case.design.report import Acceptance
from rotorsoil_ros.case.design.rigidity import of_rigidity
from rotorsoil_ros.case.design.shapes import shape_errors
from rotorsoil_ros.case.design.tables import key_of
from rotorsoil_ros.case.journal_entries import BEYOND
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.case.summary import (
    clipped,
    derived_quantities,
    implausible,
    near_threshold,
    stability_doubts,
    stability_told,
    undecided,
    unstable,
    warnings,
    without_transients,
)
from rotorsoil_ros.cli.arguments.options import SI
from rotorsoil_ros.cli.plant.check import check_each, neighbour_warnings
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.cli.sweeps import machine_of
from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.boundary.layered_model import LayeredSiteModel
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.boundary.table import BoundaryTable
from rotorsoil_ros.ground.elements.table import DimensionlessTable
from rotorsoil_ros.ground.half_space import InfiniteElementModel
from rotorsoil_ros.ground.soil import SoilModel
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.damping import DampingSplitter, LARGEST_DAMPING_RATIO
from rotorsoil_ros.machine.modes.critical import asked, critical_speeds
from rotorsoil_ros.machine.modes.names import ModeNames
from rotorsoil_ros.machine.modes.stability import stability
from rotorsoil_ros.machine.peaks import Peak, resonances
from rotorsoil_ros.machine.response import ResponseTable
from rotorsoil_ros.units import rad_s_to_hz, rad_s_to_rpm, Units

# Amplification factor below which a critical speed needs no margin (API 617).
_FELT = 2.5


def check(arguments: Namespace) -> int:
    """Print what follows from a case, where it is critical, and what looks odd."""
    units = Units(arguments.units != SI)
    status, together = check_each(
        arguments, units, lambda overrides: _check(arguments, overrides, units))
    _print_table(together)
    return status


def _check(arguments: Namespace, overrides: Sequence[str], units: Units) -> int:
    """Check one machine, alone or among others."""
    case = load(arguments.case, overrides, cache_directory=arguments.cache)
    directory = cache.directory(arguments.cache)
    with progress('solving') as _:
        model = models.coupled_model(case, directory)
        table = models.response_table(case, model, directory)
        try:
            criticals, doubts = _criticals(case, model, units)
        except NotSolvedError as error:
            # The machine can be answered for all the same: its response needs no modes.
            criticals = [('critical speeds', 'not known, see the warning')]
            doubts = [undecided(case, error)]
        if case.journals:
            doubts += near_threshold(case, stability(
                model, (case.speed_range[0], BEYOND * case.speed_range[1])))
    shapes = shape_errors(case, model.support.soils, directory)
    _print_table(derived_quantities(case, model.soil_models, shapes))
    _print_table([('stability', stability_told(table.stability, units))])
    _print_table(criticals)
    peaks = _peaks(case, table)
    _print_table(_of_peaks(peaks, units))
    _print_table(_of_damping(case, model, table, peaks))
    found = ((peak.channel, peak.speed, peak.amplitude) for peak in peaks)
    for warning in chain(doubts, implausible(case, found), stability_doubts(table.stability),
                         without_transients(case, table), warnings(case, shapes),
                         of_rigidity(case, model.soil_models),
                         depth_remarks(case, model, directory),
                         neighbour_warnings(Machine(case, directory))):
        print(f'warning: {warning}')
    growing = list(unstable(table.stability))
    for text in growing:
        print(f'error: {text}')
    return 1 if growing else 0


def report(arguments: Namespace) -> int:
    """Judge whether the foundation is right for the machine, on one page; print the verdict."""
    from rotorsoil_ros.figures.design import write_design_report

    machine = machine_of(arguments)
    with progress('solving') as _:
        found = machine.report(rpm=arguments.rpm)
    out: Path = arguments.output
    out.mkdir(parents=True, exist_ok=True)
    with progress('drawing') as _:
        write_design_report(machine, found, out)
    print(f'verdict   {found.verdict}')
    print(*(f'          {reason}' for reason in found.reasons), sep='\n')
    print(f'next step {found.next_step}')
    print(f'report    {out / "report.html"}')
    return 0 if found.verdict == Acceptance.ACCEPTABLE else 1


def tabulate(arguments: Namespace) -> int:
    """Compute the tables of a case, or find them, and tell which."""
    case = load(arguments.case, arguments.overrides, cache_directory=arguments.cache)
    directory = cache.directory(arguments.cache)
    with progress('solving the soil') as _:
        start = time.perf_counter()
        model = models.coupled_model(case, directory)
        soil_seconds = time.perf_counter() - start
    is_stored = cache.Cache(directory).path(
        'response', models.response_key(case, model)).is_file()
    start = time.perf_counter()
    with progress('solving') as _:
        table = models.response_table(case, model, directory)
    seconds = time.perf_counter() - start
    for names, soil in zip(models.blocks_on_each(model), model.soil_models, strict=True):
        _print_table(_compliance(names, soil, directory))
    if model.foundations:
        print(f'{"soil ready in":40s} {soil_seconds:.3g} s')
    errors = [(block, model_error(case, block, shape)) for block, shape in zip(
        case.foundations, shape_errors(case, model.support.soils, directory),
        strict=True)]
    low, high = table.speed_range
    _print_table([
        ('response table', f'{"loaded" if is_stored else "computed"} in {seconds:.3g} s'),
        ('covers', f'{rad_s_to_rpm(low):g} to {rad_s_to_rpm(high):g} rpm, '
                   f'{len(table.channels)} channels, {len(table.planes)} unbalance planes'),
        ('pieces', f'{len(table.pieces.resolved)} polynomials'),
        ('largest error of the solver', f'{table.accuracy:.2g} of the local amplitude, at unseen '
                                        'speeds; that of the models is another'),
        *((f'{block.name}: model error', told) for block, told in errors if told),
        *(('unstable', f'{rad_s_to_rpm(left):.10g} to {rad_s_to_rpm(right):.10g} rpm: no steady '
                       'response') for left, right in table.stability.unstable.tolist()),
        *(('gap', f'{rad_s_to_rpm(left):.10g} to {rad_s_to_rpm(right):.10g} rpm: resonance '
                  'without damping') for left, right in table.gaps),
        ('file', str(cache.Cache(directory).path('response', table.key))),
    ])
    return 0


def _compliance(block: str, soil: SoilModel, directory: Path) -> Iterable[tuple[str, str]]:
    if isinstance(soil, BoundaryElementModel):
        yield from _boundary(block, soil, directory)
        return
    if isinstance(soil, LayeredSiteModel):
        yield from _on_layers(block, soil, directory)
        return
    if not isinstance(soil, InfiniteElementModel):
        yield f'{block}: compliance', f'closed form, {type(soil).__name__}'
        return
    table = soil.table
    low, high = (rad_s_to_hz(omega) for omega in soil.omega_range)
    yield f'{block}: compliance', (f'infinite elements, {table.geometry}, nu '
                                   f'{table.poisson_ratio:g}, eta {table.loss_factor:g}')
    yield f'{block}: covers', (f'a0 {table.a0_min:g} to {table.a0_max:g}, here {low:.4g} to '
                               f'{high:.4g} Hz')
    yield from _solved(block, table, soil, directory)


def _boundary(
    blocks: str, soil: BoundaryElementModel, directory: Path,
) -> Iterable[tuple[str, str]]:
    table = soil.tables[0]
    yield f'{blocks}: compliance', (f'boundary elements, nu {table.poisson_ratio:g}, eta '
                                    f'{table.loss_factor:g}')
    yield f'{blocks}: covers', (f'a0 0 to {table.a0_max:g}, here 0 to '
                                f'{rad_s_to_hz(soil.omega_range[1]):.4g} Hz')
    yield from _solved(blocks, table, soil, directory)


def _on_layers(
    blocks: str, soil: LayeredSiteModel, directory: Path,
) -> Iterable[tuple[str, str]]:
    table = soil.table.functions
    yield f'{blocks}: compliance', f'boundary elements on layers, {len(table.pieces)} pieces'
    yield f'{blocks}: covers', (f'a0 0 to {soil.a0_max:g} of the uppermost layer, here 0 to '
                                f'{rad_s_to_hz(soil.omega_range[1]):.4g} Hz')
    yield f'{blocks}: solves', f'{table.solves}, {table.nodes} nodes over the depth'
    yield (f'{blocks}: largest error of the solver',
           f'{table.measured_error:.2g}, at unseen frequencies')
    yield f'{blocks}: file', str(cache.Cache(directory).path('compliance', key_of(soil)))


def _solved(
    block: str, table: DimensionlessTable | BoundaryTable,
    soil: InfiniteElementModel | BoundaryElementModel, directory: Path,
) -> Iterable[tuple[str, str]]:
    """Yield what a table cost, how good it is, and where it lies."""
    yield f'{block}: solves', f'{table.solves} of {table.unknowns} unknowns'
    yield (f'{block}: largest error of the solver',
           f'{table.measured_error:.2g}, at unseen frequencies')
    yield f'{block}: file', str(cache.Cache(directory).path('compliance', key_of(soil)))


def _criticals(
    case: Case, model: CoupledModel, units: Units,
) -> tuple[list[tuple[str, str]], list[str]]:
    """Return every critical speed to which the speed range has to keep a margin, and doubts."""
    low, high = case.speed_range
    wanted = low, asked(high)[1]
    span = model.support.within(model.bearings.within_tables(wanted))
    names, lines = ModeNames(model), []
    found = critical_speeds(model, span)
    criticals = [one for one in found if abs(one.damping_ratio) <= LARGEST_DAMPING_RATIO]
    for critical, split in zip(criticals, DampingSplitter(model).of_modes(criticals),
                               strict=True):
        how = [f'{"forward" if critical.whirl > 0 else "backward"}',
               f'damping ratio {critical.damping_ratio:.2g}'
               + ('' if split is None else f' ({split.words(0)})')]
        if critical.amplification_factor < _FELT:
            how.append('hardly felt')
        if critical.speed > high:
            asks = critical.required_margin(high)
            how.append(f'{critical.speed / high - 1.0:.1%} above the speed range, '
                       + (f'{asks:.0%} is asked' if asks else 'no margin is asked')
                       + (' as far as it is excited' if asks and critical.owner else ''))
        lines.append((f'critical speed {units.speed(critical.speed)}',
                      f'{", ".join(how)}, {names.of_critical(critical)}'))
    if len(criticals) < len(found):
        lines.append(('critical speeds left out', f'{len(found) - len(criticals)} of vibrations '
                      f'with a damping ratio above {LARGEST_DAMPING_RATIO:g}, which hardly swing'))
    if not lines:
        lines.append(('critical speeds', f'none from {units.speed(span[0])} up to '
                                         f'{units.speed(span[1])}'))
    return lines, clipped(model, span, wanted)


def _peaks(case: Case, table: ResponseTable) -> list[Peak]:
    moved = tuple(channel for channel in table.channels if not channel.is_rotation)
    return resonances(table.predictor(case.unbalance), moved)


def _of_peaks(peaks: Sequence[Peak], units: Units) -> Iterable[tuple[str, str]]:
    for peak in peaks:
        yield (f'response peak {units.speed(peak.speed)}',
               f'{units.displacement(peak.amplitude)} at {peak.channel}')
    if not peaks:
        yield 'peaks of the response', 'none in the speed range'


def _of_damping(
    case: Case, model: CoupledModel, table: ResponseTable, peaks: Sequence[Peak],
) -> Iterable[tuple[str, str]]:
    """Yield what takes the energy of the unbalance at every peak, and at the highest speed."""
    speed = np.array([*(peak.speed for peak in peaks), case.speed_range[1]])
    speed = speed[table.stability.holds(speed)]  # elsewhere there is no steady motion
    if not np.any(case.unbalance) or not len(speed):
        return
    split = DampingSplitter(model).forced(speed, case.unbalance)
    for row, at in enumerate(speed.tolist()):
        yield (f'damping at {rad_s_to_rpm(at):.6g} rpm',
               f'{split.words(row)}, of {split.power[row]:.3g} W')


def _print_table(lines: Iterable[tuple[str, str]]) -> None:
    for name, value in lines:
        print(f'{name:40s} {value}')
