"""
Measure what several machines on one block cost: tables of every source, and criticals of one.

    python -m benchmarks.plant
"""

from pathlib import Path
import tempfile
import time

import numpy as np
import yaml

from rotorsoil_ros.case import document
from rotorsoil_ros.case.plant.together import Plant

HOUSE = Path(__file__).resolve().parents[1] / 'config' / 'fan_house.yaml'
MACHINES = (1, 2, 5, 10)
LOOKED_UP = 2000


def house_of(count: int, directory: Path) -> Path:
    """Write the example with so many of its fans, side by side on a block as wide as they need."""
    content = document.read(HOUSE)
    fan, half = content['machines'][0], 1.25 * count
    content['foundations'][0] |= {'half_width': half, 'mass': 23900.0 * count}
    content['machines'] = [fan | {
        'name': f'fan_{number}', 'place': {'x': 2.5 * number - half + 1.25, 'y': -0.2, 'z': 2.0},
    } for number in range(count)]
    path = directory / f'house_{count}.yaml'
    path.write_text(yaml.safe_dump(content), encoding='utf-8')
    (directory / 'plant_fan.yaml').write_text(
        (HOUSE.parent / 'plant_fan.yaml').read_text(encoding='utf-8'), encoding='utf-8')
    return path


def main() -> None:
    """Print, for some numbers of machines, what each source takes."""
    with tempfile.TemporaryDirectory() as name:
        directory = Path(name)
        for count in MACHINES:
            plant = Plant.load(house_of(count, directory), cache_directory=directory / 'cache')
            start = time.process_time()
            tables = [machine.table for machine in plant.machines.values()]
            built = (time.process_time() - start) / count
            machine = next(iter(plant.machines.values()))
            predictor = machine.table.predictor(machine.case.unbalance)
            speed = np.random.default_rng(0).uniform(*machine.table.speed_range, LOOKED_UP)
            start = time.process_time()
            for index in range(LOOKED_UP):
                predictor.predict(speed[index:index + 1])
            each = (time.process_time() - start) / LOOKED_UP
            start = time.process_time()
            machine.critical_speeds()
            criticals = time.process_time() - start
            size = sum(table.pieces.coefficients.nbytes for table in tables)
            print(f'{count:2d} machines, {len(machine.table.channels)} channels: {built:.3g} s of '
                  f'processor for the table of each, {size / 2**20:.3g} MiB for all, look-up '
                  f'{1e6 * each:.3g} us, critical speeds {criticals:.2g} s')


if __name__ == '__main__':
    main()
