"""
Compute every benchmark of the rotor and write docs/verification.md.

The machines are those of the tests, which hold the same figures (half a minute on one core):

    python docs/verification.py
"""

import os

os.environ['OMP_NUM_THREADS'] = '1'  # before numpy: small solves are slower with two threads

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
import math
from pathlib import Path
import sys
import tempfile
from unittest import mock

import numpy as np
import scipy.linalg

sys.path.extend(str(Path(__file__).resolve().parents[1] / folder) for folder in (
    '.', 'test'))

from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.document import text_of
from rotorsoil_ros.case.models import coupled_model
from rotorsoil_ros.case.ross import read
from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.soil import Rectangle, RigidSoil, Soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.modes.campbell import campbell
from rotorsoil_ros.machine.modes.critical import critical_speeds
from rotorsoil_ros.rotor import beam
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.rotor.disc import Disc
from rotorsoil_ros.rotor.shaft import Material, ShaftSection
from rotorsoil_ros.units import hz_to_rad_s, rad_s_to_hz, rpm_to_rad_s

import machines
from oracles import published

PAGE = Path(__file__).with_suffix('.md')
REFERENCE = published.REFERENCE / 'rotor'
IMPACT = 'ross_Q1_shared_mf42_n0rpm_0-150Hz.csv'
HEAD = """\
# Verification of the rotor

Written by `python docs/verification.py`; do not edit. Every benchmark of
`test/reference/rotor` and the ROSS files of `test/reference/ross`: what is expected, what comes
out, and how far apart they are. Tolerances are those of the benchmarks; deviations are relative.
"""


@dataclass(frozen=True)
class Finding:
    """One benchmark, computed."""

    name: str
    title: str
    unit: str
    source: str
    expected: np.ndarray
    computed: np.ndarray
    tolerance: float
    remark: str = ''

    @property
    def deviation(self) -> np.ndarray:
        """Relative deviation of every figure."""
        return np.abs(self.computed / self.expected - 1.0)


