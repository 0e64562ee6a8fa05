"""How do machines come into memory: every table is computed once, and not in this process."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
import os
from pathlib import Path
import subprocess
import sys

import numpy as np

import rotorsoil_ros
from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case import cache, config, models
from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.half_space import a0_range, InfiniteElementModel
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.response import ResponseTable

UNITS = {
    'position': 'displacement, m or rad, zero-to-peak',
    'velocity': 'm/s or rad/s, zero-to-peak',
    'effort': 'transmitted force, N or N m, zero-to-peak',
    'phase': 'rad',
    'convention': 'x(t) = Re(X exp(+i omega t))',
}


@dataclass(frozen=True, slots=True)
class Machine:
    """A case with its models, its response table, and the cache where more of it may lie."""

    case: config.Case
    model: CoupledModel
    table: ResponseTable
    directory: Path

    @classmethod
    def load(
        cls, case_file: Path, *, cache_directory: Path | None, overrides: Sequence[str] = (),
    ) -> 'Machine':
        """Read a case and load its table, computing it where the cache has none."""
        case = config.load(case_file, overrides)
        directory = cache.directory(cache_directory)
        model = models.coupled_model(case, directory)
        return cls(case, model, models.response_table(case, model, directory), directory)

    def _compliance_keys(self) -> dict[str, str]:
        return {f'compliance of {foundation.name}': models.key_of(soil)
                for foundation, soil in zip(self.model.foundations, self.model.soil_models,
                                            strict=True)
                if isinstance(soil, InfiniteElementModel)}

    def description(self, name: str, unbalance: ComplexArray) -> Mapping[str, object]:
        """Return what the predictions under this name and this unbalance rest on."""
        return {
            'machine': name, 'case': self.case.name, 'version': rotorsoil_ros.__version__,
            'support': self.case.support.model,
            'tables': {'response': self.table.key, **self._compliance_keys()},
            'accuracy': self.table.accuracy,
            'speed_range_rad_s': list(self.table.speed_range),
            'gaps_rad_s': self.table.gaps.tolist(), 'channels': list(self.table.channels),
            'unbalance': {
                disc: {'moment_kg_m': float(np.abs(value)), 'phase_rad': float(np.angle(value))}
                for disc, value in zip(self.table.planes, unbalance, strict=True)},
            'units': UNITS,
        }


GLANCE_S = 0.05
BAD_INPUT = 2
SHARES = 4  # for each core: to start a process takes longer than one more table on known soil

# Stops at the first case that fails, and says which, as `rotorsoil tabulate` does.
WORK = """
import sys
from rotorsoil_ros.cli import main
for case in sys.argv[2:]:
    if status := main(['tabulate', case, '--cache', sys.argv[1]]):
        sys.exit(status)
"""

Tell = Callable[[str], object]


def load_all(
    files: Iterable[Path], *, cache_directory: Path | None, tell: Tell,
) -> dict[Path, Machine]:
    """
    Load case files, each once, and compute what the cache does not hold.

    Soils of one kind share a table, so that one case of each kind goes first. Several tables
    are computed by as many processes as there are cores.
    """
    cases = {file: config.load(file) for file in dict.fromkeys(files)}
    directory = cache.directory(cache_directory)
    kinds: dict[str, Path] = {}
    for file, case in cases.items():
        for key in soil_keys(case):
            if not Cache(directory).path('compliance', key).exists():
                kinds.setdefault(key, file)
    if len(cases) > 1:
        tabulate(list(dict.fromkeys(kinds.values())), directory, tell=tell)
        tabulate([file for file, case in cases.items() if not _is_tabulated(case, directory)],
                 directory, tell=tell)
    return {file: Machine.load(file, cache_directory=cache_directory) for file in cases}


def soil_keys(case: config.Case) -> list[str]:
    """Return what identifies the tables of infinite elements that a case needs."""
    geometry, soil = case.support.geometry, case.soil
    if case.support.model != 'infinite_elements' or soil is None:
        return []
    keys = []
    for foundation in case.foundations:
        low, high = config.infinite_range(soil, foundation.contact, geometry, case.speed_range)
        covered = a0_range(soil, foundation.contact, geometry, omega_min=low, omega_max=high)
        keys.append(models.compliance_key(soil, geometry, *covered))
    return keys


def reload(file: Path, *, cache_directory: Path | None) -> Machine:
    """
    Load a case file again, computed by another process if need be.

    Raises
    ------
    InputError
        If the case is wrong or cannot be solved.

    """
    directory = cache.directory(cache_directory)
    tabulate([file], directory, tell=lambda text: None)
    return Machine.load(file, cache_directory=cache_directory)


def tabulate(files: Sequence[Path], directory: Path, *, tell: Tell) -> None:
    """Compute the tables of cases in parallel processes, which leave them in the cache."""
    cores = os.cpu_count() or 1
    share = max(1, len(files) // (SHARES * cores))
    waiting = [files[start:start + share] for start in range(0, len(files), share)]
    running, done = list[tuple[Sequence[Path], subprocess.Popen[str]]](), 0
    try:
        while waiting or running:
            while waiting and len(running) < cores:
                running.append((waiting[0], _start(waiting.pop(0), directory)))
            for cases, process in list(running):
                if _has_ended(process):
                    running.remove((cases, process))
                    _judge(cases, process)
                    done += len(cases)
                    if len(files) > 1:
                        tell(f'{done} of {len(files)} tables computed: '
                             f'{", ".join(map(str, cases))}')
    finally:
        for _, process in running:
            process.kill()
            process.communicate()


def _start(files: Sequence[Path], directory: Path) -> 'subprocess.Popen[str]':
    return subprocess.Popen(
        [sys.executable, '-c', WORK, str(directory), *map(str, files)],
        stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
        env={**os.environ, 'OMP_NUM_THREADS': '1'})


def _has_ended(process: 'subprocess.Popen[str]') -> bool:
    try:
        process.wait(GLANCE_S)
    except subprocess.TimeoutExpired:
        return False
    return True


def _judge(files: Sequence[Path], process: 'subprocess.Popen[str]') -> None:
    """Raise InputError with what the process said if it failed."""
    _, said = process.communicate()
    if not process.returncode:
        return
    named = ', '.join(map(str, files))
    if process.returncode == BAD_INPUT:
        raise InputError(said.strip().splitlines()[-1] if said.strip() else f'{named}: failed')
    raise InputError(f'{named}: not computed (status {process.returncode})')


def _is_tabulated(case: config.Case, directory: Path) -> bool:
    key = models.response_key(case, models.coupled_model(case, directory))
    return Cache(directory).path('response', key).exists()
