"""Which keys a case file may have, and of which kind and unit each is."""

from typing import Annotated, Literal, TypeAlias

from pydantic import Discriminator, Field, StrictBool, StringConstraints, Tag

from rotorsoil_ros.case.entries.bearing import BearingEntry
from rotorsoil_ros.case.entries.entry import (
    Entry,
    EVEN,
    given_or_named,
    KEYS,
    LAYERED,
    NUMBER,
    TABLE,
    WORD,
)
from rotorsoil_ros.case.entries.shaft import AnyMaterial, Loaded, Section
from rotorsoil_ros.case.quantities import (
    BalanceGrade,
    Celsius,
    Count,
    Degree,
    FileName,
    Hertz,
    Kilogram,
    KilogramMetre,
    KilogramPerCubicMetre,
    KilogramSquareMetre,
    Metre,
    MetreOrEndless,
    MetrePerSecond,
    MetrePerSecondSquared,
    Name,
    Pascal,
    ProbeAngle,
    Radian,
    Ratio,
    Rpm,
    Usual,
)
from rotorsoil_ros.machine.foundation import CONCRETE


class SoilEntry(Entry):
    """Half-space, by its shear modulus or by the velocity of its shear waves."""

    ways = ('shear_modulus',), ('shear_wave_velocity',)
    shear_modulus: Pascal | None = None
    shear_wave_velocity: MetrePerSecond | None = None
    poisson_ratio: Ratio
    density: KilogramPerCubicMetre
    loss_factor: Ratio


class LayerEntry(SoilEntry):
    """Layer of the ground."""

    thickness: Metre


class LayersEntry(Entry):
    """Ground in layers, from the surface down, and what lies below them."""

    layers: list[LayerEntry]
    below: Annotated[
        Annotated[SoilEntry, Tag(KEYS)] | Annotated[Literal['rock'], Tag(WORD)],
        Discriminator(given_or_named)]


def _in_layers(value: object) -> str:
    is_layered = isinstance(value, LayersEntry) or (
        isinstance(value, dict) and bool({'layers', 'below'} & set(value)))
    return LAYERED if is_layered else EVEN


AnySoil: TypeAlias = Annotated[
    Annotated[SoilEntry, Tag(EVEN)] | Annotated[LayersEntry, Tag(LAYERED)],
    Discriminator(_in_layers)]


class SupportEntry(Entry):
    """Which model of the soil stands below the blocks."""

    model: Literal['rigid', 'cone', 'infinite_elements', 'boundary_elements', 'thin_layers',
                   'table', 'receptance']
    geometry: Literal['disc', 'plane_strain', 'plane_stress'] = 'disc'
    file: FileName | None = None
    cut_offs_hz: list[Hertz] | None = None


def _one_or_list(value: object) -> str:
    return TABLE if isinstance(value, (list, tuple)) else NUMBER


class PartEntry(Entry):
    """Rectangle of a plan, its centre across and along the shaft."""

    half_width: Metre
    half_length: Metre
    centre: tuple[Metre, Metre]


class FlexibleEntry(Entry):
    """Files of a foundation that bends: matrices and what they are of, or modes."""

    stiffness: FileName | None = None
    mass: FileName | None = None
    dofs: FileName | None = None
    modes: FileName | None = None
    residual: FileName | None = None
    rigid: FileName | None = None
    loss_factor: Ratio | None = None
    damping_ratios: Annotated[
        Annotated[Ratio, Tag(NUMBER)] | Annotated[list[Ratio], Tag(TABLE)],
        Discriminator(_one_or_list)] | None = None
    keep_up_to: Ratio = 3.0
    grounded: StrictBool = False
    rigid_contact: StrictBool = False


class OnEntry(Entry):
    """Foundation below another, and on which of its places it stands."""

    foundation: Name
    place: Name | None = None
    places: dict[Name, Name] | None = None


class FoundationEntry(Entry):
    """Block; its contact is a rectangle, a circle or a plan of several rectangles."""

    ways = ('half_width', 'half_length'), ('radius',), ('parts',)
    name: Name
    half_width: Metre | None = None
    half_length: Metre | None = None
    radius: Metre | None = None
    parts: list[PartEntry] | None = None
    centre_x: Metre = 0.0
    centre_y: Metre | None = None
    mass: Kilogram | None = None
    centre_of_gravity_height: Metre | None = None
    inertia: tuple[KilogramSquareMetre, KilogramSquareMetre, KilogramSquareMetre] | None = None
    height: Metre | None = None
    density: KilogramPerCubicMetre | None = None
    young_modulus: Pascal = CONCRETE
    embedment: Metre = 0.0
    side_contact: Ratio | None = None
    stiffness_file: FileName | None = None
    flexible: FlexibleEntry | None = None
    on: OnEntry | None = None
    soil_under: Literal['winkler', 'green', 'each'] | None = None


class DiscEntry(Entry):
    """Rigid disc, by its mass and inertias or by its dimensions."""

    ways = (('mass', 'diametral_inertia', 'polar_inertia'),
            ('outer_diameter', 'inner_diameter', 'width', 'density'))
    name: Name
    position: Metre
    mass: Kilogram | None = None
    diametral_inertia: KilogramSquareMetre | None = None
    polar_inertia: KilogramSquareMetre | None = None
    outer_diameter: Metre | None = None
    inner_diameter: Metre = 0.0
    width: Metre | None = None
    density: KilogramPerCubicMetre | None = None


