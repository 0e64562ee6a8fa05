"""
Random rotors with loads, damping and seals, by ROSS: saved, and what ROSS says of them.

It runs in an interpreter that has ROSS, `python -m benchmarks.ross_random DIRECTORY COUNT`, and
knows nothing of this package: `python -m benchmarks.random_rotors` reads what it leaves.
"""

import json
from pathlib import Path
import sys
from typing import Any

SPEEDS = [60.0, 150.0, 300.0, 520.0, 800.0]


def rotor(rng: Any) -> Any:
    """Return one: axial force, torque, alpha and beta of every element, bearings, a seal."""
    import ross

    steel = ross.Material('steel', rho=7810.0, E=2.11e11, G_s=8.12e10)
    count = int(rng.integers(5, 12))
    shaft = []
    for node in range(count):
        outer = round(float(rng.uniform(0.04, 0.09)), 4)
        shaft.append(ross.ShaftElement(
            L=round(float(rng.uniform(0.08, 0.2)), 3), idl=0.0, odl=outer, idr=0.0,
            odr=round(outer * float(rng.uniform(0.9, 1.1)), 4), material=steel, n=node,
            axial_force=float(rng.uniform(-2e4, 5e4)), torque=float(rng.uniform(-2e3, 2e3)),
            alpha=float(rng.uniform(0.0, 2.0)), beta=float(rng.uniform(0.0, 1e-5))))
    discs = [ross.DiskElement(n=int(node), m=float(rng.uniform(3.0, 25.0)), Id=0.1, Ip=0.17,
                              tag=f'disc_{node}')
             for node in rng.choice(range(1, count), 2, replace=False)]

    def coupled(kind: Any, node: int, size: float, **more: Any) -> Any:
        return kind(n=node, kxx=size * rng.uniform(0.5, 1.5), kyy=size * rng.uniform(0.5, 1.5),
                    kxy=0.1 * size * rng.normal(), kyx=0.1 * size * rng.normal(),
                    cxx=2e3 * rng.uniform(0.5, 1.5), cyy=2e3 * rng.uniform(0.5, 1.5), **more)

    seal = coupled(ross.SealElement, count // 2, 5e5, mxx=float(rng.uniform(1.0, 15.0)),
                   myy=float(rng.uniform(1.0, 15.0)), mxy=float(rng.normal()),
                   myx=float(rng.normal()))
    return ross.Rotor(shaft, discs, [coupled(ross.BearingElement, 0, 2e7),
                                     coupled(ross.BearingElement, count, 2e7), seal])


def main() -> None:
    """Save rotors and what ROSS says of them."""
    import numpy as np
    import ross
    import scipy.linalg

    directory, count = Path(sys.argv[1]), int(sys.argv[2])
    rng = np.random.default_rng(14)
    for number in range(count):
        model = rotor(rng)
        model.save(directory / f'{number}.toml')
        across = [dof for dof in range(model.ndof) if dof % 6 not in (2, 5)]
        place = np.ix_(across, across)
        speed = SPEEDS[2]
        mass, stiffness, damping, gyroscopic = (
            part[place] for part in (model.M(speed), model.K(speed), model.C(speed), model.G()))
        size = len(mass)
        values = scipy.linalg.eigvals(np.block([
            [np.zeros((size, size)), np.eye(size)],
            [-scipy.linalg.solve(mass, stiffness),
             -scipy.linalg.solve(mass, damping + speed * gyroscopic)]]))
        response = model.run_unbalance_response(
            [model.disk_elements[0].n], [1e-4], [0.0], np.array(SPEEDS)).forced_resp
        node = 6 * model.disk_elements[0].n
        (directory / f'{number}.json').write_text(json.dumps({
            'version': ross.__version__, 'disc': model.disk_elements[0].tag,
            'eigenvalues': [[float(one.real), float(one.imag)] for one in values],
            'response': [[[float(one.real), float(one.imag)] for one in row]
                         for row in response[node:node + 2].T]}))


if __name__ == '__main__':
    main()
