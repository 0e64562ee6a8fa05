"""A comparison on one page that needs nothing beside it."""

from collections.abc import Iterable, Iterator, Sequence
import csv
from dataclasses import dataclass
from html import escape
import io
import json
import math
from pathlib import Path
import re

import rotorsoil_ros
from rotorsoil_ros.case.summary import stability_told
from rotorsoil_ros.figures import html
from rotorsoil_ros.figures.comparison import all_figures, document, HEADER, rows
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.identification.case import Identification
from rotorsoil_ros.monitor.identification.sentence import in_a_sentence
from rotorsoil_ros.monitor.passage import Passage
from rotorsoil_ros.monitor.verdict import percent, Verdict
from rotorsoil_ros.units import rad_s_to_rpm, Units

_DPI = 110
_LONGEST_NAME = 100



@dataclass(frozen=True, slots=True)
class Scale:
    """In which units tables are, and by what SI is multiplied for them."""

    length: float = 1.0
    length_unit: str = 'm 0-p'
    angle: float = 1.0
    angle_unit: str = 'rad'
    speed: float = 1.0
    speed_unit: str = 'rad/s'
    velocity: float = 1.0
    velocity_unit: str = 'm/s'


SI_SCALE = Scale()
PLANT_SCALE = Scale(2e6, 'um p-p', -math.degrees(1.0), 'deg of lag', rad_s_to_rpm(1.0), 'rpm', 1e3,
                    'mm/s')

# Pictures that are printed: with the tables they fill three sheets.
_MOST_PRINTED = 6

_STYLE = """
@page { size: A4; margin: 10mm; }
@media print { body { font-size: 10px; line-height: 1.25; } h1 { font-size: 15px; }
  h2 { font-size: 12px; margin: 6px 0 2px; } th, td { font-size: 8px; padding: 0 3px; }
  ul, dl, pre, figcaption, .small { font-size: 8.5px; } .verdict { font-size: 12px; }
  .pictures { grid-template-columns: 1fr 1fr; gap: 4px; } .screen { display: none; }
  figure img { max-height: 78mm; object-fit: contain; } }
"""

# What the words of the page mean, for who does not compare machines every day.
_TERMS = {
    '1X': 'vibration once per turn; unbalance makes nothing else',
    'band': 'between which amplitudes the machine lies, as far as its soil, bearings and models '
            'are known',
    'bias, scatter': 'mean and standard deviation of measured less predicted amplitude, and of '
                     'the phase, of which more lag is positive',
    'p-p': 'peak to peak, twice the amplitude',
    'ratio': 'measured over predicted amplitude',
    'R^2': 'share of the measured vectors that the prediction explains, 1 at best',
    'quasi-static': 'the speed changes so slowly that the machine answers as at constant speed',
    'p': 'how fast a resonance was passed: below 0.1 slowly, above 1 fast',
    'zones': 'of ISO 10816-3: A as new, B good for years, C only for a while, D does harm',
    'support': 'rigid where the lowest natural frequency lies above 1.25 times the speed',
}

_KINDS = {Verdict.PASSES: 'good', Verdict.FAILS: 'bad', Verdict.UNDECIDED: 'open'}


def write_report(
    comparison: Comparison, out: Path, *, source: str, identification: Sequence[str] = (),
    found: Identification | None = None,
) -> None:
    """
    Write tables, pictures and the report of a comparison into a directory.

    Parameters
    ----------
    comparison : Comparison
        What was found.
    out : Path
        The directory, which has to exist.
    source : str
        Which log was read.
    identification : sequence of str
        What identification says.
    found : Identification or None
        What it found, for the sentence on top.

    """
    said, advice = in_a_sentence(comparison, found)
    with (out / 'comparison.csv').open('w', encoding='utf-8', newline='') as stream:
        writer = csv.writer(stream, lineterminator='\n')
        writer.writerow(HEADER)
        writer.writerows(rows(comparison))
    content = {**document(comparison), 'log': source, 'identification': list(identification),
               'sentence': said, 'next_step': advice}
    (out / 'comparison.json').write_text(
        json.dumps(content, indent=1, allow_nan=False) + '\n', encoding='utf-8')
    pictures: list[tuple[str, bytes]] = []
    for name, caption, figure in all_figures(comparison):
        stream_of = io.BytesIO()
        figure.savefig(stream_of, dpi=_DPI, format='png')
        (out / f'{_file_name(name, len(pictures))}.png').write_bytes(stream_of.getvalue())
        pictures.append((caption, stream_of.getvalue()))
    (out / 'report.html').write_text(
        page(comparison, pictures, source=source, identification=identification, found=found),
        encoding='utf-8')


