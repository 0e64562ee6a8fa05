"""
What the pages show of the code as it is now: wings and who may take from whom, rooms, names.

`conf.py` writes it into `docs/api`. The wings come from `test/test_architecture.py`, where a
test holds every import against them.
"""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGE = ROOT / 'rotorsoil_ros'
TOP = ['cli', 'testing', 'node', 'screen', 'figures', 'bags', 'feeds', 'wire', 'monitor', 'case',
       'machine', 'rotor', 'ground', 'base']
# Column and row of each wing, and what it is for.
PLACES = {
    'base': (1, 7, 'arrays, errors, units, channels, events'),
    'ground': (0, 6, 'soil under a contact'),
    'rotor': (2, 6, 'shafts, discs, bearings'),
    'machine': (1, 5, 'rotor on foundation on ground'),
    'case': (1, 4, 'the YAML file, its cache'),
    'monitor': (1, 3, 'speed and vectors in, events out'),
    'wire': (0, 2.2, 'events to bytes of messages'),
    'bags': (0, 1.2, 'MCAP in and out'),
    'feeds': (3, 1.2, 'control rooms, other halls'),
    'figures': (1, 1.2, 'pictures, pages on paper'),
    'screen': (2, 1.2, 'recording, live view'),
    'node': (1, 0.2, 'the ROS graph'),
    'cli': (1, -0.8, 'verbs: parse, call, print'),
    'testing': (2, -0.8, 'tests of those who talk to it'),
}
WIDTH, HEIGHT, BOX, TALL = 925, 640, 200, 44


def taken_from() -> dict[str, set[str]]:
    """Return from which wings each may take, as the test has it."""
    tree = ast.parse((ROOT / 'test' / 'test_architecture.py').read_text())
    [value] = [node.value for node in tree.body if isinstance(node, ast.Assign)
               and isinstance(node.targets[0], ast.Name) and node.targets[0].id == 'DAG']
    code = compile(ast.Expression(value), 'DAG', 'eval')
    return eval(code, {'BASE': 'base', 'FACE': 'rotorsoil_ros'})


def _corner(wing: str) -> tuple[float, float]:
    column, row, _ = PLACES[wing]
    return 25 + column * 225, 75 + row * 70


def drawing() -> str:
    """Return the wings as an SVG; an arrow points at what a wing takes from."""
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
             'role="img" font-family="sans-serif" text-anchor="middle">',
             '<title>Wings; an arrow points at what a wing takes from</title>',
             '<defs><marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" '
             'markerHeight="8" orient="auto"><path d="M0,0 L8,4 L0,8 z" fill="#667"/></marker>'
             '</defs>', f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>']
    for wing, below in taken_from().items():
        for lower in sorted(set(below) & PLACES.keys()) if wing in PLACES else ():
            x, y = _corner(wing)
            to_x, to_y = _corner(lower)
            lines.append(
                f'<line x1="{x + BOX / 2:g}" y1="{y + TALL:g}" x2="{to_x + BOX / 2:g}" '
                f'y2="{to_y:g}" stroke="#667" marker-end="url(#head)"/>')
    for wing, (_, _, purpose) in PLACES.items():
        x, y = _corner(wing)
        lines += [
            f'<rect x="{x:g}" y="{y:g}" width="{BOX}" height="{TALL}" rx="6" fill="#eef3f8" '
            'stroke="#357"/>',
            f'<text x="{x + BOX / 2:g}" y="{y + 19:g}" font-size="15" font-weight="bold" '
            f'fill="#123">{wing}</text>',
            f'<text x="{x + BOX / 2:g}" y="{y + 36:g}" font-size="11.5" fill="#345">{purpose}'
            '</text>']
    return '\n'.join([*lines, '</svg>', ''])


def _question(path: Path) -> str:
    """Return what the first line of a room's docstring says."""
    return (ast.get_docstring(ast.parse(path.read_text())) or '').split('\n')[0]


def rooms() -> str:
    """Return a page with every room and the question that it answers."""
    lines = ['# Every room', '', 'A room is a module; its first line says what it answers.', '']
    for wing in TOP:
        folder = PACKAGE if wing == 'base' else PACKAGE / wing
        found = sorted(folder.glob('*.py') if wing == 'base' else folder.rglob('*.py'))
        lines += [f'## {wing}', '', '| room | answers |', '|---|---|']
        lines += [f'| `{path.relative_to(folder).with_suffix("")}` | {_question(path)} |'
                  for path in found if path.stem not in ('__init__', '__main__')]
        lines.append('')
    return '\n'.join(lines)


def names() -> str:
    """Return the page of the public names, each with a page of its own."""
    import rotorsoil_ros

    lines = ['Every public name', '=================', '', '.. currentmodule:: rotorsoil_ros', '',
             '.. autosummary::', '   :toctree: .', '']
    return '\n'.join([*lines, *(f'   {name}' for name in rotorsoil_ros.__all__), ''])
