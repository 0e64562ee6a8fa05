"""Every picture of a case, and the figures of the seed paper."""

from argparse import Namespace
from collections.abc import Iterator
from importlib.resources import as_file, files
from itertools import chain
from pathlib import Path
import sys
from typing import TYPE_CHECKING

import numpy as np

from rotorsoil_ros.case import cache, models
from rotorsoil_ros.case.config import Case, load
from rotorsoil_ros.case.design.shapes import embedded_model
from rotorsoil_ros.case.design.tables import (
    boundary_element_model,
    infinite_element_model,
    thin_layer_model,
)
from rotorsoil_ros.case.entries.ground import THIN_LAYERS
from rotorsoil_ros.case.entries.site import BOUNDARY_ELEMENTS, site_of
from rotorsoil_ros.case.summary import undecided, unstable
from rotorsoil_ros.cli.progress import progress
from rotorsoil_ros.cli.sweeps import machine_of
from rotorsoil_ros.cli.table import write_table
from rotorsoil_ros.errors import NotSolvedError, RotorSoilError
from rotorsoil_ros.figures.bearings import bearing_figures
from rotorsoil_ros.figures.bending import bending_figure
from rotorsoil_ros.figures.damping import damping_figure
from rotorsoil_ros.figures.modal import mass_ratios, modal_figures, polar
from rotorsoil_ros.figures.paper import claim_numbers, paper_figures, PaperFigure, peak_numbers
from rotorsoil_ros.figures.response import all_figures, compliance_figure, main_peaks
from rotorsoil_ros.figures.transmissibility import fastest_steady, transmissibility_figure
from rotorsoil_ros.ground.boundary.layered_model import LayeredSiteModel
from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.layers.model import ThinLayerModel
from rotorsoil_ros.ground.layers.profile import LayeredSoil, SURFACE
from rotorsoil_ros.ground.soil import SoilModel
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.response import ResponseTable

if TYPE_CHECKING:
    from rotorsoil_ros.figures import Figure

_POINTS = 241  # of a compliance over frequency


def plot(arguments: Namespace) -> int:
    """Write one PNG for each picture and print its name."""
    machine = machine_of(arguments)
    case, model = machine.case, machine.model
    arguments.output.mkdir(parents=True, exist_ok=True)
    with progress('drawing') as _:
        for name, figure in chain(
                all_figures(case, model, machine.table), bearing_figures(case),
                _modal_figures(case, model), _studies(case, model, machine.table),
                _ground_figures(case, model), _soil_figures(case, model, machine.directory)):
            path = arguments.output / f'{name}.png'
            figure.savefig(path, dpi=150)
            print(path)
    for line in unstable(machine.table.stability):
        print(f'{case.path}: {line}', file=sys.stderr)
    return 0


def _modal_figures(case: Case, model: CoupledModel) -> Iterator[tuple[str, 'Figure']]:
    """Yield the pictures of the modes, or say why there are none."""
    try:
        yield from modal_figures(case, model)
        if np.any(case.unbalance):
            yield 'damping', damping_figure(case, model)
    except NotSolvedError as error:
        print(f'no pictures campbell, critical_shapes, damping, orbits, shapes: {case.path}: '
              f'{undecided(case, error)}', file=sys.stderr)
    if model.support.bends:
        yield 'bending', bending_figure(case, model)


def _studies(
    case: Case, model: CoupledModel, table: ResponseTable,
) -> Iterator[tuple[str, 'Figure']]:
    predictor = table.predictor(case.unbalance)
    if case.rotor.discs and np.any(case.unbalance):
        yield 'polar', polar(case, predictor, main_peaks(case, predictor))
        if case.support.model != 'rigid' and not model.support.bends:
            yield 'mass_ratios', mass_ratios(case, model)


def _ground_figures(case: Case, model: CoupledModel) -> Iterator[tuple[str, 'Figure']]:
    """Yield what ground that moves does to the machine, where something is between them."""
    if case.support.model == 'rigid':
        return
    speed = fastest_steady(model, case.speed_range)
    why = ('receptances do not tell how seats follow the ground'
           if model.support.table is not None else 'unstable at all speeds')
    if speed is None or model.support.table is not None:
        print(f'no picture transmissibility: {case.path}: {why}', file=sys.stderr)
    else:
        yield 'transmissibility', transmissibility_figure(case, model, speed=speed)


