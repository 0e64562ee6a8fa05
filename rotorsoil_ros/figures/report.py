"""A comparison on one page that needs nothing beside it."""

import base64
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
from rotorsoil_ros.figures.comparison import all_figures, document, HEADER, rows
from rotorsoil_ros.monitor.comparison import Comparison
from rotorsoil_ros.monitor.passage import Passage
from rotorsoil_ros.monitor.verdict import Verdict
from rotorsoil_ros.units import rad_s_to_rpm

_STYLE = """
body { font: 14px/1.45 sans-serif; color: #222; max-width: 62rem; margin: 1.5rem auto;
       padding: 0 1rem; }
h1 { font-size: 1.4rem; } h2 { font-size: 1.1rem; margin-top: 1.6rem; }
.verdict { padding: .5rem .8rem; border-left: .4rem solid; }
.passes { border-color: #009e73; background: #e8f6f1; }
.fails { border-color: #c0392b; background: #fbecea; }
.undecided { border-color: #e69f00; background: #fdf5e3; }
table { border-collapse: collapse; margin: .4rem 0; }
th, td { border: 1px solid #ccc; padding: .15rem .5rem; text-align: right; font-size: 12px; }
th, td:first-child { text-align: left; background: #f5f5f5; }
td.zone-A { background: #cdebd8; } td.zone-B { background: #e8f0c4; }
td.zone-C { background: #fbe3b3; } td.zone-D { background: #f5c1bb; }
pre { white-space: pre-wrap; font-size: 12px; background: #f5f5f5; padding: .5rem .8rem; }
.pictures { display: grid; grid-template-columns: repeat(auto-fit, minmax(24rem, 1fr));
            gap: 1rem; align-items: start; }
figure { margin: 0; break-inside: avoid; } figure img { width: 100%; }
figcaption { font-size: 12px; color: #555; }
"""

_DPI = 110
_LONGEST_NAME = 100
ZONES = ('A', 'B', 'C', 'D')

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
        f'<div class="verdict {verdict}"><b>{verdict}</b>: {_WORDS[verdict]}'
        f'{_list(comparison.failures)}</div>',
    ]
    if comparison.remarks:
        parts.append(f'<h2>To be known</h2>{_list(comparison.remarks)}')
    parts += ['<h2>Channels</h2>', _table(*channel_table(comparison))]
    parts.append(_list(exclusions(comparison)))
    if comparison.peaks:
        parts += ['<h2>Peaks</h2>', _table(*peak_table(comparison))]
    if comparison.expectation.criticals:
        parts += ['<h2>Critical speeds of the model</h2>', _table(
            ['speed [rpm]', 'whirl', 'damping ratio'],
            [[f'{rad_s_to_rpm(mode.speed):.0f}', 'forward' if mode.whirl > 0 else 'backward',
              f'{mode.damping_ratio:.3g}'] for mode in comparison.expectation.criticals])]
    if comparison.zones:
        parts += [f'<h2>Zones, {escape(comparison.rules.zones.label)}</h2>',
                  '<p>Velocity of the 1X vector alone, a lower bound of the broadband value.</p>',
                  _table(*zone_table(comparison))]
    if identification:
        text = escape('\n'.join(identification))
        parts += ['<h2>Identification</h2>', f'<pre>{text}</pre>']
    parts.append('<h2>Pictures</h2><div class="pictures">')
    for caption, png in pictures:
        image = base64.b64encode(png).decode()
        parts.append(f'<figure><img alt="{escape(caption)}" src="data:image/png;base64,{image}">'
                     f'<figcaption>{escape(caption)}</figcaption></figure>')
    parts.append('</div>')
    return (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>'
            f'{escape(title)}</title><style>{_STYLE}</style></head><body>\n'
            + '\n'.join(parts) + '\n</body></html>\n')


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


def _list(lines: Sequence[str]) -> str:
    return ''.join(['<ul>', *(f'<li>{escape(line)}</li>' for line in lines), '</ul>']
                   if lines else [])


def _table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = ''.join(f'<th>{escape(cell)}</th>' for cell in header)
    body = ''.join(f'<tr>{"".join(map(_cell, cells))}</tr>' for cells in rows)
    return f'<table><tr>{head}</tr>{body}</table>'


def _cell(text: str) -> str:
    kind = f' class="zone-{text}"' if text in ZONES else ''
    return f'<td{kind}>{escape(text)}</td>'
