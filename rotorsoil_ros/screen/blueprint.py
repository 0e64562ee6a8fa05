"""What opens when an engineer opens a recording: trends beside machine, orbits, Bode, spectra."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import rerun.blueprint as rrb

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.screen.bode import Bode
from rotorsoil_ros.screen.channels import (
    BLOCK,
    DISCS,
    entity_of,
    HOUSINGS,
    JOURNALS,
    moving_housings,
    NEIGHBOURS,
    PROBES,
    ROCKING,
    Trend,
)
from rotorsoil_ros.screen.orbits import Orbits
from rotorsoil_ros.screen.plant import ShownPlant
from rotorsoil_ros.screen.recording import TIMELINE
from rotorsoil_ros.screen.scene import Scene
from rotorsoil_ros.screen.trends import ZoneLane
from rotorsoil_ros.screen.waterfall import Waterfall

# What is measured most often comes first: its tab is the one that is open. Amplitudes of
# housings are shown as velocities already.
ORDER = (PROBES, HOUSINGS, DISCS, JOURNALS, BLOCK, ROCKING, NEIGHBOURS)
ORDER_OF_AMPLITUDES = (PROBES, DISCS, JOURNALS, HOUSINGS, BLOCK, ROCKING, NEIGHBOURS)
DIRECTIONS = {'x': 'horizontal', 'z': 'vertical'}
FROM = (0.92, -0.58, 0.46)  # where the eye is, in diagonals of the scene


@dataclass(frozen=True, slots=True)
class Shown:
    """One machine on the screen: its case, how its channels are shown, and its scene."""

    name: str
    case: Case
    trends: Sequence[Trend]
    scene: Scene

    def entity(self, *parts: str) -> str:
        """Return the path of something that belongs to it."""
        return entity_of(self.name, *parts)

    @property
    def housings(self) -> list[Trend]:
        """The channels that have zones: of housings that can move."""
        moving = moving_housings(self.case)
        return [trend for trend in self.trends
                if trend.channel.is_housing and trend.channel.station in moving]

    def kinds(self, order: Sequence[str] = ORDER) -> list[str]:
        """Return the kinds of channels that there are, in the order of their tabs."""
        return [kind for kind in order if self.of(kind)]

    def of(self, kind: str) -> list[Trend]:
        """Return the channels of one kind."""
        if kind == HOUSINGS:
            return self.housings
        return [trend for trend in self.trends if trend.kind == kind]


def blueprint(machines: Mapping[str, Shown], plants: Sequence[ShownPlant] = ()) -> rrb.Blueprint:
    """Return one tab per plant, and per machine: trends left, pictures, zones, events right."""
    tabs = [_plant(plant, machines) for plant in plants]
    tabs += [rrb.Horizontal(_trend_column(shown), _picture_column(shown),
                           column_shares=[1.0, 1.0], name=name)
            for name, shown in machines.items()]
    return rrb.Blueprint(
        tabs[0] if len(tabs) == 1 else rrb.Tabs(*tabs, name='machines'),
        rrb.TimePanel(state='collapsed', timeline=TIMELINE),
        rrb.SelectionPanel(state='hidden'), rrb.BlueprintPanel(state='hidden'),
        auto_views=False, auto_layout=False)


def _trend_column(shown: Shown) -> rrb.Vertical:
    rows: list[rrb.View | rrb.Container] = [_series(
        'Speed [rpm]', [shown.entity('speed')], has_legend=False)]
    shares = [0.7]
    if shown.housings:
        rows.append(rrb.Tabs(*(_velocity(shown, axis) for axis in DIRECTIONS)))
        shares.append(1.7)
    rows += [rrb.Tabs(*(_trend(shown, kind, quantity) for kind in shown.kinds(order)))
             for quantity, order in (('amplitude', ORDER_OF_AMPLITUDES), ('phase', ORDER))]
    return rrb.Vertical(*rows, row_shares=[*shares, 1.7, 1.3])


def _velocity(shown: Shown, axis: str) -> rrb.View:
    contents = [f'{trend.entity}/velocity/**' for trend in shown.housings
                if trend.channel.axis == axis]
    direction = f'along {axis}' if shown.case.rotor.is_upright else DIRECTIONS[axis]
    what = 'velocity' if shown.case.berth is None else 'own part of the velocity'
    return _series(f'Housings {direction}, {what} [mm/s rms]',
                   [*contents, f'{shown.entity("limits", axis)}/**'])


def _trend(shown: Shown, kind: str, quantity: str) -> rrb.View:
    """Return predicted and measured values of a quantity of one kind of channels."""
    trends = shown.of(kind)
    is_phase = quantity == 'phase'
    return _series(f'{kind}, phase [deg]' if is_phase else f'{kind} [{trends[0].unit}, 0-peak]',
                   [f'{trend.entity}/{quantity}/**' for trend in trends],
                   axis_y=rrb.ScalarAxis(range=(-180.0, 180.0)) if is_phase else None)


def _series(
    name: str, contents: Sequence[str], *, axis_y: rrb.ScalarAxis | None = None,
    has_legend: bool = True,
) -> rrb.View:
    return rrb.TimeSeriesView(
        name=name, origin='/', contents=list(contents), axis_y=axis_y,
        axis_x=rrb.TimeAxis(link='LinkToGlobal'),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=has_legend))


def _picture_column(shown: Shown) -> rrb.Vertical:
    channels = [trend.channel for trend in shown.trends]
    bode = shown.entity('bode')
    tabs: list[rrb.View | rrb.Container] = [
        _machine(shown),
        Orbits.view(shown.entity('orbits'), shown.case, channels),
        rrb.Tabs(*(rrb.Grid(*(Bode.view(bode, trend) for trend in shown.of(kind)), name=kind)
                   for kind in shown.kinds()), name='Bode')]
    if shown.housings:
        tabs.append(rrb.Tabs(*(
            Waterfall.view(shown.entity('waterfall', trend.channel), trend.channel)
            for trend in shown.housings), name='Waterfall'))
    rows: list[rrb.View | rrb.Container] = [rrb.Tabs(*tabs)]
    shares = [4.0]
    if shown.housings:
        rows.append(ZoneLane.views(shown.entity('zones'), shown.case.zones.label))
        shares.append(1.6)
    events = rrb.TextLogView(
        name='Events', origin=shown.entity('events'), columns=rrb.TextLogColumns(
            text_log_columns=['LogLevel', 'Body']))
    return rrb.Vertical(*rows, events, row_shares=[*shares, 1.4])


def _plant(plant: ShownPlant, machines: Mapping[str, Shown]) -> rrb.Horizontal:
    speeds = [machines[name].entity('speed') for name in plant.names]
    charts = rrb.Vertical(
        _series('Speeds [rpm]', speeds),
        _series('Housings, velocity of all together [mm/s rms]', [f'{plant.entity("total")}/**']),
        row_shares=[1.0, 2.0])
    return rrb.Horizontal(charts, _picture(
        f'{plant.plant}: all machines', plant.scene, plant.entity('picture'),
        plant.entity('caption')), column_shares=[1.0, 1.6], name=plant.plant)


def _machine(shown: Shown) -> rrb.Vertical:
    return _picture(f'{shown.name}: rotor on its foundation', shown.scene,
                    shown.entity('picture'), shown.entity('caption'))


def _picture(name: str, scene: Scene, picture: str, caption: str) -> rrb.Vertical:
    target = np.array([*(0.5 * (scene.low + scene.high))[:2], 0.4 * scene.high[2]])
    eye = rrb.EyeControls3D(
        position=target + scene.reach * np.array(FROM), look_target=target,
        eye_up=(0.0, 0.0, 1.0))
    return rrb.Vertical(
        rrb.Spatial3DView(
            name=name, origin=picture, contents=f'{picture}/**',
            line_grid=rrb.LineGrid3D(visible=True, spacing=0.1 * scene.extent),
            eye_controls=eye),
        rrb.TextDocumentView(name='What is drawn', origin=caption),
        row_shares=[6.0, 0.8], name='Machine')
