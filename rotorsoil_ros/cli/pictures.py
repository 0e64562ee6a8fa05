"""Every picture of a case."""

from argparse import Namespace

from rotorsoil_ros.case import cache
from rotorsoil_ros.case.config import load
from rotorsoil_ros.case.plots import all_figures
from rotorsoil_ros.cli.progress import progress


def plot(arguments: Namespace) -> int:
    """Write one PNG for each picture and print its name."""
    case = load(arguments.case, arguments.overrides)
    arguments.output.mkdir(parents=True, exist_ok=True)
    with progress('drawing') as _:
        table = cache.response_table(case, cache.directory(arguments.cache))
        for name, figure in all_figures(case, table):
            path = arguments.output / f'{name}.png'
            figure.savefig(path, dpi=150)
            print(path)
    return 0
