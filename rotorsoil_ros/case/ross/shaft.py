"""The shaft of a rotor that ROSS has saved: its pieces, and the layers that lie on them."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
import math
from typing import Any

from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.ross.file import RossReader, Table

_SAME = 1e-12
_TOUCHING = 1e-9
# What loads and damps a piece, where anything does.
_LOADS = ('axial_force', 'torque', 'external_damping')
# What our shaft always has.
_SHAFT_EFFECTS = ('shear_effects', 'rotary_inertia', 'gyroscopic')


class ShaftReader(RossReader):
    """Turns the shaft elements of a file into sections, noting what does not fit."""

    def shaft(self) -> tuple[list[dict[str, Any]], dict[int, float]]:
        """Return the sections and the place of each node along them."""
        elements = sorted(self.file.of_kind('ShaftElement'), key=lambda one: self.file.node(*one))
        if not elements:
            raise self.file.error('', 'holds no ShaftElement; is it a rotor saved by ROSS?')
        columns = [list(group) for _, group in
                   groupby(elements, key=lambda one: self.file.node(*one))]
        first = self.file.node(*columns[0][0])
        self._refuse_several_shafts([self.file.node(*column[0]) for column in columns])
        pieces, nodes, place = [], {first: 0.0}, 0.0
        for number, column in enumerate(columns, start=first):
            # The shaft itself is innermost; what is shrunk onto it is not.
            column.sort(key=lambda one: self.file.number(one[0], one[1], 'idl'))
            piece = self._piece(*column[0])
            self._carry_layers(piece, column[1:])
            pieces.append(piece)
            place += piece['length']
            nodes[number + 1] = place
        return list(_merged(pieces)), nodes

    def _refuse_several_shafts(self, begins: Sequence[int]) -> None:
        """Raise an InputError that says what joins shafts of which a case has one."""
        couplings = [title for title, _ in self.file.of_kind('Coupling')]
        if couplings:
            raise self.file.error(couplings[0], 'is a coupling; a case has one shaft without '
                                                'couplings')
        shafts = [[begins[0], begins[0]]]
        for node in begins:
            if node > shafts[-1][1]:
                shafts.append([node, node])
            shafts[-1][1] = node + 1
        shafts = [shaft for shaft in shafts if shaft[1] > shaft[0]]
        if len(shafts) == 1:
            return
        gears = ', '.join(title for title, _ in self.file.of_kind('Gear'))
        nodes = ' and '.join(f'{low} to {high}' for low, high in shafts)
        raise self.file.error('', f'holds {len(shafts)} shafts, over the nodes {nodes}, with '
                                  + (f'the gears {gears}' if gears else 'no ShaftElement between')
                                  + '; a case has one')

    def _piece(self, title: str, table: Table) -> dict[str, Any]:
        self._note_effects(title, table)
        outer, inner = (self.file.number(title, table, key) for key in ('odl', 'idl'))
        ends = (self.file.number(title, table, 'odr', outer),
                self.file.number(title, table, 'idr', inner))
        piece: dict[str, Any] = {'length': self.file.number(title, table, 'L'),
                                 'outer_diameter': outer, 'inner_diameter': inner}
        if ends != (outer, inner):
            piece['outer_diameter_end'], piece['inner_diameter_end'] = ends
        return {**piece, 'elements': 1, 'material': self._material(title, table),
                **self._loads(title, table)}

    def _loads(self, title: str, table: Table) -> dict[str, Any]:
        """Return what loads and damps a piece, where anything does."""
        found: dict[str, Any] = {
            key: value for key in ('axial_force', 'torque')
            if (value := self.file.number(title, table, key, 0.0)) != 0.0}
        alpha, beta = (self.file.number(title, table, key, 0.0) for key in ('alpha', 'beta'))
        if alpha != 0.0 or beta != 0.0:
            found['external_damping'] = {'mass': alpha, 'stiffness': beta}
        return found

    def _note_effects(self, title: str, table: Table) -> None:
        for key in _SHAFT_EFFECTS:
            if not table.get(key, True):
                self.lost.append(f'{title}: {key} = false; our shaft always has them')
        method = table.get('shear_method_calc', 'cowper')
        if method != 'cowper':
            self.lost.append(f'{title}: shear_method_calc = {shown(method)}; ours is cowper')

    def _carry_layers(self, piece: dict[str, Any], layers: Sequence[tuple[str, Table]]) -> None:
        """
        Make one section of what touches and is of one material; add the rest as mass.

        Between the same nodes a layer may have a length of its own: its mass is that of ROSS.
        """
        for title, table in layers:
            layer = self._piece(title, table)
            for key in _LOADS:
                if key in layer:
                    self.lost.append(f'{title}: {key} of a second layer, {shown(layer[key])}')
            if _is_one_body(piece, layer):
                outer, end = _ends(layer, 'outer')
                piece['outer_diameter'] = outer
                if end != outer or 'inner_diameter_end' in piece:
                    piece['outer_diameter_end'] = end
                    piece.setdefault('inner_diameter_end', piece['inner_diameter'])
                self.assumed.append(f'{title}: touches the shaft below it and is of its '
                                    'material: one section')
                continue
            area = 0.25 * math.pi * sum(
                sign * (left**2 + left * right + right**2) / 3.0
                for sign, (left, right) in ((1.0, _ends(layer, 'outer')),
                                            (-1.0, _ends(layer, 'inner'))))
            mass = area * layer['length'] * layer['material']['density']
            piece['added_mass'] = piece.get('added_mass', 0.0) + mass / piece['length']
            self.lost.append(f'{title}: stiffness and rotary inertia of a second layer; its mass '
                             f'of {mass:g} kg is kept as added_mass')

    def _material(self, title: str, table: Table) -> dict[str, float]:
        material = table.get('material')
        if not isinstance(material, dict):
            raise self.file.error(f'{title}.material', 'is missing')
        place = f'{title}.material'
        young = self.file.number(place, material, 'E')
        if not young > 0.0:
            self.file.kept(f'{place}.E', f'must be > 0 Pa, got {young:g}')
        poisson = (self.file.number(place, material, 'Poisson') if 'G_s' not in material
                   else young / (2.0 * self.file.number(place, material, 'G_s')) - 1.0)
        return {'young_modulus': young, 'poisson_ratio': poisson,
                'density': self.file.number(place, material, 'rho')}


def _ends(piece: Mapping[str, Any], side: str) -> tuple[float, float]:
    """Return the outer or the inner diameter at both ends [m]."""
    left = piece[f'{side}_diameter']
    return left, piece.get(f'{side}_diameter_end', left)


def _is_one_body(piece: Mapping[str, Any], layer: Mapping[str, Any]) -> bool:
    """Return whether a layer continues a piece outwards, over its length and in its material."""
    pairs = [(piece['length'], layer['length']),
             *zip(_ends(piece, 'outer'), _ends(layer, 'inner'), strict=True),
             *((piece['material'][key], layer['material'][key]) for key in piece['material'])]
    return all(abs(mine - theirs) <= _TOUCHING * abs(mine) for mine, theirs in pairs)


def _merged(pieces: Sequence[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Yield sections: equal cylindrical pieces that follow one another become one."""
    section: dict[str, Any] | None = None
    for piece in pieces:
        if section is not None and _alike(section, piece):
            section['length'] += piece['length']
            section['elements'] += 1
            continue
        if section is not None:
            yield section
        section = dict(piece)
    if section is not None:
        yield section


def _alike(section: Mapping[str, Any], piece: Mapping[str, Any]) -> bool:
    if 'outer_diameter_end' in section or 'outer_diameter_end' in piece:
        return False
    each = section['length'] / section['elements']
    same = all(section.get(key) == piece.get(key) for key in (
        'outer_diameter', 'inner_diameter', 'material', 'added_mass', *_LOADS))
    return same and abs(each - piece['length']) <= _SAME * each
