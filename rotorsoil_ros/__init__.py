"""
What a rotor on real soil should vibrate like: an engine, and a ROS 2 node.

    import rotorsoil_ros as rs

    machine = rs.load('plant_fan.yaml')
    run = machine.response(rpm=range(300, 1800, 5))
    run['drive_end_housing_x'].velocity_mm_s_rms()

The names of `__all__` are public; each is imported when it is first asked for, so that a
program pays only for what it uses.

Conventions
-----------
Every amplitude is complex and zero-to-peak: x(t) = Re(X exp(+i omega t)).
Axes: x horizontal and lateral, y along the shaft, z up; positive spin takes z into x.
A rotor node has the degrees of freedom (x, z, rx, rz); a block and its contact have
(x, y, z, rx, ry, rz) at the contact centre.
Inside the package everything is SI and rad/s; names of user-facing keys say their unit.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rotorsoil_ros.bags.archive import predict_many, Record
    from rotorsoil_ros.bags.comparison import compare, Wish
    from rotorsoil_ros.bags.profile import read_profile
    from rotorsoil_ros.bags.tables.exported import export_log
    from rotorsoil_ros.bags.tables.imported import import_table, ImportedTable
    from rotorsoil_ros.case.design.report import DesignReport
    from rotorsoil_ros.case.design.variants import Study, study
    from rotorsoil_ros.case.flexible.files import read_flexible
    from rotorsoil_ros.case.journal_entries import BearingStates
    from rotorsoil_ros.case.machine import load, Machine
    from rotorsoil_ros.case.plant.together import Plant, Shaken
    from rotorsoil_ros.channel import Channel
    from rotorsoil_ros.errors import InputError, NotSolvedError, OutOfTableError, RotorSoilError
    from rotorsoil_ros.ground.boundary.layered_model import LayeredSiteModel
    from rotorsoil_ros.ground.boundary.model import BoundaryElementModel
    from rotorsoil_ros.ground.boundary.site import Site
    from rotorsoil_ros.ground.cone import ConeModel
    from rotorsoil_ros.ground.embedded_cone import EmbeddedConeModel
    from rotorsoil_ros.ground.half_space import InfiniteElementModel
    from rotorsoil_ros.ground.layers.model import ThinLayerModel
    from rotorsoil_ros.ground.layers.profile import Embedment, Layer, LayeredSoil
    from rotorsoil_ros.ground.plan import Part, Plan
    from rotorsoil_ros.ground.soil import Circle, Rectangle, RigidSoil, Soil, SoilModel
    from rotorsoil_ros.ground.table import ComplianceTable
    from rotorsoil_ros.machine.coupled import CoupledModel
    from rotorsoil_ros.machine.damping import DampingSplit, DampingSplitter
    from rotorsoil_ros.machine.flexible.body import Dof, FlexibleBody
    from rotorsoil_ros.machine.flexible.receptance import SeatReceptance
    from rotorsoil_ros.machine.flexible.reduction import FiniteElements
    from rotorsoil_ros.machine.foundation import Foundation, Stand
    from rotorsoil_ros.machine.modes.campbell import Campbell
    from rotorsoil_ros.machine.modes.critical import CriticalSpeed
    from rotorsoil_ros.machine.response import Predictor, ResponseTable
    from rotorsoil_ros.machine.spread import SoilSpread
    from rotorsoil_ros.machine.transmissibility import Transmissibility
    from rotorsoil_ros.monitor.comparison import Comparison
    from rotorsoil_ros.monitor.rules import Matching
    from rotorsoil_ros.monitor.verdict import Verdict
    from rotorsoil_ros.prediction import Bounds, Prediction, Response
    from rotorsoil_ros.profile import Profile
    from rotorsoil_ros.rotor.assembly import Rotor
    from rotorsoil_ros.rotor.bearing import Bearing, Pedestal
    from rotorsoil_ros.rotor.disc import Disc
    from rotorsoil_ros.rotor.journal.geometry import JournalBearing
    from rotorsoil_ros.rotor.journal.oil import Oil, Viscosity
    from rotorsoil_ros.rotor.journal.states import JournalStates
    from rotorsoil_ros.rotor.shaft import Material, Probe, ShaftSection
    from rotorsoil_ros.wire.speeds import SpeedSource

__version__ = '0.1.0'
__all__ = [
    'Bearing', 'BearingStates', 'BoundaryElementModel', 'Bounds', 'Campbell', 'Channel', 'Circle',
    'Comparison', 'ComplianceTable', 'ConeModel', 'CoupledModel', 'CriticalSpeed', 'DampingSplit',
    'DampingSplitter', 'DesignReport', 'Disc', 'Dof', 'EmbeddedConeModel', 'Embedment',
    'FiniteElements', 'FlexibleBody', 'Foundation', 'ImportedTable', 'InfiniteElementModel',
    'InputError', 'JournalBearing', 'JournalStates', 'Layer', 'LayeredSiteModel', 'LayeredSoil',
    'Machine', 'Matching', 'Material', 'NotSolvedError', 'Oil', 'OutOfTableError', 'Part',
    'Pedestal', 'Plan', 'Plant', 'Prediction', 'Predictor', 'Probe', 'Profile', 'Record',
    'Rectangle', 'Response', 'ResponseTable', 'RigidSoil', 'Rotor', 'RotorSoilError',
    'SeatReceptance', 'ShaftSection', 'Shaken', 'Site', 'Soil', 'SoilModel', 'SoilSpread',
    'SpeedSource', 'Stand', 'Study', 'ThinLayerModel', 'Transmissibility', 'Verdict', 'Viscosity',
    'Wish', 'compare', 'export_log', 'import_table', 'load', 'predict_many', 'read_flexible',
    'read_profile', 'study',
]

# Which room a public name lives in.
_ROOMS = {
    'bags.archive': ('Record', 'predict_many'),
    'bags.comparison': ('Wish', 'compare'),
    'bags.profile': ('read_profile',),
    'bags.tables.exported': ('export_log',),
    'bags.tables.imported': ('ImportedTable', 'import_table'),
    'case.design.report': ('DesignReport',),
    'case.design.variants': ('Study', 'study'),
    'case.flexible.files': ('read_flexible',),
    'case.journal_entries': ('BearingStates',),
    'case.machine': ('Machine', 'load'),
    'case.plant.together': ('Plant', 'Shaken'),
    'channel': ('Channel',),
    'errors': ('InputError', 'NotSolvedError', 'OutOfTableError', 'RotorSoilError'),
    'profile': ('Profile',),
    'ground.boundary.layered_model': ('LayeredSiteModel',),
    'ground.boundary.model': ('BoundaryElementModel',),
    'ground.boundary.site': ('Site',),
    'ground.cone': ('ConeModel',),
    'ground.embedded_cone': ('EmbeddedConeModel',),
    'ground.half_space': ('InfiniteElementModel',),
    'ground.layers.model': ('ThinLayerModel',),
    'ground.layers.profile': ('Embedment', 'Layer', 'LayeredSoil'),
    'ground.plan': ('Part', 'Plan'),
    'ground.soil': ('Circle', 'Rectangle', 'RigidSoil', 'Soil', 'SoilModel'),
    'ground.table': ('ComplianceTable',),
    'machine.coupled': ('CoupledModel',),
    'machine.damping': ('DampingSplit', 'DampingSplitter'),
    'machine.flexible.body': ('Dof', 'FlexibleBody'),
    'machine.flexible.receptance': ('SeatReceptance',),
    'machine.flexible.reduction': ('FiniteElements',),
    'machine.foundation': ('Foundation', 'Stand'),
    'machine.modes.campbell': ('Campbell',),
    'machine.modes.critical': ('CriticalSpeed',),
    'machine.response': ('Predictor', 'ResponseTable'),
    'machine.spread': ('SoilSpread',),
    'machine.transmissibility': ('Transmissibility',),
    'monitor.comparison': ('Comparison',),
    'monitor.rules': ('Matching',),
    'monitor.verdict': ('Verdict',),
    'prediction': ('Bounds', 'Prediction', 'Response'),
    'rotor.assembly': ('Rotor',),
    'rotor.bearing': ('Bearing', 'Pedestal'),
    'rotor.disc': ('Disc',),
    'rotor.journal.geometry': ('JournalBearing',),
    'rotor.journal.oil': ('Oil', 'Viscosity'),
    'rotor.journal.states': ('JournalStates',),
    'rotor.shaft': ('Material', 'Probe', 'ShaftSection'),
    'wire.speeds': ('SpeedSource',),
}
_ROOM_OF = {name: room for room, names in _ROOMS.items() for name in names}


def __getattr__(name: str) -> object:
    """Import what a public name stands for (PEP 562)."""
    if name not in _ROOM_OF:
        raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
    found = getattr(import_module(f'{__name__}.{_ROOM_OF[name]}'), name)
    globals()[name] = found  # asked once
    return found


def __dir__() -> list[str]:
    """Return the public names, imported or not."""
    return sorted({*globals(), *__all__})
