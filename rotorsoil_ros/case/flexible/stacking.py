"""Which foundations of a case file stand on others, where, and what is refused of it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NoReturn

import numpy as np

from rotorsoil_ros.arrays import FloatArray
from rotorsoil_ros.case import schema
from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.errors import RotorSoilError
from rotorsoil_ros.machine.flexible.body import FlexibleBody
from rotorsoil_ros.machine.foundation import Foundation, Stand

# What stands on a place is there within this [m].
_BESIDE = 0.02

# What only the ground knows of.
_OF_GROUND = ('embedment', 'side_contact', 'stiffness_file', 'soil_under')


@dataclass(frozen=True)
class StackEntries:
    """Puts foundations on others and says at which key that was refused."""

    faults: Faults

    def order(self) -> list[int]:
        """Return the foundations, each behind that on which it stands, circles last."""
        entries = self.faults.entries.foundations
        names = [entry.name for entry in entries]
        order, left = list[int](), list(range(len(entries)))
        while ready := [index for index in left if (on := entries[index].on) is None
                        or on.foundation not in names or names.index(on.foundation) in order]:
            order += ready
            left = [index for index in left if index not in ready]
        return order + left

    def is_carrying(self, name: str) -> bool:
        """Return whether something stands on a foundation."""
        return any(entry.on is not None and entry.on.foundation == name
                   for entry in self.faults.entries.foundations)

    def stood(
        self, index: int, entry: schema.FoundationEntry, block: Foundation,
        built: Mapping[str, Foundation],
    ) -> Foundation:
        """
        Return a foundation where it stands.

        Parameters
        ----------
        index, entry
            Of the case file.
        block : Foundation
            As if it stood on the ground.
        built : mapping of str to Foundation
            Those below, by name.

        """
        on = entry.on
        if on is None:
            return block
        given = next((key for key in _OF_GROUND if getattr(entry, key)), None)
        if given is not None:
            raise self.faults.error('foundations', index, given, problem=(
                f'belongs to the ground, and {entry.name} stands on {on.foundation}'))
        self._refuse_unknown(index, entry.name, on)
        self._refuse_circle(index, entry.name)
        below = built.get(on.foundation)
        if below is None or (below.body is None and self._is_bent(on.foundation)):
            return block  # what is wrong with that below is told there
        if below.body is None:
            return self._on_block(index, on, block, below)
        names = self._places(index, on, block)
        stood = replace(block, on=Stand(below.name, tuple(names.values()), 0.0))
        key = 'place' if on.places is None else 'places'
        with self.faults.at('foundations', index, 'on', entry=on):
            try:
                below.under(stood)
            except RotorSoilError as error:
                self._refuse(index, key, str(error).removeprefix('place '))
        return self._at(index, entry, stood, _middle(block, below, below.body, names), key)

    def _refuse(self, index: int, key: str, problem: str) -> NoReturn:
        raise self.faults.error('foundations', index, 'on', key, problem=problem)

    def _is_bent(self, name: str) -> bool:
        return any(entry.name == name and entry.flexible is not None
                   for entry in self.faults.entries.foundations)

    @property
    def is_known(self) -> bool:
        """Whether all that carries something is there."""
        entries = self.faults.entries.foundations
        return all(entry.on is None or any(
            other.name == entry.on.foundation for other in entries if other is not entry)
            for entry in entries)

    def _refuse_unknown(self, index: int, name: str, on: schema.OnEntry) -> None:
        others = [entry.name for entry in self.faults.entries.foundations if entry.name != name]
        if on.foundation not in others:
            self._refuse(index, 'foundation', (
                f'must be one of {", ".join(others)}, got {on.foundation}' if others else
                f'must be another foundation, of which there is none, got {on.foundation}'))

    def _refuse_circle(self, index: int, name: str) -> None:
        """Raise an InputError at the first of foundations that stand on each other."""
        entries = self.faults.entries.foundations
        stands = {entry.name: entry.on.foundation for entry in entries if entry.on is not None}
        passed = [name]
        while passed[-1] in stands and passed[-1] not in passed[:-1]:
            passed.append(stands[passed[-1]])
        if passed[-1] == name and len(passed) > 1 and index == min(
                place for place, entry in enumerate(entries) if entry.name in passed):
            self._refuse(index, 'foundation', f'goes round in a circle: {" on ".join(passed)}')

    def _on_block(
        self, index: int, on: schema.OnEntry, block: Foundation, below: Foundation,
    ) -> Foundation:
        """Return a foundation on the top of a rigid block."""
        for key in ('place', 'places'):
            if getattr(on, key) is not None:
                self._refuse(index, key, f'belongs to a foundation that bends, and {below.name} '
                                         'is a block: it stands on its top')
        if below.height is None:
            self._refuse(index, 'foundation', f'needs the height of {below.name} in m, on whose '
                                              f'top {block.name} stands')
        return replace(block, on=Stand(below.name, (), below.elevation + below.height))

    def _places(self, index: int, on: schema.OnEntry, block: Foundation) -> dict[str, str]:
        """Return on which place each contact stands."""
        contacts = list(dict.fromkeys(dof.station for dof in block.footing))
        if (on.place is None) is (on.places is None):
            got = 'neither' if on.place is None else 'both'
            raise self.faults.error('foundations', index, 'on', problem=(
                'needs either place, of one contact, or places, one for each of several, got '
                f'{got}'))
        if on.place is not None:
            if len(contacts) > 1:
                self._refuse(index, 'place', f'belongs to one contact; places must name one for '
                                             f'each of {", ".join(contacts)}')
            return {contacts[0]: on.place}
        assert on.places is not None
        if len(contacts) == 1:
            self._refuse(index, 'places', f'belong to several contacts, and {block.name} has one')
        if set(on.places) != set(contacts):
            self._refuse(index, 'places', f'must name one for each of {", ".join(contacts)}, got '
                                          f'{", ".join(on.places) or "none"}')
        twice = [name for name in on.places.values() if list(on.places.values()).count(name) > 1]
        if twice:
            self._refuse(index, 'places', f'must differ, got {twice[0]} twice')
        return {contact: on.places[contact] for contact in contacts}

    def _at(
        self, index: int, entry: schema.FoundationEntry, block: Foundation, found: FloatArray,
        key: str,
    ) -> Foundation:
        """Return a foundation whose contacts have their centre where their places say, (c, 3)."""
        middle = found.mean(axis=0)
        if not np.isfinite(middle).all():
            self._refuse(index, key, 'must be where somebody says, in the dofs of that below')
        off = np.abs(found - middle).max()
        if off > _BESIDE:
            self._refuse(index, key, f'must lie to each other as the contacts do within '
                                     f'{_BESIDE:g} m, got {off:.3g} m')
        x, y, z = middle.tolist()
        given = {'centre_x': x, 'centre_y': y}
        for name, there in given.items():
            own = getattr(entry, name)
            if name in entry.model_fields_set and own is not None and abs(own - there) > _BESIDE:
                raise self.faults.error('foundations', index, name, problem=(
                    f'must be where its place is, {there:.4g} m, or be left out, got {own:g}'))
        assert block.on is not None
        return replace(block, centre_x=x, centre_y=y, on=replace(block.on, elevation=z))

    def refuse_shared_places(self, blocks: tuple[Foundation, ...]) -> None:
        """Raise an InputError at the second of two foundations on one place."""
        taken: dict[tuple[str, str], int] = {}
        for index, block in enumerate(blocks):
            for name in () if block.on is None else block.on.places:
                first = taken.setdefault((block.on.foundation if block.on else '', name), index)
                if first != index:
                    self._refuse(index, 'place' if len(block.on.places if block.on else ()) == 1
                                 else 'places', f'must be free, and {name} carries '
                                 f'{blocks[first].name} (foundations.{first})')


def _middle(
    block: Foundation, below: Foundation, body: FlexibleBody, names: Mapping[str, str],
) -> FloatArray:
    """Return where each contact says that the centre of all is, in the axes of the ground."""
    shift = np.array([below.centre_x, below.centre_y, below.elevation]) - body.centre
    where = {dof.station: np.array(dof.place) + shift for dof in body.dofs}
    return np.array([where[names[dof.station]] - dof.place for dof in block.footing])
