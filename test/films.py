"""Tables of oil films that others computed or printed, and the bearings that they are of."""

from pathlib import Path

import numpy as np

from rotorsoil_ros.rotor.journal.geometry import JournalBearing

TABLES = Path(__file__).parent / 'reference' / 'bearing'
DOWN = np.array([0.0, -1.0])


def rows_of(name):
    """Return the rows of a table: S, eccentricity, attitude, four k, four c, three more."""
    return np.loadtxt(TABLES / f'{name}.csv', delimiter=',')


def bore(kind, slenderness, **more):
    """Return a bearing of some L / D; nothing else of its size matters here."""
    return JournalBearing(kind, 0.1, 0.1 * slenderness, 1e-4, **more)


OWN = {
    'plain_ld0.5': bore('plain', 0.5), 'plain_ld1': bore('plain', 1.0),
    'two_axial_ld0.5': bore('axial_groove', 0.5), 'two_axial_ld1': bore('axial_groove', 1.0),
    'lemon_m0.5_ld0.5': bore('elliptic', 0.5, preload=0.5),
}