class ProbeEntry(Entry):
    """Place on the shaft whose motion is wanted, in which direction and relative to what."""

    name: Name
    position: Metre
    angle_deg: ProbeAngle | None = None
    relative_to: Name | None = None


class RotorEntry(Loaded):
    """What turns."""

    shaft_height: Metre
    material: AnyMaterial | None = None
    shaft: list[Section]
    discs: list[DiscEntry] = Field(default_factory=list)
    bearings: list[BearingEntry]
    oil_temperatures: list[Celsius] = Field(default_factory=list)
    orientation: Literal['horizontal', 'vertical'] = 'horizontal'
    driver: Literal['left', 'right'] | None = None
    probes: list[ProbeEntry] = Field(default_factory=list)


class PlaceEntry(Entry):
    """Place on the ground: across the shaft from its plane, and along it."""

    x: Metre
    y: Metre


class GroundProbeEntry(Entry):
    """Place on the ground whose motion is wanted."""

    name: Name
    place: PlaceEntry


class UnbalanceEntry(Entry):
    """Unbalance on one disc: a moment, or what a balance grade permits, and a couple."""

    ways = ('moment',), ('grade', 'rated_speed_rpm')
    disc: Name
    moment: KilogramMetre | None = None
    grade: BalanceGrade | None = None
    rated_speed_rpm: Rpm | None = None
    share: Ratio = 1.0
    phase: Radian = 0.0
    couple: KilogramSquareMetre | None = None
    couple_phase: Radian = 0.0


class Uncertainty(Entry):
    """How far the machine and its soil may be from what the file says."""

    shear_modulus_factor: Ratio | None = None
    poisson_ratio: Ratio | None = None
    loss_factor: Ratio | None = None
    samples: Count | None = None
    soil_density_factor: Ratio | None = None
    bearing_stiffness_factor: Ratio | None = None
    bearing_damping_factor: Ratio | None = None
    pedestal_stiffness_factor: Ratio | None = None
    foundation_mass_factor: Ratio | None = None
    rotor_mass_factor: Ratio | None = None
    shaft_stiffness_factor: Ratio | None = None
    shaft_height_factor: Ratio | None = None
    foundation_stiffness_factor: Ratio | None = None
    unbalance_factor: Ratio | None = None
    layer_stiffness_factor: Ratio | None = None
    model_form: StrictBool | None = None
    rock_depth: tuple[Metre, MetreOrEndless] | None = None
    side_contact: tuple[Ratio, Ratio] | None = None
    ground_water: StrictBool | None = None


Label: TypeAlias = Annotated[
    str, StringConstraints(min_length=1, max_length=64), Usual('stand in')]
Velocities: TypeAlias = tuple[MetrePerSecond, MetrePerSecond, MetrePerSecond]
Displacements: TypeAlias = tuple[Metre, Metre, Metre]


class ZonesEntry(Entry):
    """Limits of housing velocity: those of a group of the standard, or one's own."""

    ways = ('group',), ('label', 'rigid', 'flexible')
    group: Literal[1, 2] | None = None
    label: Label | None = None
    rigid: Velocities | None = None
    flexible: Velocities | None = None
    rigid_displacement: Displacements | None = None
    flexible_displacement: Displacements | None = None
    baseline: MetrePerSecond | None = None


class PickupEntry(Entry):
    """What is known of an accelerometer; what is not said is not known."""

    range: MetrePerSecondSquared | None = None
    units: Literal['m/s^2', 'g'] | None = None
    orientation: Literal['use'] | None = None
    heading_deg: Degree | None = None
    stamps: Literal['packets'] | None = None
    anti_alias: StrictBool | None = None


class GroundSensorEntry(PickupEntry):
    """Accelerometer on the ground: where it stands, and what is known of it."""

    name: Name
    place: PlaceEntry


class GroundEntry(Entry):
    """What is asked of the ground beside the blocks, and what is measured there."""

    probes: list[GroundProbeEntry] = Field(default_factory=list)
    sensors: list[GroundSensorEntry] = Field(default_factory=list)
    of: Name | None = None


class SensorsEntry(PickupEntry):
    """What is known of all of them, and of some in other words."""

    channels: dict[Name, PickupEntry] = Field(default_factory=dict)


class Common(Entry):
    """What the files of one machine and of several both say."""

    name: Name
    soil: AnySoil | None = None
    support: SupportEntry
    foundations: list[FoundationEntry] = Field(default_factory=list)
    ground: GroundEntry = Field(default_factory=GroundEntry)
    uncertainty: Uncertainty | None = None
    zones: ZonesEntry | None = None
    sensors: SensorsEntry = Field(default_factory=SensorsEntry)
    run_up: Literal['transient', 'quasi_static'] = 'transient'
    anti_alias: bool = False


class Document(Common):
    """The whole file."""

    rotor: RotorEntry
    unbalances: list[UnbalanceEntry] = Field(default_factory=list)
    speed_range_rpm: tuple[Rpm, Rpm]
