"""Is this foundation right for this machine? One page of A4, and the same as numbers."""

from collections.abc import Iterator, Sequence
from html import escape
import json
import math
from pathlib import Path
import textwrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure
import numpy as np

import rotorsoil_ros
from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case.design.margins import searched
from rotorsoil_ros.case.design.report import Acceptance, DesignReport, HousingAnswer, NEAREST
from rotorsoil_ros.case.machine import Machine
from rotorsoil_ros.figures import html
from rotorsoil_ros.figures.comparison import ZONE_COLOURS
from rotorsoil_ros.figures.drawing import machine_drawing
from rotorsoil_ros.figures.response import COLOURS, tidy
from rotorsoil_ros.ground.soil import extents
from rotorsoil_ros.machine.peaks import resolved_speeds
from rotorsoil_ros.units import rad_s_to_rpm, rpm_to_rad_s, to_mm_s_rms, to_um_pp

_KINDS = {Acceptance.ACCEPTABLE: 'good', Acceptance.NOT_ACCEPTABLE: 'bad',
          Acceptance.UNDECIDED: 'open'}

# Of each list so many lines fit on the page; the rest is in report.json.
_MOST_HOUSINGS, _MOST_INPUTS, _MOST_GUESSES, _MOST_REASONS = 8, 4, 9, 3
_LONGEST = 150
# Speeds of the curve, and how far above the limits its axis goes at most.
_SPEEDS, _ABOVE_LIMITS = 600, 2.0

_STYLE = """
@page { size: A4; margin: 9mm; }
body { font-size: 12px; line-height: 1.3; max-width: 192mm; }
h1 { font-size: 17px; } h2 { font-size: 13px; margin: 7px 0 2px; }
.verdict { font-size: 14px; } th, td { font-size: 11px; padding: 1px 6px; }
ul { font-size: 11px; } li { overflow-wrap: anywhere; }
.two { display: grid; grid-template-columns: 1fr 1fr; gap: 0 14px; align-items: start; }
.two > * { min-width: 0; }
.small { font-size: 10.5px; color: #444; }
@media (max-width: 700px) { .two { grid-template-columns: 1fr; } }
@media print { body { font-size: 10px; } .verdict { font-size: 12px; }
  th, td { font-size: 9px; } ul { font-size: 9px; } .small, figcaption { font-size: 8.5px; }
  h1 { font-size: 15px; } h2 { font-size: 11px; } .two { grid-template-columns: 1fr 1fr; } }
"""


def write_design_report(machine: Machine, report: DesignReport, out: Path) -> None:
    """Write report.html and report.json into a directory, which has to exist."""
    (out / 'report.json').write_text(
        json.dumps(report.to_json(), indent=1, allow_nan=False) + '\n', encoding='utf-8')
    (out / 'report.html').write_text(design_page(machine, report), encoding='utf-8')


def design_page(machine: Machine, report: DesignReport) -> str:
    """Return the page."""
    case, rpm = report.case, f'{report.speed_rpm:.10g} rpm'
    name = case.name if case.berth is None else f'{case.name} of {case.berth.plant}'
    title = f'{name} at {rpm}: is this foundation right?'
    return html.page(title, [
        f'<h1>{escape(title)}</h1>',
        html.verdict(_KINDS[report.verdict], str(report.verdict).capitalize(),
                     f'{report.reasons[0]}.', report.reasons[1:_MOST_REASONS]),
        f'<p><b>Next step.</b> {escape(report.next_step)}.</p>',
        '<h2>Bearing housings</h2>', _housings(report),
        '<div class="two">', html.drawn(response_figure(machine, report), (
            'Velocity of the housing that is worst, over speed')),
        html.drawn(machine_drawing(case, width=4.6), 'Machine and ground, to scale'), '</div>',
        '<div class="two"><div>',
        f'<h2>Nearest critical speeds (looked for from {searched(report.modes)})</h2>',
        _modes(report), _stability(report), '</div><div>',
        '<h2>What decides</h2>', _decides(report), '</div></div>',
        '<div class="two"><div>', '<h2>Inputs, given unless marked</h2>',
        html.listed(list(_given(report))),
        '<h2>The answer rests on</h2>', html.listed(_short(report.assumptions)), '</div><div>',
        *_guessed(report), '<h2>Not modelled</h2>', html.listed(report.not_modelled),
        '</div></div>',
        f'<p class="small">Case {escape(str(case.path))}; rotorsoil_ros '
        f'{rotorsoil_ros.__version__}. Lowest and highest: as far as the case says that its '
        'inputs are known. Zones: A as new, B good for years, C only for a while, D does harm. '
        f'mm/s rms once per turn; um p-p: peak to peak. {escape(case.zones.label)}.</p>',
    ], style=_STYLE)