def _file_name(name: str, number: int) -> str:
    """Return a name as a file may have it: what a log calls a channel is no path."""
    plain = re.sub(r'[^A-Za-z0-9_-]', '_', name)[:_LONGEST_NAME]
    return plain if plain == name else f'{plain}_{number}'


def page(
    comparison: Comparison, pictures: Iterable[tuple[str, bytes]], *, source: str,
    identification: Sequence[str] = (), found: Identification | None = None,
) -> str:
    """
    Return the report as HTML.

    Parameters
    ----------
    comparison : Comparison
        What was found.
    pictures : iterable of (str, bytes)
        Captions and PNG files; they are embedded.
    source : str
        Which log was read.
    identification : sequence of str
        What identification printed.
    found : Identification or None
        What it found.

    """
    verdict = comparison.verdict
    said, advice = in_a_sentence(comparison, found)
    title = f'{comparison.run.title}: predicted against measured'
    case = comparison.expectation.case
    parts = [
        f'<h1>{escape(title)}</h1>',
        f'<p>Log {escape(source)}; case {escape(case.name)}, {escape(str(case.path))}; '
        f'rotorsoil_ros {rotorsoil_ros.__version__}.</p>',
        html.verdict(_KINDS[verdict], str(verdict), f'{said}.', comparison.failures),
        f'<p><b>Next step.</b> {escape(advice)}.</p>',
    ]
    if comparison.remarks:
        parts.append(f'<h2>To be known</h2>{html.listed(comparison.remarks)}')
    parts += ['<h2>Channels</h2>', html.table(*channel_table(comparison))]
    parts.append(html.listed(exclusions(comparison)))
    if comparison.peaks:
        parts += ['<h2>Peaks</h2>', html.table(*peak_table(comparison))]
    parts += ['<h2>Stability of the model</h2>', '<p>' + escape(stability_told(
        comparison.expectation.table.stability, Units())) + '</p>']
    if comparison.expectation.criticals:
        parts += ['<h2>Critical speeds of the model</h2>', html.table(
            ['speed [rpm]', 'whirl', 'damping ratio'],
            [[f'{rad_s_to_rpm(mode.speed):.0f}', 'forward' if mode.whirl > 0 else 'backward',
              f'{mode.damping_ratio:.3g}'] for mode in comparison.expectation.criticals])]
    if comparison.zones:
        parts += [f'<h2>Zones, {escape(comparison.rules.zones.label)}</h2>',
                  '<p>Velocity of the 1X vector alone, of all machines together where there are '
                  'several: a lower bound of the broadband value.</p>',
                  html.table(*zone_table(comparison))]
    if of_ground := ground_tables(comparison):
        parts += ['<h2>Ground that moves by itself</h2>',
                  *(html.table(*one) for one in of_ground)]
    if identification:
        text = escape('\n'.join(identification))
        parts += ['<h2>Identification</h2>', f'<pre>{text}</pre>']
    parts += ['<h2>Pictures</h2><div class="pictures">', *_shown(pictures), '</div>',
              '<h2>Words</h2><dl>', *(f'<dt>{escape(word)}</dt><dd>{escape(meaning)}</dd>'
                                      for word, meaning in _TERMS.items()), '</dl>']
    return html.page(title, parts, style=_STYLE)


def _shown(pictures: Iterable[tuple[str, bytes]]) -> Iterator[str]:
    """Yield all pictures; those that tell most are printed too."""
    # Trend and residuals tell of all channels.
    ordered = sorted(pictures, key=lambda one: ': ' in one[0])
    for number, (caption, image) in enumerate(ordered):
        kind = '' if number < _MOST_PRINTED else ' class="screen"'
        yield f'<div{kind}>{html.png(image, caption)}</div>'
    if len(ordered) > _MOST_PRINTED:
        yield '<p class="small">More pictures are on screen, and as PNG beside the page.</p>'


