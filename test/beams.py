"""A free beam of finite elements, of which the frequencies are known in closed form."""

import numpy as np

LENGTH, YOUNG, DENSITY, SHEAR = 6.0, 3.0e10, 2400.0, 1.25e10
WIDTH, HEIGHT = 0.4, 0.6
AREA, POLAR = WIDTH * HEIGHT, 0.01
ABOUT_X, ABOUT_Z = WIDTH * HEIGHT**3 / 12.0, HEIGHT * WIDTH**3 / 12.0
# Free ends: cosh(b) cos(b) = 1.
ROOTS = (4.730040744862704, 7.853204624095838, 10.995607838001671)
AXES = ('x', 'y', 'z', 'rx', 'ry', 'rz')


def closed_form():
    """Return the elastic frequencies of bending, twist and stretching, rising [Hz]."""
    wave = np.sqrt(YOUNG / (DENSITY * AREA)) / LENGTH**2 / (2.0 * np.pi)
    found = [root**2 * np.sqrt(moment) * wave
             for root in ROOTS for moment in (ABOUT_X, ABOUT_Z)]
    for stiffness, inertia in ((SHEAR * POLAR, DENSITY * POLAR), (YOUNG * AREA, DENSITY * AREA)):
        found += [order / (2.0 * LENGTH) * np.sqrt(stiffness / inertia) for order in (1, 2, 3)]
    return np.sort(found)


def nodes(elements):
    """Return where the nodes are, along y."""
    return np.linspace(0.0, LENGTH, elements + 1)


def matrices(elements):
    """Return stiffness and mass over (x, y, z, rx, ry, rz) of every node, of slender elements."""
    size = 6 * (elements + 1)
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    step = LENGTH / elements
    bending = np.array([[12.0, 6 * step, -12.0, 6 * step],
                        [6 * step, 4 * step**2, -6 * step, 2 * step**2],
                        [-12.0, -6 * step, 12.0, -6 * step],
                        [6 * step, 2 * step**2, -6 * step, 4 * step**2]]) / step**3
    carried = np.array([[156.0, 22 * step, 54.0, -13 * step],
                        [22 * step, 4 * step**2, 13 * step, -3 * step**2],
                        [54.0, 13 * step, 156.0, -22 * step],
                        [-13 * step, -3 * step**2, -22 * step, 4 * step**2]]) * step / 420.0
    bar, heavy = np.array([[1.0, -1.0], [-1.0, 1.0]]) / step, np.array(
        [[2.0, 1.0], [1.0, 2.0]]) * step / 6.0
    for element in range(elements):
        near, far = 6 * element, 6 * element + 6
        # Along y a deflection w bends by w' = rx of z, and w' = -rz of x.
        for shift, turn, sign, moment in ((2, 3, 1.0, ABOUT_X), (0, 5, -1.0, ABOUT_Z)):
            rows = [near + shift, near + turn, far + shift, far + turn]
            signs = np.outer([1.0, sign, 1.0, sign], [1.0, sign, 1.0, sign])
            stiffness[np.ix_(rows, rows)] += YOUNG * moment * signs * bending
            mass[np.ix_(rows, rows)] += DENSITY * AREA * signs * carried
        for motion, elastic, inertia in ((1, YOUNG * AREA, DENSITY * AREA),
                                         (4, SHEAR * POLAR, DENSITY * POLAR)):
            rows = [near + motion, far + motion]
            stiffness[np.ix_(rows, rows)] += elastic * bar
            mass[np.ix_(rows, rows)] += inertia * heavy
    return stiffness, mass


def rigid(elements):
    """Return the rigid motion about the origin of every motion, (d, 6)."""
    found = []
    for y in nodes(elements):
        moves = np.eye(6)
        # u + theta x (0, y, 0) = u + (-rz y, 0, rx y).
        moves[0, 5], moves[2, 3] = -y, y
        found.append(moves)
    return np.concatenate(found)


def modes(elements):
    """Return elastic frequencies [Hz] and shapes of unit mass, (d, m)."""
    from scipy.linalg import eigh

    stiffness, mass = matrices(elements)
    squares, shapes = eigh(stiffness, mass)
    return np.sqrt(squares[6:]) / (2.0 * np.pi), shapes[:, 6:]