def _soil_figures(
    case: Case, model: CoupledModel, directory: Path,
) -> Iterator[tuple[str, 'Figure']]:
    """Yield all models of the soil below each block, where the case has a soil."""
    if case.soil is None or case.support.model not in (
            'cone', 'infinite_elements', BOUNDARY_ELEMENTS, THIN_LAYERS):
        return
    for index, block in enumerate(model.foundations):
        if not block.is_solid:
            print(f'no picture compliance_{block.name}: {case.path}: it has no contact as a whole',
                  file=sys.stderr)
            continue
        own = model.soil_models[index] if case.support.model == THIN_LAYERS else None
        if isinstance(own, ThinLayerModel):
            yield f'compliance_{block.name}', _layers_figure(case, block, own, directory)
            continue
        if case.ground is not None:
            yield f'compliance_{block.name}', _site_figure(case, model, index, directory)
            continue
        if case.embedments[index].depth:
            yield f'compliance_{block.name}', _stack_figure(case, model, index, directory)
            continue
        known: dict[str, SoilModel] = {'cone': ConeModel(case.soil, block.contact)}
        spans = []
        for label, solved in (('infinite elements', _infinite), ('boundary elements', _boundary)):
            try:
                known[label], span = solved(case, model, index, cache.Cache(directory))
            except RotorSoilError as error:
                # Cones know soils and shapes that others refuse.
                print(f'{label} are not in picture compliance_{block.name}: {error}',
                      file=sys.stderr)
            else:
                spans.append(span)
        if spans:
            omega = np.linspace(max(span[0] for span in spans), min(span[1] for span in spans),
                                _POINTS)
            yield f'compliance_{block.name}', compliance_figure(
                case.name, block, case.soil, known, omega)


def _layers_figure(
    case: Case, block: Foundation, layers: ThinLayerModel, directory: Path,
) -> 'Figure':
    """Return the compliance of layered ground beside that of a half-space without any layer."""
    assert case.soil is not None
    even = thin_layer_model(LayeredSoil((), case.soil), block.contact, SURFACE,
                            cache=cache.Cache(directory), speed_range=case.speed_range)
    omega = np.linspace(0.0, min(even.omega_range[1], layers.omega_range[1]), _POINTS)
    return compliance_figure(
        case.name, block, case.soil,
        {'on the surface, no layers': even, 'as given': layers}, omega)


def _stack_figure(
    case: Case, model: CoupledModel, index: int, directory: Path,
) -> 'Figure':
    """Return the compliance of cones in the ground beside that of thin layers."""
    assert case.soil is not None
    layers = embedded_model(case, index, cache.Cache(directory))
    return compliance_figure(
        case.name, model.foundations[index], case.soil,
        {'stack of cones': model.soil_models[index], 'thin layers': layers},
        np.linspace(0.0, layers.omega_range[1], _POINTS))


def _site_figure(
    case: Case, model: CoupledModel, index: int, directory: Path,
) -> 'Figure':
    """Return the compliance of a block on layers beside that of the disc that stands for it."""
    assert case.soil is not None
    assert case.ground is not None
    block, ground = model.foundations[index], model.soil_models[0]
    disc = thin_layer_model(case.ground, block.contact, SURFACE, cache=cache.Cache(directory),
                            speed_range=case.speed_range)
    highest = disc.omega_range[1]
    if isinstance(ground, LayeredSiteModel):
        highest = min(highest, ground.omega_range[1])
    return compliance_figure(
        case.name, block, case.soil,
        {'disc of thin layers': disc, 'boundary elements': model.support.soils[index]},
        np.linspace(0.0, highest, _POINTS))


def _infinite(
    case: Case, model: CoupledModel, index: int, tables: cache.Cache,
) -> tuple[SoilModel, tuple[float, float]]:
    assert case.soil is not None
    found = infinite_element_model(
        case.soil, model.foundations[index].contact, case.support.geometry, cache=tables,
        speed_range=case.speed_range)
    return found, found.omega_range


def _boundary(
    case: Case, model: CoupledModel, index: int, tables: cache.Cache,
) -> tuple[SoilModel, tuple[float, float]]:
    assert case.soil is not None
    if case.support.geometry != 'disc':
        raise RotorSoilError('they are three-dimensional, a strip is not')
    ground = model.soil_models[0]
    if isinstance(ground, BoundaryElementModel):
        return model.support.soils[index], ground.omega_range
    found = boundary_element_model(
        case.soil, site_of([model.foundations[index]]), cache=tables,
        speed_range=case.speed_range)
    return found, found.omega_range


def figures(arguments: Namespace) -> int:
    """Write figures 6, 8 and 9 as PNG and CSV, and what the paper's claims are held against."""
    out: Path = arguments.output
    out.mkdir(parents=True, exist_ok=True)
    with as_file(files('rotorsoil_ros') / 'config' / 'paper_rotor.yaml') as path:
        case = load(path, ['support.model=infinite_elements'])
    with progress('solving and drawing') as _:
        model = models.coupled_model(case, cache.directory(arguments.cache))
        [infinite] = model.soil_models
        numbers = claim_numbers(case, infinite)
        for figure in paper_figures(case, infinite):
            figure.figure.savefig(out / f'{figure.name}.png', dpi=150)
            _write_columns(figure, out / f'{figure.name}.csv')
            print(out / f'{figure.name}.png')
            if figure.name != 'figure_6':
                numbers += peak_numbers(figure)
    write_table(str(out / 'numbers.csv'), ['name', 'value', 'unit'], numbers)
    print(out / 'numbers.csv')
    return 0


def _write_columns(figure: PaperFigure, path: Path) -> None:
    header: list[str] = []
    columns = []
    for name, values in figure.columns.items():
        if np.iscomplexobj(values):
            header += [f'{name} re', f'{name} im']
            columns += [values.real, values.imag]
        else:
            header.append(name)
            columns.append(values.real)
    write_table(str(path), header, np.stack(columns, axis=1).tolist())