def channel_table(
    comparison: Comparison, scale: Scale = PLANT_SCALE,
) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of what was found, channel by channel."""
    length, angle = f'[{scale.length_unit}]', f'[{scale.angle_unit}]'
    header = ['channel', 'points', 'used', f'bias {length}', f'scatter {length}', 'ratio',
              f'phase bias {angle}', f'phase scatter {angle.replace(" of lag", "")}', 'R^2',
              'inside band [%]']
    rows = [[points.channel, str(len(points.stamp_ns)), str(int(points.used.sum())),
             _number(scale.length * figures.bias), _number(scale.length * figures.scatter),
             _number(figures.ratio), _number(scale.angle * figures.phase_bias),
             _number(abs(scale.angle) * figures.phase_scatter),
             _number(figures.r_squared), _number(100.0 * figures.inside)]
            for points, figures in zip(comparison.points, comparison.statistics, strict=True)]
    return header, rows


def peak_table(
    comparison: Comparison, scale: Scale = PLANT_SCALE,
) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of predicted beside measured peaks."""
    speed, length = f'[{scale.speed_unit}]', f'[{scale.length_unit}]'
    header = ['channel', f'predicted {speed}', f'measured {speed}', 'deviation [%]',
              f'predicted {length}', f'allowed {length}', f'measured {length}',
              f'passed at [{scale.speed_unit}/s]', 'p', 'quasi-static']
    rows = []
    for peak in comparison.peaks:
        passed = peak.measured or peak.predicted
        assert passed is not None
        rows.append([peak.channel, _speed(peak.predicted, scale), _speed(peak.measured, scale),
                     _number(100.0 * peak.deviation), _height(peak.predicted, scale),
                     _number(scale.length * peak.allowed.most), _height(peak.measured, scale),
                     _number(scale.speed * passed.rate),
                     _number(passed.number(peak.damping_ratio)),
                     'yes' if peak.is_slow else 'no'])
    return header, rows


def zone_table(
    comparison: Comparison, scale: Scale = PLANT_SCALE,
) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of the zones of the housings."""
    header = ['channel', 'source', 'zone', f'velocity [{scale.velocity_unit} rms]',
              f'speed [{scale.speed_unit}]', 'support', f'limits [{scale.velocity_unit} rms]',
              'constant speed', *(['shares'] if any(
                  entry.shares for entry in comparison.zones) else [])]
    rows = [[entry.channel, entry.source, entry.zone, _number(scale.velocity * entry.velocity),
             f'{scale.speed * entry.speed:.4g}', entry.support,
             ' / '.join(f'{scale.velocity * limit:g}' for limit in entry.limits),
             'yes' if entry.is_steady else 'no', percent(entry.shares)][:len(header)]
            for entry in comparison.zones]
    return header, rows


def ground_tables(
    comparison: Comparison, scale: Scale = PLANT_SCALE,
) -> list[tuple[list[str], list[list[str]]]]:
    """Return header and rows of what the ground did once per turn, and of all else."""
    if (found := comparison.ground) is None:
        return []
    without = {entry.channel: entry.zone for entry in found.zones}
    velocity, length = f'[{scale.velocity_unit} rms]', f'[{scale.length_unit}]'
    once = (['channel', 'vectors', f'from the ground {velocity}', 'of the measured [%]',
             f'residual {length}', f'without the ground {length}', f'scatter {length}',
             f'without the ground {length}', 'zone without the ground'],
            [[one.channel, str(one.vectors), _number(scale.velocity * one.part),
              _number(100.0 * one.share), *(_number(scale.length * value) for value in (
                  one.residual, one.residual_less, one.scatter, one.scatter_less)),
              without.get(one.channel, '-')] for one in found.shares])
    of_all = (['channel', 'sensor', 'orders left out, band [Hz]', f'measured {velocity}',
               f'from the ground {velocity}', f'coherent with it {velocity}', 'says'],
              [[one.channel, one.sensor, f'{one.band[0]:.3g} to {one.band[1]:.3g}',
                *(_number(scale.velocity * value) for value in (
                    one.measured, one.ground, one.coherent)), one.said]
               for one in found.broadband])
    return [table for table in (once, of_all) if table[1]]


def exclusions(comparison: Comparison) -> list[str]:
    """Return for each channel which points were left out and why."""
    return [f'{points.channel}: left out: ' + ', '.join(
        f'{number} {reason}' for reason, number in points.excluded.items())
        for points in comparison.points if points.excluded]


def _number(value: float) -> str:
    return '-' if math.isnan(value) else f'{value:.3g}'


def _speed(passage: Passage | None, scale: Scale) -> str:
    return '-' if passage is None else f'{scale.speed * passage.speed:.5g}'


def _height(passage: Passage | None, scale: Scale) -> str:
    return '-' if passage is None else _number(scale.length * passage.amplitude)
