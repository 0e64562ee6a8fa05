"""How do machines come into memory: every table is computed once, and not in this process."""

from collections.abc import Callable, Iterable, Sequence
from functools import partial
import os
from pathlib import Path

from rotorsoil_ros.background import Child, Children, run_as_child
from rotorsoil_ros.case import cache, config, models
from rotorsoil_ros.case.cache import Cache
from rotorsoil_ros.case.design import tables
from rotorsoil_ros.case.entries.ground import infinite_range, proportions, THIN_LAYERS
from rotorsoil_ros.case.entries.site import BOUNDARY_ELEMENTS, layered_site, site_of, site_reach
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.half_space import a0_range

TABLE_GLANCE_S = 0.05
SHARES = 4  # for each core: to start a process takes longer than one more table on known soil

Tell = Callable[[str], object]


def load_all(
    files: Iterable[Path], *, cache_directory: str | Path | None, tell: Tell,
) -> dict[Path, Machine]:
    """
    Load case files, each once, and compute what the cache does not hold.

    Soils of one kind share a table, so that one case of each kind goes first. Several tables
    are computed by as many processes as there are cores.
    """
    cases = cases_of(files, cache_directory=cache_directory)
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
    return {file: _complete(file, cache_directory) for file in cases}


def cases_of(
    files: Iterable[Path], *, cache_directory: str | Path | None,
) -> dict[Path, config.Case]:
    """Read case files, each once; raise InputError with all that is wrong with all of them."""
    cases, faults = dict[Path, config.Case](), list[str]()
    for file in dict.fromkeys(files):
        try:
            cases[file] = config.load(file, cache_directory=cache_directory)
        except InputError as error:
            faults += str(error).splitlines()
    if faults:
        # Machines of one file have its faults in common.
        raise InputError('\n'.join(dict.fromkeys(faults)))
    return cases


def soil_keys(case: config.Case) -> list[str]:
    """Return what identifies the tables of the ground that a case needs."""
    geometry, soil = case.support.geometry, case.soil
    if case.support.model == THIN_LAYERS and case.ground is not None:
        return [tables.layers_key(proportions(
            case.ground, block.contact, embedment, case.speed_range))
            for block, embedment in zip(case.foundations, case.embedments, strict=True)
            if block.on is None]
    if case.support.model == BOUNDARY_ELEMENTS and soil is not None:
        site = site_of(case.foundations, case.ground_probes)
        if case.ground is not None:
            return [tables.layered_site_key(layered_site(case.ground, site, case.speed_range))]
        return [tables.site_key(site.scaled(), soil.poisson_ratio, soil.loss_factor,
                                site_reach(site, soil, case.speed_range))]
    if case.support.model != 'infinite_elements' or soil is None:
        return []
    keys = []
    for foundation in case.foundations:
        if foundation.on is not None:
            continue
        low, high = infinite_range(soil, foundation.contact, geometry, case.speed_range)
        covered = a0_range(soil, foundation.contact, geometry, omega_min=low, omega_max=high)
        keys.append(tables.compliance_key(soil, geometry, *covered))
    return keys


def reload(
    files: Sequence[Path], *, cache_directory: str | Path | None,
) -> dict[Path, Machine]:
    """
    Load case files again, computed by other processes if need be.

    Raises
    ------
    InputError
        If a case is wrong or cannot be solved.

    """
    cases_of(files, cache_directory=cache_directory)  # what is wrong with them is told as it is
    tabulate(files, cache.directory(cache_directory), tell=lambda text: None)
    return {file: _complete(file, cache_directory) for file in files}


def _complete(file: Path, cache_directory: str | Path | None) -> Machine:
    """Return a machine with its table: a callback must not have to wait for it."""
    machine = Machine.load(file, cache_directory=cache_directory)
    _ = machine.table, machine.oils, machine.ground
    return machine


def tabulate(files: Sequence[Path], directory: Path, *, tell: Tell) -> None:
    """Compute the tables of cases in parallel processes, which leave them in the cache."""
    cores = os.cpu_count() or 1
    share = max(1, len(files) // (SHARES * cores))
    children, done = Children(at_once=cores), 0

    def finish(cases: Sequence[Path], child: Child) -> None:
        nonlocal done
        if child.failure:
            raise InputError(f'not computed: {child.failure}')
        done += len(cases)
        if len(files) > 1:
            tell(f'{done} of {len(files)} tables computed: {", ".join(map(str, cases))}')

    for start in range(0, len(files), share):
        cases = files[start:start + share]
        children.ask(str(start), partial(
            Child, __name__, [str(directory), *map(str, cases)]), partial(finish, cases))
    try:
        while not children.are_done:
            children.step(wait_s=TABLE_GLANCE_S)
    finally:
        children.close()


def _compute(arguments: Sequence[str]) -> None:
    """Leave the tables of cases in a cache; stop at the first that fails."""
    directory, *files = arguments
    for file in files:
        _complete(Path(file), Path(directory))


def _is_tabulated(case: config.Case, directory: Path) -> bool:
    key = models.response_key(case, models.coupled_model(case, directory))
    return Cache(directory).path('response', key).exists()


if __name__ == '__main__':
    run_as_child(_compute)
