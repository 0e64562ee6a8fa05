"""What opens when an engineer opens a recording: which trends beside which picture."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from rotorsoil_ros.case.config import Case
from rotorsoil_ros.live.scene import Scene

MICRO = 1e6  # [um, urad] per [m, rad]
PROBES, DISCS, JOURNALS, HOUSINGS, BLOCK, ROCKING = (
    'Probes', 'Discs', 'Journals', 'Housings', 'Block', 'Rocking of the block')
ON_SHAFT, ON_GROUND = (PROBES, DISCS, JOURNALS), (HOUSINGS, BLOCK, ROCKING)
COLOURS = ((31, 119, 180), (255, 127, 14), (44, 160, 44), (214, 39, 40), (148, 103, 189),
           (140, 86, 75), (227, 119, 194), (127, 127, 127), (188, 189, 34), (23, 190, 207))
FROM = (1.2, -0.75, 0.6)  # where the eye is, in extents of the machine


@dataclass(frozen=True, slots=True)
class Trend:
    """One channel on the screen: its kind, its entity (split at the station), its colour."""

    channel: str
    kind: str
    entity: str
    colour: tuple[int, int, int]


def trends(machine: str, case: Case, channels: Sequence[str]) -> list[Trend]:
    """Return how the channels of a case are shown."""
    owners = {bearing.name: JOURNALS for bearing in case.rotor.bearings}
    owners |= {disc.name: DISCS for disc in case.rotor.discs}
    owners |= {probe.name: PROBES for probe in case.rotor.probes}
    owners |= {foundation.name: BLOCK for foundation in case.foundations}
    shown: list[Trend] = []
    for channel in channels:
        owner = max((name for name in owners if channel.startswith(f'{name}_')), key=len)
        motion = channel.removeprefix(f'{owner}_')
        kind = _kind(motion, owners[owner])
        colour = COLOURS[sum(trend.kind == kind for trend in shown) % len(COLOURS)]
        entity = rr.new_entity_path([machine, owner, motion])
        shown.append(Trend(channel, kind, entity, colour))
    return shown


def _kind(motion: str, kind_of_owner: str) -> str:
    if motion.startswith('housing'):
        return HOUSINGS
    return ROCKING if kind_of_owner == BLOCK and motion.startswith('r') else kind_of_owner


def blueprint(
    machines: Mapping[str, Sequence[Trend]], scenes: Mapping[str, Scene], *, timeline: str,
) -> rrb.Blueprint:
    """Return one tab per machine: speed, amplitudes and phase beside the vibrating machine."""
    tabs = [rrb.Horizontal(_trend_column(name, shown), _picture_column(name, scenes[name]),
                           column_shares=[1.0, 1.0], name=name)
            for name, shown in machines.items()]
    return rrb.Blueprint(
        tabs[0] if len(tabs) == 1 else rrb.Tabs(*tabs, name='machines'),
        rrb.TimePanel(state='collapsed', timeline=timeline),
        rrb.SelectionPanel(state='hidden'), rrb.BlueprintPanel(state='hidden'),
        auto_views=False, auto_layout=False)


def _trend_column(name: str, shown: Sequence[Trend]) -> rrb.Vertical:
    speed = rrb.TimeSeriesView(
        name='Speed [rpm]', origin='/', contents=[rr.new_entity_path([name, 'speed'])],
        axis_x=rrb.TimeAxis(link='LinkToGlobal'), plot_legend=rrb.PlotLegend(visible=False))
    rows = [_trend_tabs(shown, ON_SHAFT, 'amplitude'), _trend_tabs(shown, ON_SHAFT, 'phase'),
            _trend_tabs(shown, ON_GROUND, 'amplitude')]
    return rrb.Vertical(speed, *rows, row_shares=[1.0, 2.0, 1.6, 1.6])


def _trend_tabs(shown: Sequence[Trend], kinds: Sequence[str], quantity: str) -> rrb.Tabs:
    """Return predicted and measured values of a quantity, one tab for each kind there is."""
    return rrb.Tabs(*(rrb.TimeSeriesView(
        name=f'{kind}, phase [deg]' if quantity == 'phase' else
        f'{kind} [{"urad" if kind == ROCKING else "um"}, zero-to-peak]',
        origin='/',
        contents=[f'{trend.entity}/{quantity}/**' for trend in shown if trend.kind == kind],
        axis_x=rrb.TimeAxis(link='LinkToGlobal'),
        axis_y=rrb.ScalarAxis(range=(-180.0, 180.0)) if quantity == 'phase' else None,
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop))
        for kind in kinds if any(trend.kind == kind for trend in shown)))


def _picture_column(name: str, scene: Scene) -> rrb.Vertical:
    picture = rr.new_entity_path([name, 'picture'])
    target = np.array([0.0, 0.5 * scene.length, 0.35 * scene.shaft_height])
    eye = rrb.EyeControls3D(
        position=target + scene.extent * np.array(FROM), look_target=target,
        eye_up=(0.0, 0.0, 1.0))
    return rrb.Vertical(
        rrb.Spatial3DView(
            name='Rotor on its foundation', origin=picture, contents=f'{picture}/**',
            line_grid=rrb.LineGrid3D(visible=True, spacing=0.1 * scene.extent),
            eye_controls=eye),
        rrb.TextDocumentView(name='What is drawn', origin=rr.new_entity_path([name, 'caption'])),
        rrb.TextLogView(name='Events', origin=rr.new_entity_path([name, 'events'])),
        row_shares=[6.0, 0.8, 1.2])
