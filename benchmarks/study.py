"""
Time a study: a variant of a machine, from its values to its response, and in two processes.

    python -m benchmarks.study

Processor time of one process beside a loop that loads and asks each case by itself.
"""

from pathlib import Path
import tempfile

import numpy as np

import rotorsoil_ros as rs

from benchmarks.ross_rotor import seconds

CASE = Path(__file__).resolve().parents[1] / 'config' / 'plant_fan.yaml'
KEY, VALUES = 'soil.shear_modulus', np.linspace(30e6, 120e6, 100)


def main() -> None:
    """Measure and print."""
    with tempfile.TemporaryDirectory() as name:
        for model in ('cone', 'infinite_elements'):
            machine = rs.load(CASE, cache_directory=Path(name), support={'model': model})
            machine.response(rpm=990.0)  # fills the cache

            def loop(model: str = model) -> None:
                for value in VALUES:
                    rs.load(CASE, cache_directory=Path(name), support={'model': model},
                            **{KEY: float(value)}).response(rpm=990.0)

            alone = seconds(loop, 2) / len(VALUES)
            each = seconds(lambda machine=machine: rs.study(
                machine, {KEY: VALUES}, rpm=990.0), 2) / len(VALUES)
            print(f'{model}: {1e3 * each:.2f} ms a variant, loaded one by one '
                  f'{1e3 * alone:.2f} ms')


if __name__ == '__main__':
    main()
