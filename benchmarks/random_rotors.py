"""
How far are loads, damping and seals of shafts from those of ROSS? Random rotors, both ways.

`python -m benchmarks.random_rotors --count N`, with ROSS in `ROSS_PYTHON` or installed here. ROSS
builds each rotor and saves it; `import-ross` brings it over. Eigenvalues and the response to
unbalance are held beside each other, with what both take is not: see `benchmarks.rotor`.
"""

import argparse
import json
import os
from pathlib import Path
import subprocess
import sys
import tempfile

import numpy as np

from rotorsoil_ros.case import models
from rotorsoil_ros.case.config import load
from rotorsoil_ros.cli import main as rotorsoil
from rotorsoil_ros.machine.modes.campbell import campbell

from benchmarks.ross_random import SPEEDS

ROOT = Path(__file__).parents[1]
MODES = 6


def deviations(directory: Path, number: int) -> tuple[float, float]:
    """Return the largest relative deviation of an eigenvalue, and of a response."""
    case = directory / f'{number}.yaml'
    if rotorsoil(['import-ross', str(directory / f'{number}.toml'), '-o', str(case)]):
        raise SystemExit(f'{number}.toml is not brought over')
    model = models.coupled_model(load(case), directory)
    theirs = json.loads((directory / f'{number}.json').read_text())
    values = np.array(theirs['eigenvalues']) @ [1.0, 1j]
    found = campbell(model, np.array([SPEEDS[2]]), MODES).eigenvalue[0]
    apart = np.abs(found[:, None] - values).min(axis=1) / np.abs(found)
    # ROSS has x to the other side; its phase 0 is our -pi/2.
    planes = list(model.planes)
    unbalance = np.zeros(len(planes), dtype=complex)
    unbalance[planes.index(theirs['disc'])] = -1e-4j
    motion = model.unbalance_response(np.array(SPEEDS), unbalance).displacement
    first = model.channels.index(f'{theirs["disc"]}_x')
    ours = motion[:, first:first + 2] * [-1.0, 1.0]
    expected = np.array(theirs['response']) @ [1.0, 1j]
    scale = np.abs(expected).max(axis=1, keepdims=True)
    return float(apart.max()), float((np.abs(ours - expected) / scale).max())


def main() -> None:
    """Compare and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--count', type=int, default=20)
    count = parser.parse_args().count
    python = os.environ.get('ROSS_PYTHON', sys.executable)
    if subprocess.run([python, '-c', 'import ross'], capture_output=True, check=False).returncode:
        print('ROSS: not installed here or at ROSS_PYTHON, so not compared')
        return
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([python, '-m', 'benchmarks.ross_random', folder, str(count)], cwd=ROOT,
                       capture_output=True, check=True)
        directory = Path(folder)
        found = np.array([deviations(directory, number) for number in range(count)])
        version = json.loads((directory / '0.json').read_text())['version']
    for what, worst in zip(('eigenvalues', 'responses'), found.max(axis=0), strict=True):
        print(f'{count} random rotors beside ROSS {version}, {what}: within {worst:.1e}')


if __name__ == '__main__':
    main()
