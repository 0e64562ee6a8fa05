"""Cases of foundations that bend, on the reference files and ground tables beside them."""

import csv
from pathlib import Path
import shutil

from foundations import FOOTING, PATCH, REFERENCE
import numpy as np
import yaml

from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.units import hz_to_rad_s

DOFS = ('x', 'y', 'z', 'rx', 'ry', 'rz')
STIFF = {'stiffness': {'xx': 2.5e8, 'zz': 5e8}, 'damping': {'xx': 4e3, 'zz': 4e3}}
FAN = {
    'name': 'fan', 'support': {'model': 'table', 'file': 'patch.csv'},
    'foundations': [{'name': 'raft', 'soil_under': 'each', 'flexible': {
        'modes': 'raft_modes.csv', 'residual': 'raft_residual.csv', 'rigid': 'raft_rigid.csv',
        'loss_factor': 0.04}}],
    'rotor': {
        'shaft_height': 2.0, 'material': 'steel',
        'shaft': [{'length': 1.6, 'outer_diameter': 0.2, 'elements': 8}],
        'discs': [{'name': 'wheel', 'position': 1.6, 'mass': 320.0, 'diametral_inertia': 28.0,
                   'polar_inertia': 51.0}],
        'bearings': [{'name': 'fan_1_b1', 'position': 0.25, **STIFF},
                     {'name': 'fan_1_b2', 'position': 1.25, **STIFF}]},
    'unbalances': [{'disc': 'wheel', 'moment': 0.028}], 'speed_range_rpm': [300, 1800]}
FRAME = {
    **FAN, 'name': 'turbine', 'support': {'model': 'table', 'file': 'footing.csv'},
    'foundations': [{'name': 'frame', 'soil_under': 'each', 'flexible': {
        'stiffness': 'frame_K.mtx', 'mass': 'frame_M.mtx', 'dofs': 'frame_dofs.csv',
        'loss_factor': 0.04, 'keep_up_to': 9.0}}],
    'rotor': {**FAN['rotor'], 'shaft_height': 10.0,
              'shaft': [{'length': 15.0, 'outer_diameter': 0.5, 'elements': 15}],
              'bearings': [{'name': f'bearing_{number}', 'position': 5.0 * (number - 1), **STIFF}
                           for number in (1, 2, 3, 4)]},
    'speed_range_rpm': [100, 1200]}


FANS = {
    **{key: value for key, value in FAN.items() if key not in ('rotor', 'unbalances')},
    'name': 'fans', 'source': 'fan_1', 'machines': [{
        'name': f'fan_{number}', 'place': {'x': x, 'y': -0.75}, 'rated_rpm': 1480,
        'rotor': {**FAN['rotor'], 'bearings': [
            {**one, 'name': f'b{end}'} for end, one in enumerate(FAN['rotor']['bearings'], 1)]},
        'unbalances': FAN['unbalances']} for number, x in ((1, -3.0), (2, 3.0))]}


def table(path, springs):
    """Write springs and dashpots as a file of the support model `table`."""
    hertz = np.linspace(0.0, 180.0, 91)
    stiffness = springs.stiffness * (1.0 + 1j * springs.loss) + (
        1j * hz_to_rad_s(hertz)[:, None] * springs.damping)
    with path.open('w') as stream:
        out = csv.writer(stream)
        out.writerow(['hz', *(f'{dof}{dof}_{part}' for dof in DOFS for part in ('re', 'im'))])
        for place, row in zip(hertz.tolist(), stiffness, strict=True):
            out.writerow([place, *(value if np.isfinite(value) else ''
                                   for one in row for value in (one.real, one.imag))])


def write_cases(folder: Path) -> Path:
    """Fill a folder with the reference files, ground tables and the cases."""
    for file in REFERENCE.glob('[fr]*'):
        shutil.copy(file, folder)
    table(folder / 'footing.csv', FOOTING)
    table(folder / 'patch.csv', PATCH)
    for name, content in (('fan', FAN), ('frame', FRAME), ('fans', FANS)):
        (folder / f'{name}.yaml').write_text(yaml.safe_dump(content))
    return folder


def loaded(folder, name='fan', *settings):
    """Return a machine of the folder."""
    return Machine.load(folder / f'{name}.yaml', cache_directory=folder / 'cache',
                        overrides=settings)
