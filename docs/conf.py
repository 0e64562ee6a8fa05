"""The site: `make docs`. Pages are Markdown, docstrings numpydoc, formulas SVG, no network."""

from html import escape
from pathlib import Path
import sys

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.writers.html5 import HTML5Translator
import ziafont
from ziamath import Latex

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import dag  # noqa: E402 - found on the path above

import rotorsoil_ros  # noqa: E402

project = 'rotorsoil_ros'
version = release = rotorsoil_ros.__version__
author = 'rotorsoil_ros maintainers'
copyright = author  # noqa: A001 - so Sphinx calls it
extensions = ['myst_parser', 'numpydoc', 'sphinx.ext.autodoc', 'sphinx.ext.autosummary']
exclude_patterns = ['_build']
templates_path = ['_templates']

myst_enable_extensions = ['dollarmath', 'deflist']
myst_heading_anchors = 3
# Files of the repository that pages point at are not pages.
ziafont.config.svg2 = False  # glyphs in place: names would clash on one page
suppress_warnings = ['myst.xref_missing', 'config.cache']

autosummary_generate = True
autodoc_typehints = 'none'
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

html_theme = 'furo'
html_title = f'rotorsoil_ros {version}'
html_static_path = ['_static']
html_css_files = ['site.css']
html_show_sphinx = False
html_copy_source = False
html_math_renderer = 'drawn'
html_theme_options = {'navigation_with_keys': True}


def drawn(formula: str, size: float, *, inline: bool) -> str:
    """Return a formula as an SVG, drawn with a font of its own, whatever the reader has."""
    made = Latex(formula, size=size, inline=inline)
    label = escape(' '.join(formula.split()), quote=True)
    return made.svg().replace(
        '<svg ', f'<svg role="img" aria-label="{label}" '
        f'style="vertical-align:{made.getyofst():.2f}px" ', 1)


def inline_formula(writer: HTML5Translator, node: nodes.math) -> None:
    """Write a formula in a line."""
    writer.body.append(f'<span class="math">{drawn(node.astext(), 16.0, inline=True)}</span>')
    raise nodes.SkipNode


def block_formula(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula on a line of its own; a page scrolls it if it is too wide."""
    writer.body.append(f'<div class="math">{drawn(node.astext(), 17.0, inline=False)}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> None:
    """Register the formulas; draw the wings and list the rooms as they are now."""
    app.add_html_math_renderer('drawn', (inline_formula, None), (block_formula, None))
    api = HERE / 'api'
    api.mkdir(exist_ok=True)
    (api / 'dag.svg').write_text(dag.drawing(), encoding='utf-8')
    (api / 'rooms.md').write_text(dag.rooms(), encoding='utf-8')
    (api / 'names.rst').write_text(dag.names(), encoding='utf-8')
