"""A page that needs nothing beside it, fits on paper and on a phone: its parts."""

import base64
from collections.abc import Iterable, Sequence
from html import escape
import io

from matplotlib import rc_context
from matplotlib.figure import Figure

ZONES = ('A', 'B', 'C', 'D')

STYLE = """
body { font: 14px/1.45 "Liberation Sans", Arial, sans-serif; color: #222; margin: 1.5rem auto;
       padding: 0 1rem; max-width: 62rem; }
h1 { font-size: 1.4rem; margin: 0 0 .3rem; } h2 { font-size: 1.1rem; margin: 1.2rem 0 .3rem; }
p { margin: .3rem 0; } ul { margin: .2rem 0; padding-left: 1.2rem; }
.verdict { padding: .5rem .8rem; border-left: .5rem solid; margin: .4rem 0; }
.verdict b { font-size: 1.2em; }
.good { border-color: #009e73; background: #dff3ea; }
.bad { border-color: #c0392b; background: #fbe3e0; }
.open { border-color: #e69f00; background: #fdf1d8; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: .3rem 0; }
th, td { border: 1px solid #ccc; padding: .15rem .5rem; text-align: right; font-size: 12px; }
th, td:first-child { text-align: left; background: #f5f5f5; }
td.zone-A { background: #cdebd8; } td.zone-B { background: #e8f0c4; }
td.zone-C { background: #fbe3b3; } td.zone-D { background: #f5c1bb; }
td.missed { background: #f5c1bb; }
pre { white-space: pre-wrap; font-size: 12px; background: #f5f5f5; padding: .5rem .8rem; }
figure { margin: 0; break-inside: avoid; } figure img { width: 100%; }
figcaption { font-size: 12px; color: #555; }
.pictures { display: grid; gap: 1rem; align-items: start;
            grid-template-columns: repeat(auto-fit, minmax(min(24rem, 100%), 1fr)); }
dl { margin: .2rem 0; } dt { font-weight: bold; } dd { margin: 0 0 .3rem 1rem; }
@media print { body { margin: 0; padding: 0; max-width: none; }
               * { -webkit-print-color-adjust: exact; print-color-adjust: exact; } }
"""


def page(title: str, parts: Iterable[str], *, style: str = '') -> str:
    """Return a document in HTML; what its parts show of a user's is escaped already."""
    return ('<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f'<title>{escape(title)}</title><style>{STYLE}{style}</style></head><body>\n'
            + '\n'.join(part for part in parts if part) + '\n</body></html>\n')


def verdict(kind: str, word: str, text: str, lines: Sequence[str] = ()) -> str:
    """Return the coloured bar at the top: good, bad or open."""
    return (f'<div class="verdict {kind}"><b>{escape(word)}</b>: {escape(text)}'
            f'{listed(lines)}</div>')


def listed(lines: Sequence[str]) -> str:
    """Return a list, nothing for none."""
    return ''.join(['<ul>', *(f'<li>{escape(line)}</li>' for line in lines), '</ul>']
                   if lines else [])


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table that scrolls by itself where it is too wide; zones have their colour."""
    head = ''.join(f'<th>{escape(cell)}</th>' for cell in header)
    body = ''.join(f'<tr>{"".join(map(_cell, cells))}</tr>' for cells in rows)
    return f'<div class="wide"><table><tr>{head}</tr>{body}</table></div>'


def _cell(text: str) -> str:
    kind = f' class="zone-{text}"' if text in ZONES else (
        ' class="missed"' if text == 'too near' else '')
    return f'<td{kind}>{escape(text)}</td>'


def png(image: bytes, caption: str) -> str:
    """Return a picture with its caption, embedded."""
    return _figure(image, 'image/png', caption)


def drawn(figure: Figure, caption: str) -> str:
    """Return a figure with its caption, embedded as lines and letters."""
    stream = io.BytesIO()
    # Letters stay letters, and the same figure gives the same bytes.
    with rc_context({'svg.fonttype': 'none', 'svg.hashsalt': 'rotorsoil',
                     'font.family': ['Liberation Sans', 'Arial', 'DejaVu Sans']}):
        figure.savefig(stream, format='svg', metadata={'Date': None})
    return _figure(stream.getvalue(), 'image/svg+xml', caption)


def _figure(image: bytes, kind: str, caption: str) -> str:
    coded = base64.b64encode(image).decode()
    return (f'<figure><img alt="{escape(caption)}" src="data:{kind};base64,{coded}">'
            f'<figcaption>{escape(caption)}</figcaption></figure>')
