"""How far discs are from rectangles, cones from discs, and a scaled nu from a solved one."""

import csv
from pathlib import Path

import numpy as np

from rotorsoil_ros.ground.cone import ConeModel
from rotorsoil_ros.ground.half_space import InfiniteElementModel
from rotorsoil_ros.ground.neighbours import on_soil
from rotorsoil_ros.ground.soil import Circle, Rectangle, Soil

RIGOROUS = Path(__file__).parents[1] / 'test' / 'reference' / 'contact' / 'rectangles.csv'
MOTIONS = ('xx', 'yy', 'zz', 'rxrx', 'ryry', 'rzrz')
HIGHEST = 3.81
SCALED = ((0.25, 0.30), (0.30, 0.35), (0.35, 0.40), (0.40, 0.45))


def main() -> None:
    """Print the largest error of every motion, in percent."""
    print('percent of the compliance'.ljust(34), *(f'{motion:>6}' for motion in MOTIONS))
    with RIGOROUS.open() as stream:
        rows = [row for row in csv.DictReader(stream)
                if row['contact'] == 'bonded' and float(row['eta']) == 0.0
                and float(row['a0']) <= HIGHEST]
    for ratio, nu in sorted({(row['L_over_B'], row['nu']) for row in rows}):
        chosen = [row for row in rows if (row['L_over_B'], row['nu']) == (ratio, nu)]
        a0 = np.array([float(row['a0']) for row in chosen])
        exact = np.array([[complex(float(row[f're_{motion}']), float(row[f'im_{motion}']))
                           for motion in MOTIONS] for row in chosen])
        soil, contact = Soil(1.0, float(nu), 1.0), Rectangle(1.0, float(ratio))
        elements = InfiniteElementModel.solved(
            soil, contact, 'disc', omega_min=0.0, omega_max=float(a0.max()))
        for name, model in (('disc', elements), ('cone', ConeModel(soil, contact))):
            tell(f'{name} for {ratio} to 1, nu {float(nu):.3g}', model.compliance(a0), exact)
    a0 = np.linspace(0.05, 5.0, 60)
    for before, after in SCALED:
        one, other = (InfiniteElementModel.solved(
            Soil(1.0, nu, 1.0, 0.1), Circle(1.0), 'disc', omega_min=0.0, omega_max=5.0)
            for nu in (before, after))
        exact = np.diagonal(other.compliance(a0), axis1=1, axis2=2)
        scaled = on_soil(one, other.soil, Circle(1.0)).compliance(a0)
        tell(f'nu {before:.2f} for {after:.2f}, a0 < 5', scaled, exact)
        tell(f'nu {before:.2f} for {after:.2f}, a0 < 2', scaled[a0 < 2.0], exact[a0 < 2.0])


def tell(name: str, found: np.ndarray, exact: np.ndarray) -> None:
    """Print the largest deviation of each motion."""
    error = np.abs(np.diagonal(found, axis1=1, axis2=2) / exact - 1.0).max(axis=0)
    print(name.ljust(34), *(f'{100.0 * each:6.1f}' for each in error))


if __name__ == '__main__':
    main()