def _short(lines: Sequence[str]) -> list[str]:
    return [textwrap.shorten(line, 3 * _LONGEST, placeholder=' ... (report.json)')
            for line in lines]


def _housings(report: DesignReport) -> str:
    if not report.housings:
        return '<p>None can move in this case.</p>'
    header = ['housing', 'zone', 'mm/s rms: lowest', 'nominal', 'highest', 'um p-p: lowest',
              'nominal', 'highest', 'zone of the highest', 'B ends at [mm/s]', 'support']
    rows = [_row(one) for one in report.housings[:_MOST_HOUSINGS]]
    left = len(report.housings) - len(rows)
    more = f'<p class="small">and {left} more, which vibrate less: report.json</p>'
    return html.table(header, rows) + (more if left > 0 else '')


def _row(one: HousingAnswer) -> list[str]:
    velocities = map(_number, to_mm_s_rms(one.speed * one.amplitude).tolist())
    sizes = map(_number, to_um_pp(one.amplitude).tolist())
    return [str(one.channel), one.zones[1] or '-', *velocities, *sizes, one.zones[2] or '-',
            f'{1e3 * one.limits[1]:.3g}', one.support]


def _number(value: float) -> str:
    return f'{value:.3g}' if math.isfinite(value) else '-'


def _modes(report: DesignReport) -> str:
    nearest = report.modes.nearest(NEAREST)
    if not nearest:
        return f'<p>{escape(report.modes.doubt or "None.")}</p>'
    return html.table(
        ['mode', 'rpm', 'damping', 'most of it by', 'margin', 'asked', ''],
        [[one.name, f'{one.critical.speed_rpm:.0f}', f'{one.critical.damping_ratio:.1%}',
          '-' if one.split is None else one.split.words(0).split(',')[0],
          f'{one.margin:.0%}', f'{one.required:.0%}' if one.required else 'none',
          'too near' if one.is_missed else 'kept'] for one in nearest])


def _stability(report: DesignReport) -> str:
    said = {True: 'Stable: every vibration of the machine decays at this speed.',
            False: 'Unstable: a vibration grows on its own at this speed.',
            None: 'Whether the machine is stable at this speed is not known.'}
    split = '' if report.damping is None else (
        f' Damped by {report.damping.words(0)}: of {report.damping.power[0]:.3g} W.')
    return f'<p>{said[report.stable]}{split}</p>'


def _decides(report: DesignReport) -> str:
    influences = report.influences
    if not influences:
        return '<p>Nothing of the case is said to be uncertain, or there is no number.</p>'
    first = influences[0]
    rows = [[one.input.words, *(_number(1e3 * value) for value in (*one.ends, one.largest))]
            for one in influences[:_MOST_INPUTS]]
    alone = '' if report.case.berth is None else f': the part of {escape(report.case.name)}'
    return (f'<p><b>{escape(first.input.words.capitalize())}</b>: each input alone, over all that '
            f'is known of it, moves the worst housing so [mm/s rms]{alone}.</p>'
            + html.table(['input', 'at its lowest', 'as given', 'at its highest', 'largest'],
                         rows))


def _given(report: DesignReport) -> Iterator[str]:
    """Yield the numbers that matter most, each with a mark where it was guessed."""
    case, guessed = report.case, {guess.key for guess in report.guesses}

    def mark(*keys: str) -> str:
        return ' (guess)' if any(
            own == key or own.startswith(f'{key}.') or key.startswith(f'{own}.')
            for own in guessed for key in keys) else ''

    if case.soil is not None:
        yield (f'soil: c_s {case.soil.shear_wave_speed:.4g} m/s, G '
               f'{1e-6 * case.soil.shear_modulus:.3g} MPa' + mark('soil'))
    for index, block in enumerate(case.foundations):
        place = f'foundations.{index}'
        (left, right), (near, far) = extents(block.contact)
        size = f'{right - left:.4g} x {far - near:.4g} x {block.drawn_height:.3g} m'
        if block.body is not None and not block.is_solid:
            size = f'frame on {len(block.body.patches)} contacts'
        yield (f'{block.name}: {size}{mark(f"{place}.height", f"{place}.half_width")}, '
               f'{block.mass:.0f} kg{mark(f"{place}.mass")}')
    rotor = case.rotor
    diameter = max(max(section.outer_diameter) for section in rotor.shaft)
    # Of a rotor that was weighed only its parts are guesses.
    known = case.uncertainty.rotor_mass_factor == 1.0
    yield f'rotor: {rotor.mass:.4g} kg{"" if known else mark("rotor.discs")}'
    yield f'shaft: up to {1e3 * diameter:.4g} mm{mark("rotor.shaft")}'
    springs = ', '.join(f'{one.nominal_stiffness:.2g}' for one in rotor.bearings[:4])
    yield f'bearings: {springs} N/m{mark("rotor.bearings")}'


