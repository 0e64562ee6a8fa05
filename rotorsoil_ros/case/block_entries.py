"""Which blocks the entries of a case file describe, and what follows where they say less."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
import math
from pathlib import Path

from rotorsoil_ros.case import cache, schema
from rotorsoil_ros.case.case_errors import Faults
from rotorsoil_ros.case.entries.entry import Place
from rotorsoil_ros.case.entries.site import BOUNDARY_ELEMENTS
from rotorsoil_ros.case.flexible.stacking import StackEntries
from rotorsoil_ros.errors import require
from rotorsoil_ros.ground.accuracy import gap
from rotorsoil_ros.ground.plan import Part, Plan
from rotorsoil_ros.ground.soil import Circle, Contact, Rectangle
from rotorsoil_ros.machine.foundation import Foundation, solid_inertia

# Blocks that touch do not overlap.
_ROUND_OFF = 1e-9


# What stands for a foundation that bends where its files are at fault.
_STAND_IN = Foundation('stand_in', Rectangle(1e-3, 1e-3), 0.0, 1.0, 0.0, (1.0, 1.0, 1.0))


@dataclass(frozen=True)
class BlockEntries:
    """Builds the foundations and says at which key one was refused."""

    faults: Faults
    files: dict[str, str]
    speed_range: tuple[float, float] | None
    cache_directory: str | Path | None
    mended: frozenset[Place]

    def foundations(self) -> tuple[Foundation, ...] | None:
        """Return the blocks, or None where one is at fault."""
        entries, built = self.faults.entries.foundations, dict[int, Foundation]()
        for index in self._stack.order():
            below = {block.name: block for block in built.values()}
            found = self.faults.attempt(partial(self._foundation, index, entries[index], below))
            if found is not None:
                built[index] = found
        if len(built) < len(entries):
            return None
        blocks = tuple(built[index] for index in range(len(entries)))
        if self._is_restacked:
            return blocks
        self.faults.attempt(lambda: self._stack.refuse_shared_places(blocks))
        if all(map(self._stands, entries)):
            self.faults.attempt(lambda: self._refuse_overlap(blocks))
        return blocks

    @property
    def _is_restacked(self) -> bool:
        """Whether nobody knows what stands on what, as what the file says of it is wrong."""
        return any(place[:1] == ('foundations',) and 'on' in place[2:3] for place in self.mended)

    @property
    def _stack(self) -> StackEntries:
        return StackEntries(self.faults)

    @property
    def _is_undecided(self) -> bool:
        """Whether a bearing does not say on which of the blocks it stands."""
        entries = self.faults.entries
        names = [block.name for block in entries.foundations]
        known = names if len(names) > 1 else [*names, None]
        return any(bearing.foundation not in known for bearing in entries.rotor.bearings)

    def _seats(self, entry: schema.FoundationEntry) -> list[float]:
        """Return where the bearings of a block stand along the shaft [m]."""
        entries = self.faults.entries
        # A bearing that names no block stands on the only one.
        own = (entry.name, None) if len(entries.foundations) == 1 else (entry.name,)
        return [bearing.position for bearing in entries.rotor.bearings
                if bearing.foundation in own]

    def _stands(self, entry: schema.FoundationEntry) -> bool:
        """Whether it is known where a block stands."""
        return entry.centre_y is not None or (
            bool(self._seats(entry)) and not self._is_undecided)

    def _refuse_overlap(self, foundations: tuple[Foundation, ...]) -> None:
        """Raise an InputError at the second of two blocks that stand on the same ground."""
        for second, block in enumerate(foundations):
            for first, other in enumerate(foundations[:second]):
                if (block.on and block.on.foundation) != (other.on and other.on.foundation):
                    continue
                x, y = (abs(block.centre_x - other.centre_x), abs(block.centre_y - other.centre_y))
                clear = gap(block.contact, other.contact, apart=(
                    other.centre_x - block.centre_x, other.centre_y - block.centre_y))
                if clear < -_ROUND_OFF * max(x, y):
                    where = f'{y:.4g} m' if x == 0.0 else f'{x:.4g} m across and {y:.4g} m along'
                    raise self.faults.error(
                        'foundations', second, problem=f'{block.name} must not overlap '
                        f'{other.name} (foundations.{first}), got {-clear:.4g} m of overlap'
                        f'{" along y" if x == 0.0 else ""}: centres are {where} apart')

    def _foundation(
        self, index: int, entry: schema.FoundationEntry, below: Mapping[str, Foundation],
    ) -> Foundation:
        seats = self._seats(entry)
        # Another machine, or the ground between blocks, may need one that carries none of this.
        coupled = bool(self.faults.under) or (
            self.faults.entries.support.model == BOUNDARY_ELEMENTS)
        # So may others that stand on it or below.
        if self._is_restacked or not self._stack.is_known:
            pass
        elif entry.on is not None or self._stack.is_carrying(entry.name):
            self._require_place(index, entry)
        elif not seats and not self._is_undecided and not (
                coupled and entry.centre_y is not None):
            self.faults.found.append(self.faults.error('foundations', index, problem=(
                f'no bearing stands on {entry.name}' + ('; a block beside the machine needs '
                                                        'centre_y in m' if coupled else ''))))
        mended = {place[:3] for place in self.mended}
        own = ('foundations', index)
        if (*own, 'flexible') in mended or (
                entry.flexible is not None and mended & {own, (*own, 'on')}):
            # Nobody can make up files, nor what stands on what they tell: what else is wrong is
            # looked for.
            return replace(_STAND_IN, name=entry.name)
        if (*own, 'on') in mended:
            entry = entry.model_copy(update={'on': None})
        if entry.flexible is not None:
            return self._flexible(index, entry, below)
        if entry.soil_under is not None:
            raise self.faults.error('foundations', index, 'soil_under', problem=(
                'belongs to a foundation that bends, and flexible is missing'))
        with self.faults.at('foundations', index, entry=entry):
            contact = self._contact(index, entry)
            mass, centre, inertia = self._body(index, entry, contact)
            along = entry.centre_y
            if along is None:  # without a seat it is never used: what is wrong has been kept
                upright = self.faults.entries.rotor.orientation == 'vertical'
                along = 0.5 * (min(seats) + max(seats)) if seats and not upright else 0.0
            # A plan turns about its centroid; its parts are placed about the keys' centre.
            x, y = contact.centroid if isinstance(contact, Plan) else (0.0, 0.0)
            product = 0.0
            if isinstance(contact, Plan) and entry.inertia is None:
                product = mass * contact.product_moment / contact.area
            block = Foundation(
                name=entry.name, contact=contact, mass=mass, centre_x=entry.centre_x + x,
                centre_y=along + y, centre_of_gravity_height=centre, inertia=inertia,
                height=entry.height, inertia_product=product,
                young_modulus=entry.young_modulus)
        return self._stack.stood(index, entry, block, below)

    def _require_place(self, index: int, entry: schema.FoundationEntry) -> None:
        """Keep a fault for a block in a stack of which nobody says where it is."""
        placed = entry.on is not None and (
            entry.on.place is not None or entry.on.places is not None)
        if (entry.centre_y is None and not placed and entry.flexible is None
                and not self._seats(entry) and not self._is_undecided):
            self.faults.found.append(self.faults.error('foundations', index, 'centre_y', problem=(
                f'is missing: no bearing stands on {entry.name}, which would say where it is')))

    def _flexible(
        self, index: int, entry: schema.FoundationEntry, below: Mapping[str, Foundation],
    ) -> Foundation:
        # Sparse matrices and their files take a third of a second to import.
        from rotorsoil_ros.case.flexible.entries import FlexibleEntries

        if self.speed_range is None:
            raise self.faults.error('foundations', index, 'flexible', problem=(
                'needs speed_range_rpm, up to which it has to be known'))
        kept = cache.Cache(cache.directory(self.cache_directory))
        return FlexibleEntries(self.faults, self.files, self.speed_range[1], kept).foundation(
            index, entry, below)

    def _body(
        self, index: int, entry: schema.FoundationEntry, contact: Contact,
    ) -> tuple[float, float, tuple[float, float, float]]:
        """Return mass, centre of gravity and inertia: given, or those of a solid block."""
        mass, centre, inertia, height = (
            entry.mass, entry.centre_of_gravity_height, entry.inertia, entry.height)
        if (mass is None) is (entry.density is None):
            both = 'got both' if entry.density is not None else 'and neither is there'
            raise self.faults.error(
                'foundations', index, 'mass', problem=f'needs a value in kg, or density in '
                                                      f'kg/m^3 and height in m, {both}')
        if mass is not None and centre is not None and inertia is not None:
            return mass, centre, inertia
        if height is None:
            given = {'mass': mass, 'centre_of_gravity_height': centre, 'inertia': inertia}
            missing = next(key for key, value in given.items() if value is None)
            raise self.faults.error('foundations', index, missing, problem='is missing, and so is '
                                                      'height in m, of which it would follow')
        require(0.0 < height < math.inf, 'height', '> 0 m and finite', height)
        if mass is None and entry.density is not None:
            require(0.0 < entry.density < math.inf, 'density', '> 0 kg/m^3', entry.density)
            mass = entry.density * contact.area * height
        assert mass is not None
        return (mass, 0.5 * height if centre is None else centre,
                solid_inertia(contact, mass=mass, height=height) if inertia is None else inertia)

    def _contact(self, index: int, entry: schema.FoundationEntry) -> Contact:
        width, length, radius = entry.half_width, entry.half_length, entry.radius
        if entry.parts is not None:
            given = next((key for key, value in (
                ('half_width', width), ('half_length', length), ('radius', radius))
                if value is not None), None)
            if given is not None:
                raise self.faults.error('foundations', index, 'parts', problem=(
                    f'takes the place of half_width, half_length and radius, got {given} too'))
            return Plan(self._parts(index, entry.parts))
        if radius is not None and width is None and length is None:
            return Circle(radius)
        if radius is None and width is not None and length is not None:
            return Rectangle(width, length)
        raise self.faults.error('foundations', index, problem=(
            'needs either half_width and half_length, or parts, or radius, in m'))

    def _parts(self, index: int, entries: list[schema.PartEntry]) -> tuple[Part, ...]:
        def part(number: int, entry: schema.PartEntry) -> Part:
            with self.faults.at('foundations', index, 'parts', number, entry=entry):
                return Part(entry.half_width, entry.half_length, *entry.centre)

        return tuple(part(number, entry) for number, entry in enumerate(entries))
