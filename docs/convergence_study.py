"""
Measure how the finite and infinite elements converge, and write docs/convergence.md.

Every number and picture of that page comes from this command (three minutes on one core):

    python docs/convergence_study.py
"""

import os

os.environ['OMP_NUM_THREADS'] = '1'  # before numpy: small solves are slower with two threads

import csv
from dataclasses import replace
import math
from pathlib import Path

import matplotlib as mpl

mpl.use('Agg')

import matplotlib.pyplot as plt
import numpy as np

from rotorsoil_ros.errors import NotSolvedError
from rotorsoil_ros.ground.elements.mesh import Discretisation, discretisation_for
from rotorsoil_ros.ground.elements.table import entries_of, error_scale
from rotorsoil_ros.ground.elements.tabulate import exact_compliance, tabulate

HERE = Path(__file__).resolve().parent
REFERENCE = HERE.parent / 'test' / 'reference' / 'soil'
PICTURES = HERE / 'pictures'
PAGE_FILE = HERE / 'convergence.md'

# Sixteen elements around the edge, 14 rings of ratio 1/2, cells half as large and a wider box.
CONVERGED = Discretisation(cell=0.1, width=1.8, depth=1.4, rings=14, ring_ratio=0.5,
                           cells_beside_edge=4)
A0 = np.array([0.05, 0.2, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
LABELS = {'xx': 'sway', 'zz': 'heave', 'ryry': 'rocking', 'xry': 'coupling', 'rzrz': 'twist'}
FILES = {
    'disk_bonded_nu0.25_eta0.00.csv': ('disc', 0.0),
    'disk_bonded_nu0.25_eta0.10.csv': ('disc', 0.1),
    'strip_planestrain_bonded_nu0.25_eta0.00.csv': ('plane_strain', 0.0),
    'strip_planestrain_bonded_nu0.25_eta0.10.csv': ('plane_strain', 0.1),
    'strip_planestress_bonded_nu0.25_eta0.10.csv': ('plane_stress', 0.1),
}
QUANTITIES = {'disc': ('Fh', 'Fv', 'Fr', 'Fhr', 'Ft')}
STRIP_QUANTITIES = ('Fxx', 'Fzz', 'Frr', 'Fxr')

PAGE = """\
# How the infinite elements converge

Written by `python docs/convergence_study.py`; do not edit. Errors are |F / F_ref - 1| of the
complex dimensionless compliance in per cent, the coupling's over the geometric mean of its two
diagonals. The worst over all frequencies of a row is shown. Functions, mesh and quadrature are
described in `ground/elements/rays.py`, `mesh.py` and `solver.py`, and in the
[theory manual](theory/infinite_elements.md).

## Against the rigorous half-space

The whole way, table and interpolation included, against the wavenumber solutions in
`test/reference/soil` at all their frequencies, a0 = 0.05 to 6 (they are good to 0.02 %).

{rigorous}

## Against closed forms

Static limits at a0 = 0.005 without damping: welded heave of the disc 4 ln(3 - 4 nu) / (1 - 2 nu)
(Mossakovskii), twist 16 / 3 (Reissner-Sagoci), welded rocking of the strip
2 pi (1 + 4 e^2) / (4 - 4 nu) with e = ln(3 - 4 nu) / 2 pi (Muskhelishvili), and the loss
(1 - nu) / 2 of a strip in sway and heave. The mesh is always a little too stiff.

{static}

## Against a converged mesh, for other soils

Tables as users get them against direct solves with a cell half as large, sixteen instead of
eight elements around the edge, 14 rings, and a wider box. That mesh itself agrees with the
rigorous solution to {converged}.

{soils}

## Beyond the promised range

Worst error against finer meshes (cell x a0 <= 0.9), eta = 0.05. Up to a0 = 20 the cells shrink
with a0; nu = 0.49 is limited by displacement elements that begin to lock.

{extremes}

## What each choice buys

![mesh](pictures/convergence_mesh.png)

Left: cells, with everything else converged; the error falls with the fourth to fifth power of
the cell. The chosen one is 0.2 up to a0 = 6.5. Right: rings around the contact
edge, nu = 0.25, a0 = 1. The singularity r^(1/2 +- i e) of a welded edge makes the error
proportional to the smallest element; 5 rings of ratio 0.4 are chosen.

![near field](pictures/convergence_near_field.png)

Width of the near field and number of functions, disc, nu = 0.45. One order is P + S + Rayleigh,
each further order adds the three waves once more with the next power of r. Rays start from the
centre of the contact and the powers are those of r itself; with that, three orders need a near
field of only 1.4 x 1.0. At low frequency the price of a smaller near field is paid in radiation
damping first: right, the loss of a rocking disc over its exact limit.

![functions](pictures/convergence_functions.png)

Error of the compliance over frequency for one, two and three orders on the chosen near field,
against three orders on a near field twice as wide with the same cells; so no mesh error is seen.

## What was chosen, and over what

Measured on the way, disc, nu = 0.25, near field 1.6 x 1.6, worst term:

* Rays from the centre with powers of r / r_j instead of a fan that starts horizontal with powers
  of 1 + xi / R: 0.06 instead of 0.15 % at a0 = 0.005 with 6 functions, 0.14 instead of 0.33 %
  with 5; the spurious loss of slow rocking and twist falls by a factor of 10 to 100.
* The next order of the Rayleigh wave, not only of P and S: 0.16 instead of 0.32 % at a0 = 0.005
  when R and S get a second order in place of P and S.
* Rings around the edge instead of grid lines through the whole near field: with 3 400 unknowns
  in all three classes rocking is good to 0.06 %, where 4 700 in two classes gave 0.3 %.
* An orthonormal basis of the waves on each ray, by QR: the residual of the system for arbitrary
  loads falls from 10 to 1e-12, no pivoting is needed (half the fill at low frequency), and a
  singular system can be told from a good one.
* Common poles for all terms and data mirrored by f(conj s) = conj f(s): 12 to 18 solves for
  1e-5, where one fit per term on real frequencies needs about 20.

## Interpolation

![interpolation](pictures/convergence_interpolation.png)

Error of the tables at 60 frequencies that they have not seen, over a0, and the number of solves.
Each is stopped by three or more unseen frequencies within 1e-4.

{interpolation}
"""


def relative_error(values, reference):
    """Return errors in per cent over the diagonals, (n, q)."""
    return 100.0 * np.abs(values - reference) / error_scale(reference)


def row(*cells):
    """Return a line of a Markdown table; floats are per cent."""
    return '| ' + ' | '.join(
        f'{cell:.3f}' if isinstance(cell, float) else str(cell) for cell in cells) + ' |'


def table(head, rows):
    """Return a Markdown table."""
    return '\n'.join([row(*head), row(*['---'] * len(head)), *rows])


def by_term(error, geometry):
    """Return the worst error of every term; a strip has no twist."""
    worst = dict(zip(entries_of(geometry), error.max(axis=0), strict=True))
    return [float(worst[name]) if name in worst else '' for name in LABELS]


def read_reference(name, geometry):
    """Return a0 and the rigorous compliances, (n,) and (n, q)."""
    names = QUANTITIES.get(geometry, STRIP_QUANTITIES)
    columns = {quantity: [] for quantity in names}
    a0 = []
    with (REFERENCE / name).open() as stream:
        for quantity, frequency, real, imaginary in csv.reader(
                line for line in stream if line.startswith('F')):
            columns[quantity].append(complex(float(real), float(imaginary)))
            if quantity == names[0]:
                a0.append(float(frequency))
    return np.array(a0), np.array([columns[quantity] for quantity in names]).T


def rigorous(references):
    """Compare tables, and the converged mesh, with the rigorous solutions by file name."""
    head = ('case', 'eta', *LABELS.values())
    rows, converged = [], 0.0
    for name, (geometry, loss_factor) in FILES.items():
        a0, reference = references[name]
        kind = {'poisson_ratio': 0.25, 'loss_factor': loss_factor}
        made = tabulate(geometry, **kind)
        rows.append(row(f'{geometry}, nu = 0.25', loss_factor, *by_term(
            relative_error(made.compliance(a0), reference), geometry)))
        few = slice(None, None, 12)
        best = exact_compliance(a0[few], geometry=geometry, discretisation=CONVERGED, **kind)
        converged = max(converged, relative_error(best, reference[few]).max())
    return table(head, rows), f'{converged:.3f} %'


def static():
    """Compare slow motion with closed forms."""
    slow = np.array([0.005])
    rows = []
    for nu in (0.0, 0.25, 0.4, 0.45, 0.49):
        disc, strip = (
            exact_compliance(slow, geometry=geometry, poisson_ratio=nu, loss_factor=0.0)[0]
            for geometry in ('disc', 'plane_strain'))
        kappa = 3.0 - 4.0 * nu
        oscillation = math.log(kappa) / (2.0 * math.pi)
        pairs = (
            (disc[1].real, (1.0 - 2.0 * nu) / (4.0 * math.log(kappa))),
            (disc[4].real, 3.0 / 16.0),
            (strip[2].real, (kappa + 1.0) / (2.0 * math.pi * (1.0 + 4.0 * oscillation**2))),
            (-strip[0].imag, (1.0 - nu) / 2.0), (-strip[1].imag, (1.0 - nu) / 2.0))
        rows.append(row(nu, *(100.0 * abs(got / exact - 1.0) for got, exact in pairs)))
    return table(('nu', 'heave of the disc', 'twist', 'rocking of the strip', 'loss in sway',
                  'loss in heave'), rows)


def soils():
    """Compare tables of other soils with a converged mesh."""
    rows = []
    for geometry in ('disc', 'plane_strain'):
        for nu in (0.0, 0.2, 0.4, 0.45, 0.49):
            for eta in (0.0, 0.2):
                kind = {'poisson_ratio': nu, 'loss_factor': eta}
                made = tabulate(geometry, **kind)
                best = exact_compliance(A0, geometry=geometry, discretisation=CONVERGED, **kind)
                rows.append(row(geometry, nu, eta, *by_term(
                    relative_error(made.compliance(A0), best), geometry)))
    return table(('geometry', 'nu', 'eta', *LABELS.values()), rows)


def extremes():
    """Compare the corners of what works with finer meshes."""
    rows = []
    for geometry in ('disc', 'plane_strain'):
        for nu, a0 in ((0.25, (0.005, 0.01, 0.03)), (0.49, (0.005, 0.01, 0.03)),
                       (0.25, (8.0, 12.0)), (0.45, (8.0, 12.0)),
                       (0.25, (16.0, 20.0)), (0.45, (16.0, 20.0)), (0.49, (16.0, 20.0))):
            frequencies = np.array(a0)
            mesh = discretisation_for(*((a0[0], 6.0) if a0[0] < 1.0 else (0.05, a0[-1])))
            fine = Discretisation(
                cell=min(0.1, 0.9 / a0[-1]), width=2.4 if a0[0] < 1.0 else 1.5,
                depth=2.0 if a0[0] < 1.0 else 1.1, rings=10, ring_ratio=0.5,
                cells_beside_edge=4)
            solved, best = (
                exact_compliance(frequencies, geometry=geometry, poisson_ratio=nu,
                                 loss_factor=0.05, discretisation=choice)
                for choice in (mesh, fine))
            rows.append(row(geometry, nu, f'{a0[0]:g} to {a0[-1]:g}', *by_term(
                relative_error(solved, best), geometry)))
    return table(('geometry', 'nu', 'a0', *LABELS.values()), rows)


def solve(a0, discretisation, nu):
    """Return compliances of the undamped disc."""
    return exact_compliance(a0, geometry='disc', poisson_ratio=nu, loss_factor=0.0,
                            discretisation=discretisation)


def picture_mesh():
    """Show the error over cell size and over rings."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10.0, 4.0), constrained_layout=True)
    a0 = np.array([1.0, 3.0, 6.0])
    best = solve(a0, CONVERGED, 0.25)
    cells = {1: 0.4, 2: 0.2, 3: 0.4 / 3.0}
    errors = np.array([relative_error(solve(a0, replace(
        CONVERGED, cell=cell, cells_beside_edge=count), 0.25), best).max(axis=1)
        for count, cell in cells.items()])
    for index, frequency in enumerate(a0):
        left.loglog(list(cells.values()), errors[:, index], 'o-', label=f'a0 = {frequency:g}')
    left.set(xlabel='cell / r', ylabel='worst error of the five terms [%]', title='cells')
    left.legend()
    rings = np.arange(9)
    a0 = np.array([1.0])
    best = solve(a0, CONVERGED, 0.25)
    errors = np.array([relative_error(solve(a0, replace(
        CONVERGED, rings=int(count), ring_ratio=0.4), 0.25), best)[0] for count in rings])
    for name, error in zip(LABELS.values(), errors.T, strict=True):
        right.semilogy(rings, error, 'o-', label=name)
    right.axvline(5, color='grey', linewidth=0.8)
    right.set(xlabel='rings of ratio 0.4', ylabel='error [%]', title='contact edge')
    right.legend()
    figure.savefig(PICTURES / 'convergence_mesh.png', dpi=110)
    plt.close(figure)


def picture_near_field():
    """Show the error over the width of the near field, for several numbers of functions."""
    figure, axes = plt.subplots(1, 3, figsize=(13.0, 4.0), constrained_layout=True)
    widths = np.array([1.4, 1.6, 1.8, 2.2, 2.6])
    a0 = np.array([0.05, 0.5])
    wide = Discretisation(cell=0.2, width=3.0, depth=2.6)
    best = solve(a0, wide, 0.45)
    for orders in (1, 2, 3):
        solved = np.array([solve(a0, replace(
            wide, width=float(width), depth=float(width) - 0.4, orders=orders), 0.45)
            for width in widths])
        for axis, index in ((axes[0], 0), (axes[1], 1)):
            error = [relative_error(values[index:index + 1], best[index:index + 1]).max()
                     for values in solved]
            axis.semilogy(widths, error, 'o-', label=f'{3 * orders} functions')
        axes[2].plot(widths, solved[:, 0, 2].imag / best[0, 2].imag, 'o-',
                     label=f'{3 * orders} functions')
    for axis, frequency in zip(axes[:2], a0, strict=True):
        axis.set(xlabel='width / r', ylabel='worst error [%]', title=f'a0 = {frequency:g}')
    axes[2].set(xlabel='width / r', ylim=(-4.0, 2.0), ylabel='loss over its limit',
                title='radiation of rocking, a0 = 0.05')
    axes[2].axhline(1.0, color='grey', linewidth=0.8)
    for axis in axes:
        axis.axvline(1.4, color='grey', linewidth=0.8)
        axis.legend()
    figure.savefig(PICTURES / 'convergence_near_field.png', dpi=110)
    plt.close(figure)


def picture_functions():
    """Show the error of the far field over frequency."""
    figure, axis = plt.subplots(figsize=(6.5, 4.0), constrained_layout=True)
    a0 = np.geomspace(0.02, 6.0, 14)
    wide = solve(a0, Discretisation(cell=0.2, width=2.8, depth=2.0), 0.25)
    for orders in (1, 2, 3):
        chosen = Discretisation(cell=0.2, width=1.4, depth=1.0, orders=orders)
        axis.loglog(a0, relative_error(solve(a0, chosen, 0.25), wide).max(axis=1), 'o-',
                    label=f'{3 * orders} functions')
    axis.set(xlabel='a0', ylabel='worst change of the five terms [%]')
    axis.legend()
    figure.savefig(PICTURES / 'convergence_functions.png', dpi=110)
    plt.close(figure)


def interpolation():
    """Show and list the error of tables at unseen frequencies."""
    figure, axis = plt.subplots(figsize=(6.5, 4.0), constrained_layout=True)
    rows = []
    for geometry, nu, eta in (('disc', 0.0, 0.0), ('disc', 0.31, 0.07), ('disc', 0.45, 0.2),
                              ('plane_strain', 0.0, 0.0), ('plane_strain', 0.31, 0.07),
                              ('plane_strain', 0.45, 0.2)):
        kind = {'poisson_ratio': nu, 'loss_factor': eta}
        made = tabulate(geometry, **kind)
        unseen = np.linspace(math.sqrt(0.05), math.sqrt(6.0), 62)[1:-1] ** 2
        solved = exact_compliance(unseen, geometry=geometry,
                                  discretisation=discretisation_for(0.05, 6.0), **kind)
        error = np.abs(made.compliance(unseen) - solved) / error_scale(solved)
        axis.loglog(unseen, error.max(axis=1), label=f'{geometry}, nu {nu:g}, eta {eta:g}')
        rows.append(row(geometry, nu, eta, made.solves, f'{made.measured_error:.1e}',
                        f'{error.max():.1e}'))
    axis.set(xlabel='a0', ylabel='error of the interpolation [-]')
    axis.legend(fontsize='small')
    figure.savefig(PICTURES / 'convergence_interpolation.png', dpi=110)
    plt.close(figure)
    return table(('geometry', 'nu', 'eta', 'solves', 'reported error', 'true worst error'), rows)


def main():
    """Write the page and its pictures."""
    try:
        references = {name: read_reference(name, geometry)
                      for name, (geometry, _) in FILES.items()}
    except FileNotFoundError as error:
        raise SystemExit(f'{error.filename}: not there, so {PAGE_FILE.name} is not written'
                         ) from error
    PICTURES.mkdir(exist_ok=True)
    against_rigorous, converged = rigorous(references)
    picture_mesh()
    picture_near_field()
    picture_functions()
    PAGE_FILE.write_text(PAGE.format(
        rigorous=against_rigorous, converged=converged, static=static(), soils=soils(),
        extremes=extremes(), interpolation=interpolation()))


if __name__ == '__main__':
    try:
        main()
    except NotSolvedError as error:
        raise SystemExit(f'the study did not converge: {error}') from error