def _guessed(report: DesignReport) -> Iterator[str]:
    if not report.guesses:
        return
    yield f'<h2>Guessed: {len(report.guesses)} numbers</h2>'
    # One line for what was guessed for one reason.
    reasons: dict[str, list[str]] = {}
    for guess in report.guesses:
        words = [word for word in guess.key.split('.') if not word.isdigit()]
        reasons.setdefault(guess.why, []).append(words[-1].replace('_', ' '))
    lines = [f'{", ".join(dict.fromkeys(keys))}: {why}'[:_LONGEST]
             for why, keys in reasons.items()]
    left = len(lines) - _MOST_GUESSES
    yield html.listed([*lines[:_MOST_GUESSES], *([f'and {left} more: report.json'] if left > 0
                                                 else [])])


def response_figure(machine: Machine, report: DesignReport) -> Figure:
    """Draw the velocity of the worst housing over speed, its band, its zones, and the speed."""
    figure = Figure(figsize=(4.6, 3.5), layout='constrained')
    axes = figure.subplots()
    low, high = report.case.speed_range
    rpm = rad_s_to_rpm(np.linspace(low, high, _SPEEDS))
    axes.axvline(report.speed_rpm, color='black', linewidth=1.0, linestyle='--',
                 label='running speed')
    if report.housings:
        worst = report.housings[0]
        ends = to_mm_s_rms(worst.speed * worst.amplitude)
        if np.isfinite(ends).all():
            axes.plot([report.speed_rpm] * 2, ends[[0, 2]], color=COLOURS[0], marker='_',
                      markersize=9, linewidth=2.5, label='looked at closely')
        rpm = _speeds_of(machine, rpm)
        largest = _draw_velocity(axes, machine, worst, rpm, has_band=bool(report.stable))
        limits = np.array([report.case.zones.of(worst.support, speed)
                           for speed in rpm_to_rad_s(rpm)])
        for (name, colour), limit in zip(ZONE_COLOURS.items(), limits.T, strict=True):
            axes.plot(rpm, 1e3 * limit, color=colour, linewidth=1.0, label=f'zone {name}')
        top = 1e3 * limits[-1, 2]
        axes.set_ylim(0.0, min(max(1.15 * top, 1.1 * largest), _ABOVE_LIMITS * top))
        axes.set_title(str(worst.channel), fontsize=8)
    axes.set(xlabel='speed [rpm]', ylabel='velocity [mm/s rms]')
    tidy(axes)
    figure.legend(fontsize=7, ncols=3, loc='outside lower center')
    return figure


def _speeds_of(machine: Machine, rpm: FloatArray) -> FloatArray:
    """Return speeds [rpm] that are as dense as the response is sharp."""
    resolved = resolved_speeds(machine.table.predictor(machine.case.unbalance))
    return np.union1d(rpm, rad_s_to_rpm(resolved))


def _draw_velocity(
    axes: Axes, machine: Machine, worst: HousingAnswer, rpm: FloatArray, *, has_band: bool,
) -> float:
    """
    Draw the band and the answer of the case; return the largest of both [mm/s].

    About a machine that is not stable no band is drawn: most of what it may be is not either,
    and each would be looked through for what grows.
    """
    speed = rpm_to_rad_s(rpm)
    answered = machine.table.predictor(machine.case.unbalance).answer(speed).displacement
    column = machine.table.channels.index(worst.channel)
    nominal = high = to_mm_s_rms(speed * np.abs(answered[:, column]))
    if has_band:
        low, _, high = machine.bounds(rpm=rpm)[worst.channel].velocity_mm_s_rms()[:, :, 0]
    if has_band and np.isfinite(high).any():
        axes.fill_between(rpm, low, high, color=COLOURS[0], alpha=0.2, linewidth=0.0,
                          label='lowest to highest')
    axes.plot(rpm, nominal, color=COLOURS[0], linewidth=1.4, label='as the case says')
    return float(np.nanmax(np.fmax(nominal, high), initial=0.0))
