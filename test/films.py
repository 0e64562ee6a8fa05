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

# A small machine on films of ISO VG 46, with tables of three temperatures besides its own.
OIL_CASE = """
name: oiled
support: {model: rigid}
rotor:
  shaft_height: 1.0
  material: steel
  shaft: [{length: 1.2, outer_diameter: 0.08, elements: 6}]
  discs:
    - {name: wheel, position: 0.6, mass: 114.4, diametral_inertia: 1.5, polar_inertia: 2.5}
  bearings:
    - name: left
      position: 0.1
      journal: &halves
        {type: axial_groove, diameter: 0.08, length: 0.04, radial_clearance: 80.0e-6,
         oil: {grade: 46, temperature: 50.0}}
    - {name: right, position: 1.1, journal: *halves}
  oil_temperatures: [40.0, 60.0, 80.0]
unbalances: [{disc: wheel, moment: 1.0e-3}]
speed_range_rpm: [1500, 3000]
"""
