"""Which machine a rotor is that ROSS has saved; ROSS itself is not needed."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
import re
from typing import Any

from rotorsoil_ros.case.document import shown
from rotorsoil_ros.case.ross.coefficients import CoefficientReader
from rotorsoil_ros.case.ross.file import one_line, RossFile, Table
from rotorsoil_ros.case.ross.shaft import ShaftReader
from rotorsoil_ros.units import hz_to_rad_s, rad_s_to_rpm

_SPEED_RANGE_RPM = (0.0, 10_000.0)
_SHAFT_HEIGHT = 1.0
# Parameters of a model that are carried over as the damping of the rotor.
_DAMPING = ('alpha', 'beta')
# Parameters of a model that tell how it was run, and not what it is.
_OF_A_RUN = ('min_w', 'max_w', 'rated_w', 'tag')


@dataclass(frozen=True)
class Imported:
    """
    A rotor as a case.

    Attributes
    ----------
    content : dict
        What a case file holds.
    assumed : list of str
        What ROSS does not know and a case needs.
    lost : list of str
        What could not be carried over.

    """

    content: dict[str, Any]
    assumed: list[str]
    lost: list[str]


def read(path: Path, speed_range_rpm: tuple[float, float] | None = None) -> Imported:
    """
    Read a rotor that ROSS saved as TOML or JSON.

    Parameters
    ----------
    path : Path
        The file.
    speed_range_rpm : tuple of two floats or None
        Of the case; None takes what the tables of the bearings cover.

    Raises
    ------
    InputError
        If the file is not such a rotor, or nothing of it could stand.

    """
    file = RossFile.read(path)
    with file.telling_all():
        return _Importer(file).imported(speed_range_rpm)


@dataclass
class _Importer:
    """
    Turns the tables of a file into a case, noting what does not fit.

    The spin of ROSS takes x into y, which is up; ours takes z, which is up, into x. So y
    becomes z, and x changes its sign: cross terms do too.
    """

    file: RossFile
    assumed: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    names: set[str] = field(default_factory=set)

    def imported(self, speed_range_rpm: tuple[float, float] | None) -> Imported:
        shaft, nodes = ShaftReader(self.file, self.assumed, self.lost).shaft()
        damping = self._damping(shaft)
        discs = [self._disc(title, table, nodes)
                 for title, table in self.file.of_kind('Disk', 'Gear')]
        discs += self._point_masses(nodes)
        bearings = self._bearings(nodes)
        if damping and damping['external_damping']['mass'] and any(
                'pedestal' in bearing for bearing in bearings):
            self.lost.append(f'parameters: alpha = {damping["external_damping"]["mass"]:g} of '
                             'what stands below the bearings; of the rotor it is kept')
        self._note_strangers()
        low, high = self._speed_range(bearings) if speed_range_rpm is None else speed_range_rpm
        self.assumed += [
            'support: rigid; for a machine on soil give soil, support and foundations',
            f'rotor.shaft_height: {_SHAFT_HEIGHT:g} m, without effect on a rigid support',
            'unbalances: none, a saved rotor has none']
        content = {
            'name': _name(self.file.path.stem, set()), 'support': {'model': 'rigid'},
            'rotor': {'shaft_height': _SHAFT_HEIGHT, **damping, 'shaft': shaft, 'discs': discs,
                      'bearings': bearings},
            'unbalances': [], 'speed_range_rpm': [low, high]}
        return Imported(content, self.assumed, self.lost)

    @property
    def _reader(self) -> CoefficientReader:
        return CoefficientReader(self.file, self.assumed, self.lost)

    def _damping(self, shaft: list[dict[str, Any]]) -> dict[str, Any]:
        """
        Return the damping of the whole rotor; that of the pieces then counts for nothing.

        So ROSS has it, which takes what is given for the rotor, else for its elements.
        """
        parameters = self.file.tables.get('parameters')
        given = parameters if isinstance(parameters, dict) else {}
        alpha, beta = (self.file.number('parameters', given, key, 0.0)
                       for key in ('alpha', 'beta'))
        if alpha == beta == 0.0:
            return {}
        for piece in shaft:
            if piece.pop('external_damping', None) is not None:
                self.lost.append('alpha and beta of shaft elements, beside those of the whole '
                                 'rotor, which ROSS takes alone')
        return {'external_damping': {'mass': alpha, 'stiffness': beta}}

    def _disc(self, title: str, table: Table, nodes: Mapping[int, float]) -> dict[str, Any]:
        if title.startswith('Gear'):
            self.lost.append(f'{title}: its mesh; mass and inertia are kept as a disc')
        return {'name': self._station(title, table), 'position': self._place(title, table, nodes),
                'mass': self.file.number(title, table, 'm'),
                'diametral_inertia': self.file.number(title, table, 'Id'),
                'polar_inertia': self.file.number(title, table, 'Ip')}

    def _point_masses(self, nodes: Mapping[int, float]) -> list[dict[str, Any]]:
        """Return the masses on the shaft as discs without inertia."""
        discs = []
        for title, table in self.file.of_kind('PointMass'):
            if self.file.node(title, table) not in nodes:
                continue
            masses = self._masses(title, table)
            if masses['xx'] != masses['zz']:
                self.lost.append(f'{title}: mass of {masses["xx"]:g} kg across; {masses["zz"]:g} '
                                 'kg is kept in both directions')
            discs.append({'name': self._station(title, table),
                          'position': self._place(title, table, nodes), 'mass': masses['zz'],
                          'diametral_inertia': 0.0, 'polar_inertia': 0.0})
        return discs

    def _masses(self, title: str, table: Table) -> dict[str, float]:
        both = self.file.number(title, table, 'm', 0.0)
        return {ours: self.file.number(title, table, theirs, both)
                for ours, theirs in (('xx', 'mx'), ('zz', 'my'))}

    def _bearings(self, nodes: Mapping[int, float]) -> list[dict[str, Any]]:
        found: list[tuple[str, Table]] = [
            (title, table) for title, table in self.file.tables.items()
            if isinstance(table, dict) and 'kxx' in table and 'n' in table]
        on_shaft = [one for one in found if self.file.node(*one) in nodes]
        below: list[tuple[str, Table]] = [
            one for one in found if self.file.node(*one) not in nodes]
        masses = [one for one in self.file.of_kind('PointMass')
                  if self.file.node(*one) not in nodes]
        bearings = []
        for title, table in on_shaft:
            bearing = {'name': self._station(title, table),
                       'position': self._place(title, table, nodes),
                       **self._reader.read(title, table)}
            pedestal = self._pedestal(title, table, below, masses)
            if pedestal is not None:
                bearing['pedestal'] = pedestal
            bearings.append(bearing)
        for title, _ in below:
            self.lost.append(f'{title}: stands on nothing that was carried over')
        for title, table in masses:
            self.lost.append(f'{title}: {shown(table.get("m", table.get("mx")))} kg at node '
                             f'{shown(table.get("n"))}')
        return bearings

    def _pedestal(
        self, title: str, table: Table, below: list[tuple[str, Table]],
        masses: list[tuple[str, Table]],
    ) -> dict[str, Any] | None:
        """Return what holds a bearing's housing, taking it out of what is still to be placed."""
        if table.get('n_link') is None:
            return None
        link = table['n_link']
        supports = [one for one in below if one[1].get('n') == link]
        if not supports:
            self.lost.append(f'{title}: n_link = {shown(link)}, where nothing stands')
            return None
        support_title, support = supports[0]
        below.remove(supports[0])
        held = self._reader.read(support_title, support)
        if any('speed_rpm' in matrix for matrix in held.values()):
            self.lost.append(f'{support_title}: a pedestal with a table over speed; {title} '
                             'stands on rigid ground instead')
            return None
        if held.pop('inertia', None) is not None:
            self.lost.append(f'{support_title}: inertia of a pedestal')
        if support.get('n_link') is not None:
            self.lost.append(f'{support_title}: n_link, a second support below the first')
        return {'mass': self._mass_at(link, masses), **held}

    def _mass_at(self, node: object, masses: list[tuple[str, Table]]) -> dict[str, float]:
        total = {'xx': 0.0, 'zz': 0.0}
        for one in [one for one in masses if one[1].get('n') == node]:
            for axis, mass in self._masses(*one).items():
                total[axis] += mass
            masses.remove(one)
        return total

    def _speed_range(self, bearings: Sequence[Table]) -> tuple[float, float]:
        matrices = [bearing[key] for bearing in bearings
                    for key in ('stiffness', 'damping', 'inertia') if key in bearing]
        tables = [matrix['speed_rpm'] for matrix in matrices if 'speed_rpm' in matrix]
        # Unbalance vibrates with the frequency of the speed.
        tables += [[rad_s_to_rpm(hz_to_rad_s(one)) for one in matrix['frequency_hz']]
                   for matrix in matrices if 'frequency_hz' in matrix]
        low = max((table[0] for table in tables), default=_SPEED_RANGE_RPM[0])
        high = min((table[-1] for table in tables), default=_SPEED_RANGE_RPM[1])
        self.assumed.append(f'speed_range_rpm: {low:g} to {high:g}'
                            + (', what the tables of the bearings cover' if tables else ''))
        return low, high

    def _note_strangers(self) -> None:
        for title, table in self.file.tables.items():
            known = title.startswith(('ShaftElement', 'Disk', 'Gear', 'PointMass'))
            carried = isinstance(table, dict) and 'n' in table and (known or 'kxx' in table)
            if title in ('ross_version', '_note') or carried or not table:
                continue
            if title == 'parameters' and isinstance(table, dict):
                self._note_parameters(table)
                continue
            self.lost.append(f'{one_line(title)}: is not known here')

    def _note_parameters(self, table: Table) -> None:
        """Note what holds for the whole model, where it is not nothing."""
        for key, value in table.items():
            if value and key not in (*_OF_A_RUN, *_DAMPING):
                self.lost.append(f'parameters: {one_line(key)} = {shown(value)}')

    def _place(self, title: str, table: Table, nodes: Mapping[int, float]) -> float:
        node = self.file.node(title, table)
        if node not in nodes:
            raise self.file.error(f'{title}.n', f'must be a node of the shaft, 0 to {max(nodes)}, '
                                                f'got {node}')
        return nodes[node]

    def _station(self, title: str, table: Table) -> str:
        tag = table.get('tag')
        return _name(tag if isinstance(tag, str) and tag else title, self.names)


def _name(text: str, taken: set[str]) -> str:
    """Return a name that a case allows and that is not taken, and take it."""
    plain = re.sub(r'[^a-z0-9]+', '_', text.lower()).strip('_')[:50]
    plain = plain if plain[:1].isalpha() else f'part_{plain}'.rstrip('_')
    name, number = plain, 2
    while name in taken:
        name, number = f'{plain}_{number}', number + 1
    taken.add(name)
    return name
