"""
The same rotor in ROSS: prints processor seconds and amplitudes as JSON, for benchmarks.rotor.

It runs in an interpreter that has ROSS, `python -m benchmarks.ross_rotor`, and knows nothing of
this package: bearings stand on one block that is carried by the springs and dashpots of the soil.
"""

from collections.abc import Callable
import json
import math
import os
import sys

os.environ['OMP_NUM_THREADS'] = '1'

import time
from typing import Any


def seconds(call: Callable[[], object], runs: int) -> float:
    """Return the shortest processor time of a call."""
    shortest = math.inf
    for _ in range(runs):
        start = time.process_time()
        call()
        shortest = min(shortest, time.process_time() - start)
    return shortest


def rotor(given: dict[str, Any]) -> Any:
    """Return the rotor as an object of ROSS."""
    import ross

    steel = ross.Material('steel', rho=given['density'], E=given['young_modulus'],
                          Poisson=given['poisson_ratio'])
    lengths = given['lengths']
    shaft = [ross.ShaftElement(length, 0.0, given['diameter'], material=steel, n=node)
             for node, length in enumerate(lengths)]
    block = len(lengths) + 1
    discs = [ross.DiskElement(disc['node'], disc['mass'], disc['diametral'], disc['polar'])
             for disc in given['discs']]
    bearings = [ross.BearingElement(node, kxx=given['stiffness'], cxx=given['damping'],
                                    n_link=block) for node in given['bearings']]
    soil = ross.BearingElement(
        block, kxx=given['soil_k_x'], kyy=given['soil_k_z'], cxx=given['soil_c_x'],
        cyy=given['soil_c_z'], frequency=given['speed'])
    mass = ross.PointMass(block, m=given['block_mass'])
    return ross.Rotor(shaft, discs, [*bearings, soil], [mass])


def main() -> None:
    """Measure what standard input describes."""
    import numpy as np
    import ross

    given = json.load(sys.stdin)
    speed = np.array(given['speed'])
    disc, moment = given['discs'][0]['node'], given['unbalance']

    def respond(model: Any) -> Any:
        return model.run_unbalance_response([disc], [moment], [0.0], frequency=speed)

    model = rotor(given)
    response = respond(model).forced_resp
    found = {
        'version': ross.__version__,
        'warm': seconds(lambda: respond(model), 3),
        'cold': seconds(lambda: respond(rotor(given)), 2),
        'campbell': seconds(lambda: model.run_campbell(
            np.array(given['campbell']), frequencies=given['modes']), 1),
        'amplitude_x': np.abs(response[model.number_dof * disc]).tolist(),
    }
    print(f'\n{json.dumps(found)}')  # on a line of its own: ROSS prints what it likes


if __name__ == '__main__':
    main()
