"""Which keys a shaft may have: its pieces, what loads them, and what they lose."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Discriminator, Tag

from rotorsoil_ros.case.entries.entry import Entry, given_or_named, KEYS, WORD
from rotorsoil_ros.case.quantities import (
    Count,
    KilogramPerCubicMetre,
    KilogramPerMetre,
    Metre,
    Newton,
    NewtonMetre,
    Pascal,
    PerSecond,
    Ratio,
    Second,
)


class MaterialEntry(Entry):
    """Shaft material."""

    young_modulus: Pascal
    poisson_ratio: Ratio
    density: KilogramPerCubicMetre


AnyMaterial: TypeAlias = Annotated[
    Annotated[MaterialEntry, Tag(KEYS)]
    | Annotated[Literal['steel', 'stainless_steel', 'cast_iron', 'aluminium'], Tag(WORD)],
    Discriminator(given_or_named)]


class InternalDamping(Entry):
    """What the material of the shaft loses: it turns with the rotor."""

    viscous: Second = 0.0
    loss_factor: Ratio = 0.0


class ExternalDamping(Entry):
    """What does not turn with the rotor, in proportion to mass and to stiffness."""

    mass: PerSecond = 0.0
    stiffness: Second = 0.0


class Loaded(Entry):
    """What a piece of shaft may have of its own, or the rotor for all of them."""

    axial_force: Newton | None = None
    torque: NewtonMetre | None = None
    internal_damping: InternalDamping | None = None
    external_damping: ExternalDamping | None = None


class Section(Loaded):
    """Piece of shaft; a diameter at the right end makes it conical."""

    length: Metre
    outer_diameter: Metre
    outer_diameter_end: Metre | None = None
    inner_diameter: Metre = 0.0
    inner_diameter_end: Metre | None = None
    elements: Count
    material: AnyMaterial | None = None
    added_mass: KilogramPerMetre | None = None
