"""A comparison on one page that needs nothing beside it."""

from collections.abc import Iterable, Sequence
import csv
from html import escape
import io
import json
import math
from pathlib import Path
import re

import numpy as np

import rotorsoil_ros
from rotorsoil_ros.figures import html
from rotorsoil_ros.figures.comparison import all_figures, document, HEADER, rows
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.passage import Passage
from rotorsoil_ros.monitor.verdict import Verdict
from rotorsoil_ros.units import rad_s_to_rpm

_DPI = 110
_LONGEST_NAME = 100

_KINDS = {Verdict.PASSES: 'good', Verdict.FAILS: 'bad', Verdict.UNDECIDED: 'open'}

_WORDS = {
    Verdict.PASSES: 'The machine behaves as predicted.',
    Verdict.FAILS: 'The machine does not behave as predicted.',
    Verdict.UNDECIDED: 'Nothing could be held against the prediction.',
}


def write_report(
    comparison: Comparison, out: Path, *, source: str, identification: Sequence[str] = (),
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

    """
    with (out / 'comparison.csv').open('w', encoding='utf-8', newline='') as stream:
        writer = csv.writer(stream, lineterminator='\n')
        writer.writerow(HEADER)
        writer.writerows(rows(comparison))
    content = {**document(comparison), 'log': source, 'identification': list(identification)}
    (out / 'comparison.json').write_text(
        json.dumps(content, indent=1, allow_nan=False) + '\n', encoding='utf-8')
    pictures: list[tuple[str, bytes]] = []
    for name, caption, figure in all_figures(comparison):
        stream_of = io.BytesIO()
        figure.savefig(stream_of, dpi=_DPI, format='png')
        (out / f'{_file_name(name, len(pictures))}.png').write_bytes(stream_of.getvalue())
        pictures.append((caption, stream_of.getvalue()))
    (out / 'report.html').write_text(
        page(comparison, pictures, source=source, identification=identification),
        encoding='utf-8')


def _file_name(name: str, number: int) -> str:
    """Return a name as a file may have it: what a log calls a channel is no path."""
    plain = re.sub(r'[^A-Za-z0-9_-]', '_', name)[:_LONGEST_NAME]
    return plain if plain == name else f'{plain}_{number}'


def page(
    comparison: Comparison, pictures: Iterable[tuple[str, bytes]], *, source: str,
    identification: Sequence[str] = (),
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

    """
    verdict = comparison.verdict
    title = f'{comparison.run.title}: predicted against measured'
    case = comparison.expectation.case
    parts = [
        f'<h1>{escape(title)}</h1>',
        f'<p>Log {escape(source)}; case {escape(case.name)}, {escape(str(case.path))}; '
        f'rotorsoil_ros {rotorsoil_ros.__version__}.</p>',
        html.verdict(_KINDS[verdict], str(verdict), _WORDS[verdict], comparison.failures),
    ]
    if comparison.remarks:
        parts.append(f'<h2>To be known</h2>{html.listed(comparison.remarks)}')
    parts += ['<h2>Channels</h2>', html.table(*channel_table(comparison))]
    parts.append(html.listed(exclusions(comparison)))
    if comparison.peaks:
        parts += ['<h2>Peaks</h2>', html.table(*peak_table(comparison))]
    if comparison.expectation.criticals:
        parts += ['<h2>Critical speeds of the model</h2>', html.table(
            ['speed [rpm]', 'whirl', 'damping ratio'],
            [[f'{rad_s_to_rpm(mode.speed):.0f}', 'forward' if mode.whirl > 0 else 'backward',
              f'{mode.damping_ratio:.3g}'] for mode in comparison.expectation.criticals])]
    if comparison.zones:
        parts += [f'<h2>Zones, {escape(comparison.rules.zones.label)}</h2>',
                  '<p>Velocity of the 1X vector alone, a lower bound of the broadband value.</p>',
                  html.table(*zone_table(comparison))]
    if identification:
        text = escape('\n'.join(identification))
        parts += ['<h2>Identification</h2>', f'<pre>{text}</pre>']
    parts.append('<h2>Pictures</h2><div class="pictures">')
    parts += [html.png(image, caption) for caption, image in pictures]
    parts.append('</div>')
    return html.page(title, parts)


def channel_table(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of what was found, channel by channel."""
    header = ['channel', 'points', 'used', 'bias [um]', 'scatter [um]', 'ratio',
              'phase bias [deg]', 'phase scatter [deg]', 'R^2', 'inside band [%]']
    rows = [[points.channel, str(len(points.stamp_ns)), str(int(points.used.sum())),
             _number(1e6 * figures.bias), _number(1e6 * figures.scatter), _number(figures.ratio),
             _number(np.rad2deg(figures.phase_bias)), _number(np.rad2deg(figures.phase_scatter)),
             _number(figures.r_squared), _number(100.0 * figures.inside)]
            for points, figures in zip(comparison.points, comparison.statistics, strict=True)]
    return header, rows


def peak_table(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of predicted beside measured peaks."""
    header = ['channel', 'predicted [rpm]', 'measured [rpm]', 'deviation [%]', 'predicted [um]',
              'allowed [um]', 'measured [um]', 'passed at [rpm/s]', 'p', 'quasi-static']
    rows = []
    for peak in comparison.peaks:
        passed = peak.measured or peak.predicted
        assert passed is not None
        rows.append([peak.channel, _speed(peak.predicted), _speed(peak.measured),
                     _number(100.0 * peak.deviation), _height(peak.predicted),
                     _number(1e6 * peak.allowed.most), _height(peak.measured),
                     _number(float(rad_s_to_rpm(passed.rate))),
                     _number(passed.number(peak.damping_ratio)),
                     'yes' if peak.is_slow else 'no'])
    return header, rows


def zone_table(comparison: Comparison) -> tuple[list[str], list[list[str]]]:
    """Return header and rows of the zones of the housings."""
    header = ['channel', 'source', 'zone', 'velocity [mm/s rms]', 'speed [rpm]', 'support',
              'limits [mm/s]', 'constant speed']
    rows = [[entry.channel, entry.source, entry.zone, _number(1e3 * entry.velocity),
             f'{rad_s_to_rpm(entry.speed):.0f}', entry.support,
             ' / '.join(f'{1e3 * limit:g}' for limit in entry.limits),
             'yes' if entry.is_steady else 'no'] for entry in comparison.zones]
    return header, rows


def exclusions(comparison: Comparison) -> list[str]:
    """Return for each channel which points were left out and why."""
    return [f'{points.channel}: left out: ' + ', '.join(
        f'{number} {reason}' for reason, number in points.excluded.items())
        for points in comparison.points if points.excluded]


def _number(value: float) -> str:
    return '-' if math.isnan(value) else f'{value:.3g}'


def _speed(passage: Passage | None) -> str:
    return '-' if passage is None else f'{rad_s_to_rpm(passage.speed):.0f}'


def _height(passage: Passage | None) -> str:
    return '-' if passage is None else _number(1e6 * passage.amplitude)