def _nearest(found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    return found[np.abs(found[:, None] - expected).argmin(axis=0)]


def _modes(rotor: Rotor, speed_rpm: float, count: int) -> np.ndarray:
    return campbell(CoupledModel(rotor), np.array([rpm_to_rad_s(speed_rpm)]), count).eigenvalue[0]


def _euler(given: dict) -> np.ndarray:
    stiffness, mass, polar = (one.copy() for one in
                              published.pinned_shaft(given).plane_matrices)
    mass -= 0.5 * polar  # rotary inertia, which Euler and Bernoulli leave out
    for row in (0, -2):
        stiffness[row, row] += 1e13
    return np.sqrt(scipy.linalg.eigh(stiffness, mass, eigvals_only=True,
                                     subset_by_index=[0, 2])) / (2.0 * math.pi)


def _pinned(given: dict) -> np.ndarray:
    speed = rpm_to_rad_s(given.get('speed_rpm', 0.0))
    found = published.whirl_frequencies(published.pinned_shaft(given), speed, 6)
    return rad_s_to_hz(found if speed else found[::2])


def _cantilever(given: dict) -> np.ndarray:
    massless = Material(given['E'], 0.3, 0.0)
    shaft = (ShaftSection(1.0, (3.0, 3.0), (0.0, 0.0), 1, massless),
             ShaftSection(given['L'], (given['d'],) * 2, (0.0, 0.0), 1, massless))
    disc = Disc('disc', 1.0 + given['L'], given['m'], given['Id'], given['Ip'])
    wall = tuple(machines.bearing(name, place, stiffness=1e14, foundation=None)
                 for name, place in (('a', 0.0), ('b', 1.0)))
    return rad_s_to_hz(np.abs(_modes(Rotor(0.0, shaft, (disc,), wall), given['speed_rpm'], 6)))


def _jeffcott(given: dict) -> np.ndarray:
    model = CoupledModel(published.jeffcott(given, damping_at_disc=given['c']))
    stiffness = 48.0 * given['E'] * math.pi * given['d'] ** 4 / 64.0 / given['L'] ** 3
    speed = math.sqrt(stiffness / given['m']) * np.array([0.5, 0.9, 1.0, 1.1, 2.0])
    found = model.unbalance_response(speed, np.array([given['me']]))
    return np.abs(machines.channel(model, found, 'disc_z'))


def _jeffcott_on_soil(given: dict) -> np.ndarray:
    rotor = published.jeffcott(
        given, foundation='block', stiffness=given['kb'], damping=given['cb'])
    block = Foundation('block', machines.CONTACT, given['L'] / 2.0, given['mf'], 0.0,
                       (1.0, 1.0, 1.0))
    model = CoupledModel(rotor, (block,), (machines.Restrained(machines.CONE, 'x', 'z'),))
    omega = hz_to_rad_s(np.array([10.0, 30.0, 45.0, 60.0, 100.0, 150.0]))
    found = model.unbalance_response(omega, np.array([given['me']]))
    return np.abs(np.concatenate([machines.channel(model, found, name)
                                  for name in ('disc_z', 'block_z')]))


def _cone_static(given: dict) -> np.ndarray:
    soil = Soil(given['G'], given['nu'], given['rho'], 0.0)
    static = np.diagonal(ConeModel(soil, Rectangle(given['b'], given['b'])).compliance(
        np.zeros(1))[0]).real
    return 1.0 / static[[2, 0]]


def _three_discs(given: dict) -> np.ndarray:
    rotor = published.lalanne_ferraris(given, given['cxx'], given['czz'])
    return rad_s_to_hz(np.abs(_modes(rotor, 25000.0, 12).imag))


def _aster(given: dict) -> np.ndarray:
    base = published.cases()['LF_3disc_25000rpm']['inputs']
    # Their spin takes y into z, ours z into x: their y is our z, their z our x.
    turned = {**base, 'kxx': given['kzz'], 'kzz': given['kyy']}
    model = CoupledModel(published.lalanne_ferraris(turned, given['czz'], given['cyy']))
    found = model.unbalance_response(np.array([rpm_to_rad_s(given['speed_rpm'])]),
                                     np.array([0.0, given['me'], 0.0]))
    y, z = (machines.channel(model, found, f'disc_2_{axis}')[0] for axis in 'zx')
    return np.array([abs(y), abs(z), *np.degrees(np.angle([y, z]))])


def _friswell(stiffness: object, speed_rpm: float) -> Callable[[dict], np.ndarray]:
    return lambda given: np.abs(_modes(published.friswell(given, stiffness), speed_rpm, 8))


def _ross_probe(given: dict) -> np.ndarray:
    rotor = published.friswell(given, np.diag([given['kxx'], given['kyy']]))
    rotor = Rotor(0.0, rotor.shaft, (*rotor.discs, Disc('end', 0.0, 0.0, 0.0, 0.0)),
                  rotor.bearings)
    model = CoupledModel(rotor)
    found = model.unbalance_response(np.array([50.0, 100.0]), np.array([0.0, 0.0, -1j]))
    x = -machines.channel(model, found, 'end_x')
    z = machines.channel(model, found, 'end_z')
    major = np.abs((z + 1j * x) / 2.0) + np.abs((z - 1j * x) / 2.0)
    return np.concatenate([np.abs(x + z) / math.sqrt(2.0), major])


ANISOTROPIC = [[1e6, 0.0], [0.0, 0.8e6]]
RECIPES: dict[str, Callable[[dict], np.ndarray]] = {
    'cf_ss_euler': _euler, 'cf_ss_timoshenko': _pinned, 'cf_ss_rayleigh_spin': _pinned,
    'cf_cantilever_disc': _cantilever, 'cf_jeffcott_unbalance': _jeffcott,
    'cf_jeffcott_on_soil': _jeffcott_on_soil, 'cf_cone_static': _cone_static,
    'LF_3disc_25000rpm': _three_discs, 'aster_sdll126c_unbalance': _aster,
    'FR_5.9.1_4000rpm': _friswell(1e6, 4000.0), 'FR_5.9.2_0rads': _friswell(ANISOTROPIC, 0.0),
    'FR_5.9.2_4000rpm': _friswell(ANISOTROPIC, 4000.0),
    'FR_5.9.4_like_4000rpm': _friswell([[1e6, 0.5e6], [0.0, 1e6]], 4000.0),
    'ROSS_unbalance_45deg': _ross_probe}
# Closed forms of beams and shafts that do not shear.
WITHOUT_SHEAR = {'cf_ss_euler', 'cf_ss_rayleigh_spin', 'cf_cantilever_disc',
                 'cf_jeffcott_unbalance', 'cf_jeffcott_on_soil'}


def _stiff_in_shear() -> AbstractContextManager[object]:
    return mock.patch.object(beam, 'shear_coefficient', lambda nu, ratio: np.full_like(nu, 1e9))


def benchmarks() -> Iterator[Finding]:
    """Yield every case of benchmarks.json."""
    for name, case in published.cases().items():
        expected = np.array(case['expected'])
        with _stiff_in_shear() if name in WITHOUT_SHEAR else nullcontext():
            found = RECIPES[name](case['inputs'])
        if 'Hz' in case['unit'] or 'rad/s' in case['unit']:
            found = _nearest(found, expected)
        yield Finding(name, case['title'], case['unit'], case['source'], expected, found,
                      case['suggested_rtol'], case['note'])


@dataclass(frozen=True)
class Sweep:
    """A reference file over frequency: how many figures, and the worst deviation of them."""

    name: str
    figures: int
    deviation: float
    tolerance: float = 1e-6


def sweeps() -> Iterator[Sweep]:
    """Yield every ROSS response file of the paper's machine."""
    soils = {'rigid': RigidSoil(), 'shared_mf42': machines.Restrained(machines.CONE, 'x', 'z'),
             'sharedrock_mf42': machines.Restrained(machines.CONE, 'x', 'z', 'ry')}
    for name, soil in soils.items():
        file = f'ross_Q1_{name}_0-150Hz.csv'
        yield _sweep(file, machines.paper_machine(soil), rocks='rock' in name)
    yield _impact()


def _sweep(file: str, model: CoupledModel, *, rocks: bool) -> Sweep:
    omega, columns = published.response(file)
    found = model.unbalance_response(omega, published.ROSS_UNBALANCE)
    keep = np.ones(len(omega), dtype=bool)
    if 'rigid' in file:  # undamped but for 1e-8: the peaks have no figures to compare
        for critical in (44.01, 48.86, 123.12, 129.48):
            keep &= np.abs(rad_s_to_hz(omega) / critical - 1.0) > 1.1e-3
    stations = {**published.ROSS_STATIONS, 'fnd': 'bearing_1_housing' if rocks else 'block'}
    worst, figures = 0.0, 0
    for theirs, expected in columns.items():
        station, axis = theirs.split('_')
        if station not in stations or ('rigid' in file and station == 'fnd'):
            continue
        name = f'{stations[station]}_{"x" if axis == "x" else "z"}'
        ours = machines.channel(model, found, name) * (-1.0 if axis == 'x' else 1.0)
        worst = max(worst, float(np.abs(ours / expected - 1.0)[keep].max()))
        figures += int(keep.sum())
    return Sweep(file, figures, worst)


def _impact() -> Sweep:
    """Return how the response at rest compares; they shake with 0.01 omega^2 in x and z."""
    omega, columns = published.response(IMPACT)
    model = machines.paper_machine(machines.Restrained(machines.CONE, 'x', 'z'))
    worst, figures = 0.0, 0
    for axis, theirs in (('x', 'x'), ('z', 'y')):
        found = model.frequency_response(omega, speed=0.0, channel=f'disc_1_{axis}')
        for name, station in {**published.ROSS_STATIONS, 'fnd': 'block'}.items():
            ours = 0.01 * omega**2 * machines.channel(model, found, f'{station}_{axis}')
            worst = max(worst, float(np.abs(ours / columns[f'{name}_{theirs}'] - 1.0).max()))
            figures += len(omega)
    return Sweep(IMPACT, figures, worst)


def imports() -> Iterator[Finding]:
    """Yield what ROSS 2.3.0 computed of the rotors that `import-ross` brings over."""
    source = '`Rotor.{}` of ROSS 2.3.0, file `test/reference/ross/{}.toml`'
    models = {name: _imported(name) for name in ('hollow', 'extras')}
    for name, model in models.items():
        speed, wanted, _ = published.ross_figures(name)
        found = campbell(model, np.array([speed]), len(wanted)).eigenvalue[0]
        for part, title in ((np.imag, 'damped frequencies'), (np.real, 'decay')):
            yield Finding(
                f'ROSS_{name}_{part.__name__}', f'{name}.toml, {title} at {speed:g} rad/s',
                'rad/s', source.format('run_modal', name), part(wanted),
                part(found.real + 1j * np.abs(found.imag)), 1e-9)
    criticals = [one.speed for one in critical_speeds(models['hollow'], (10.0, 1000.0))]
    yield Finding('ROSS_hollow_criticals', 'hollow.toml, critical speeds', 'rad/s',
                  source.format('run_modal', 'hollow') + ', roots by brentq',
                  published.ross_criticals(), np.array(criticals), 1e-9)
    for name, model in models.items():
        _, _, responses = published.ross_figures(name)
        for disc, wanted in responses.items():
            yield Finding(
                f'ROSS_{name}_{disc}', f'{name}.toml, |x| and |y| of {disc} at 100, 400, 700 and '
                '1000 rad/s for 1e-4 kg m', 'm', source.format('run_unbalance_response', name),
                np.abs(wanted).ravel(), np.abs(published.ross_response(model, disc)).ravel(), 1e-8)


def _imported(name: str) -> CoupledModel:
    with tempfile.TemporaryDirectory() as folder:
        case = Path(folder) / f'{name}.yaml'
        case.write_text(text_of(read(published.ROSS_FILES / f'{name}.toml').content, []))
        return coupled_model(load(case), Path(folder))


def criticals() -> Iterator[Finding]:
    """Yield the criticals of the paper's machine."""
    found = critical_speeds(machines.paper_machine(RigidSoil()), tuple(
        hz_to_rad_s(np.array([1.0, 150.0]))))
    yield Finding('paper_criticals', "the paper's machine on rigid ground, critical speeds", 'Hz',
                  'peaks of the dense solve behind `ross_Q1_rigid_0-150Hz.csv`, two decimals',
                  np.array([44.01, 48.86, 123.12, 129.48]),
                  rad_s_to_hz(np.array([one.speed for one in found])), 1.2e-4)


def _section(finding: Finding) -> list[str]:
    verdict = 'holds' if finding.deviation.max() <= finding.tolerance else '**FAILS**'
    lines = ['', f'### {finding.name}', '', f'{finding.title}. Source: {finding.source}.']
    if finding.remark:
        lines.append(f'Note: {finding.remark}.')
    lines += ['', f'| expected [{finding.unit}] | computed | deviation |', '|---|---|---|']
    lines += [f'| {expected:.10g} | {computed:.10g} | {deviation:.1e} |'
              for expected, computed, deviation in zip(
                  finding.expected, finding.computed, finding.deviation, strict=True)]
    return [*lines, '', f'Tolerance {finding.tolerance:g}: {verdict}, worst '
                        f'{finding.deviation.max():.1e}.']


def page() -> str:
    """Return the page."""
    findings = [*benchmarks(), *criticals(), *imports()]
    lines = [HEAD]
    lines += ['## In short', '', '| case | figures | worst deviation | tolerance | |',
              '|---|---|---|---|---|']
    results = [(one.name, len(one.expected), float(one.deviation.max()), one.tolerance)
               for one in findings]
    results += [(one.name, one.figures, one.deviation, one.tolerance) for one in sweeps()]
    lines += [f'| {name} | {count} | {worst:.1e} | {tolerance:g} | '
              f'{"holds" if worst <= tolerance else "**FAILS**"} |'
              for name, count, worst, tolerance in results]
    lines += ['', '## Case by case']
    for finding in findings:
        lines += _section(finding)
    lines += ['', "The files `ross_Q1_*.csv` are ROSS 3.0's responses of the paper's machine, "
              'each station and', 'direction at 0.25 to 150 Hz, complex; of `rigid` without what '
              'lies within 1.1e-3 of a critical; `n0rpm` shakes disc 1 while the rotor stands.',
              '']
    return '\n'.join(lines)


def main() -> None:
    """Write the page, or nothing where a figure to compare with is missing."""
    try:
        text = page()
    except FileNotFoundError as error:
        raise SystemExit(f'{error.filename}: not there, so {PAGE.name} is not written') from error
    PAGE.write_text(text, encoding='utf-8')


if __name__ == '__main__':
    main()
