"""Which machine a case file describes."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rotorsoil_ros.arrays import ComplexArray
from rotorsoil_ros.case import cache, document, schema
from rotorsoil_ros.case.block_entries import BlockEntries
from rotorsoil_ros.case.case_errors import Faults, validated
from rotorsoil_ros.case.entries.entry import Place
from rotorsoil_ros.case.entries.ground import (
    GroundEntries,
    infinite_range,
    proportions,
    THIN_LAYERS,
)
from rotorsoil_ros.case.entries.mending import all_faults
from rotorsoil_ros.case.entries.sensors import Sensors, sensors_of
from rotorsoil_ros.case.entries.site import GroundProbe, SiteEntries
from rotorsoil_ros.case.entries.support_file import SupportFiles, Tables
from rotorsoil_ros.case.journal_entries import floated, Journal, JournalEntries
from rotorsoil_ros.case.plant.berth import Berth
from rotorsoil_ros.case.plant.entries import PlantDocument
from rotorsoil_ros.case.plant.machines import PlantEntries, with_rotors
from rotorsoil_ros.case.rotor_entries import RotorEntries, Unbalances
from rotorsoil_ros.case.zone_limits import ISO_10816_3, USUAL_GROUP, ZoneLimits, zones_of
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.elements.table import require_kind
from rotorsoil_ros.ground.layers.profile import Embedment, LayeredSoil
from rotorsoil_ros.ground.soil import RigidSoil, Soil
from rotorsoil_ros.machine.coupled import CoupledModel
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.response import bytes_needed
from rotorsoil_ros.machine.spread import SoilSpread
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.units import rpm_to_rad_s


@dataclass(frozen=True)
class Case:
    """
    One machine on its soil, as its file describes it.

    Attributes
    ----------
    name : str
        Becomes the topic namespace.
    path : Path
        The file it came from.
    soil : Soil or None
        Half-space, or of several layers that below the deepest base; None is allowed on a rigid
        support or a table only.
    support : schema.SupportEntry
        Which model of the soil, and its geometry.
    foundations : tuple of Foundation
        The blocks.
    rotor : Rotor
        What turns.
    unbalance : (p,) complex array
        moment * exp(i phase) of every disc of the rotor, in their order [kg m], then of their
        couples [kg m^2].
    couples : tuple of str
        Discs whose unbalance is also a couple.
    speed_range : tuple of two floats
        Lowest and highest rotor speed [rad/s].
    ground : LayeredSoil or None
        Where the support knows layers and embedment, or the file tells them.
    embedments : tuple of Embedment
        How deep each block stands in the ground, and how much of its wall is welded.
    ground_probes : tuple of GroundProbe
        Places on the ground whose motion is wanted.
    tables : tuple of ComplianceTable or of one SeatReceptance
        What each block, or all bearings, stand on where a file says it; else empty.
    uncertainty : SoilSpread
        How far the soil may be from what the file says.
    zones : ZoneLimits
        Of housing velocity.
    sensors : Sensors
        What is known of the accelerometers.
    journals : tuple of Journal
        Those of its bearings that are given by their geometry.
    oil_temperatures : tuple of float
        Mean temperatures of the films for which there are tables besides [deg C].
    berth : Berth or None
        Where it stands among the machines of a plant; None alone.
    run_up : str
        Whether answers follow changes of the speed, `transient`, or not, `quasi_static`.
    cache_directory : str, Path or None
        Where the tables of their films lie; None is the usual one.
    content : mapping
        The document that it was built from, settings on top included.
    files : mapping of str to str
        What the files say that the document names.

    """

    name: str
    path: Path
    soil: Soil | None
    support: schema.SupportEntry
    foundations: tuple[Foundation, ...]
    rotor: Rotor
    unbalance: ComplexArray
    couples: tuple[str, ...]
    speed_range: tuple[float, float]
    ground: LayeredSoil | None = None
    embedments: tuple[Embedment, ...] = ()
    ground_probes: tuple[GroundProbe, ...] = ()
    tables: Tables = ()
    uncertainty: SoilSpread = field(default_factory=SoilSpread)
    zones: ZoneLimits = ISO_10816_3[USUAL_GROUP]
    sensors: Sensors = field(default_factory=Sensors)
    journals: tuple[Journal, ...] = field(default=(), compare=False)
    oil_temperatures: tuple[float, ...] = ()
    berth: Berth | None = None
    run_up: str = 'transient'
    cache_directory: str | Path | None = field(default=None, compare=False, repr=False)
    content: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)
    files: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)

    @property
    def file(self) -> Path:
        """Path by which `load` reads this machine again."""
        return self.path if self.berth is None else Path(f'{self.path}#{self.name}')

    def with_oil_of(self, celsius: float) -> 'Case':
        """Return this case with films of another mean temperature [deg C], and no other."""
        entries = [entry.get('journal') or {} for entry in self.content['rotor']['bearings']]
        return self.changed(['rotor.oil_temperatures=[]', *(
            f'rotor.bearings.{index}.journal.oil.temperature={celsius!r}'
            for index, entry in enumerate(entries) if entry.get('oil'))])

    def changed(self, overrides: Sequence[str]) -> 'Case':
        """Return this case with settings on top, as `load` takes them."""
        content = deepcopy(dict(self.content))
        document.override(content, overrides)
        return case_of(self.path, content, files=self.files,
                       cache_directory=self.cache_directory)


# What the response table of a machine may take.
_GIB, _LARGEST_TABLE = 1 << 30, 2 << 30

# Surface speed at which rho v^2 of steel is a twelfth of its modulus [m/s].
_BURSTING = 1500.0

# A wider shaft was given in mm [m].
_WIDEST = 3.0

# Keys that say what films carry, and how fast it turns.
_CARRIED = ('rotor', 'speed_range_rpm')

def load(
    path: Path, overrides: Sequence[str] = (), *, cache_directory: str | Path | None = None,
) -> Case:
    """
    Read and check a case file.

    Parameters
    ----------
    path : Path
        The YAML file; `FILE#NAME` is one of its machines.
    overrides : sequence of str
        Settings `key.path=value` that replace or add to what the file says, in order.
    cache_directory : str, Path or None
        Where the tables of oil films lie; None is the usual one.

    Returns
    -------
    Case
        The machine, fit for `models.coupled_model`.

    Raises
    ------
    InputError
        One line: file, key path, what is wrong, in which unit, and the value.

    """
    path, own = document.chosen(path)
    content = document.read(path)
    if own and 'machines' not in content:
        raise InputError(f'{path}: machines: is missing, and {own[0]} names one of them')
    document.override(content, [*own, *overrides])
    return case_of(path, content, cache_directory=cache_directory)


def case_of(
    path: Path, content: dict[str, Any], *, files: Mapping[str, str] | None = None,
    cache_directory: str | Path | None = None,
) -> Case:
    """
    Return the machine of a document, as `load`.

    Parameters
    ----------
    path : Path
        What errors name; files that the document names lie beside it.
    content : dict
        The document.
    files : mapping of str to str
        What such files say, where that came with the document.
    cache_directory : str, Path or None
        As `load`.

    """
    texts = dict(files or {})
    schema_of = PlantDocument if 'machines' in content else schema.Document
    whole, rotor_files, _ = with_rotors(path, content, texts)

    def read(
        whole: dict[str, Any], mended: frozenset[Place] = frozenset(),
    ) -> tuple[Case | None, list[InputError]]:
        # Where what names a file is mended it is read only now.
        whole, more, missing = with_rotors(path, whole, texts)
        files = rotor_files | more
        entries, found = validated(schema_of, path, whole, files)
        if missing:
            return None, [*found, *missing]

        def build(told: Faults) -> Case | None:
            return _Builder(told, content, texts, cache_directory, mended).case()

        if isinstance(entries, PlantDocument):
            return PlantEntries(path, entries, files).case(build)
        if not isinstance(entries, schema.Document):
            return None, found
        told = Faults(path, entries)
        return build(told), told.found

    case, found = read(whole)
    if case is None or found:
        raise InputError('\n'.join(map(str, all_faults(
            schema_of, whole, found, lambda *mended: read(*mended)[1]))))
    return case


@dataclass(frozen=True)
class _Builder:
    """
    Builds the physics of a document and says at which key it was refused.

    Films that carry what nobody has said take a second each and tell nothing: they are solved
    only where the rotor is that of the file.
    """

    faults: Faults
    content: Mapping[str, Any]
    files: dict[str, str]
    cache_directory: str | Path | None
    mended: frozenset[Place]

    def case(self) -> Case | None:
        """Return the machine, or None where something is wrong with it; that is in the faults."""
        faults, entries, on = self.faults, self.faults.entries, GroundEntries(self.faults)
        ground = faults.attempt(on.ground)
        names_differ = faults.names_differ()
        files = SupportFiles(faults, self.files)
        faults.attempt(files.refuse_unused)
        for refuse in (on.refuse_unfit_support, on.refuse_unfit_bed, on.refuse_unfit_spread):
            faults.attempt(refuse)
        speed_range = faults.attempt(self._speed_range)
        # A mesh that nobody could solve is not even built.
        of_rotor = RotorEntries(faults)
        rotor = of_rotor.rotor() if faults.attempt(of_rotor.mesh) else None
        if rotor is not None:
            faults.attempt(lambda: self._refuse_bursting_speed(rotor))
        blocks = BlockEntries(faults, self.files, speed_range, self.cache_directory, self.mended)
        foundations, embedments = blocks.foundations(), on.embedments(ground)
        probes = faults.attempt(SiteEntries(faults).probes)
        unbalances = Unbalances(faults, None if rotor is None else rotor.mass)
        unbalance = unbalances.total()
        tables = None if speed_range is None else files.tables(speed_range)
        journals = (None if rotor is None or speed_range is None
                    else self._journals().journals(rotor, speed_range))
        oils = faults.attempt(self._journals().oil_temperatures)
        uncertainty = faults.attempt(lambda: on.uncertainty(ground))
        zones = faults.attempt(lambda: zones_of(faults))
        model, sensors = None, None
        if names_differ and rotor is not None and foundations is not None:
            model = self._model(rotor, foundations, unbalances.couples())
        if model is not None and probes is not None:
            sensors = sensors_of(faults, [*model.channels, *(
                Channel(probe.name, '', axis) for probe in probes for axis in DOFS[:3])],
                model.foundations)
        if (rotor is None or foundations is None or embedments is None or probes is None
                or unbalance is None or speed_range is None or tables is None or oils is None
                or journals is None or uncertainty is None or zones is None or sensors is None):
            return None
        layered = ground if isinstance(ground, LayeredSoil) else None
        soil = ground.at(max((one.depth for one in embedments), default=0.0)) if (
            isinstance(ground, LayeredSoil)) else ground
        case = Case(
            name=entries.name, path=faults.path, soil=soil, ground=layered,
            embedments=embedments, support=entries.support, foundations=foundations,
            rotor=floated(rotor, journals), unbalance=unbalance, couples=unbalances.couples(),
            speed_range=speed_range, ground_probes=probes, tables=tables,
            uncertainty=uncertainty, zones=zones, sensors=sensors, journals=journals,
            oil_temperatures=oils, run_up=entries.run_up, cache_directory=self.cache_directory,
            content=self.content, files=self.files)
        if not faults.found:
            self._refuse_unreachable_soil(case)
        return case

    def _model(
        self, rotor: Rotor, foundations: tuple[Foundation, ...], couples: tuple[str, ...],
    ) -> CoupledModel | None:
        """Return the machine without its ground, which has its channels."""
        def model() -> CoupledModel:
            with self.faults.at('rotor', entry=self.faults.entries.rotor):
                found = CoupledModel(rotor, foundations, [RigidSoil() for _ in foundations],
                                     couples)
                self._refuse_size(found)
                return found

        return self.faults.attempt(model)

    def _journals(self) -> JournalEntries:
        return JournalEntries(self.faults, cache.directory(self.cache_directory),
                              not any({*_CARRIED} & {*place} for place in self.mended))

    def _refuse_bursting_speed(self, rotor: Rotor) -> None:
        """Raise an InputError at a speed that no shaft of this diameter survives."""
        widest = max(max(section.outer_diameter) for section in rotor.shaft)
        highest = self.faults.entries.speed_range_rpm[1]
        surface = 0.5 * widest * rpm_to_rad_s(highest)
        if surface > _BURSTING:
            raise self.faults.error('speed_range_rpm', 1, problem=(
                f'must turn the shaft, {widest:.4g} m wide, slower than {_BURSTING:g} m/s at its '
                f'surface, which no material survives, got {highest:g} rpm, {surface:.4g} m/s'
                + (f'; did you mean a diameter of {1e-3 * widest:.4g} m?'
                   if widest > _WIDEST else '')))

    def _refuse_size(self, model: CoupledModel) -> None:
        """Raise an InputError before a table is computed that would fill the memory."""
        needed = bytes_needed(model)
        if needed > _LARGEST_TABLE:
            raise self.faults.error('rotor', 'discs', problem=(
                f'must be fewer: {len(model.planes)} unbalance planes and {len(model.channels)} '
                f'motions need a table of {needed / _GIB:.3g} GiB, more than '
                f'{_LARGEST_TABLE / _GIB:g} GiB, got {len(model.rotor.discs)} discs'))

    def _refuse_unreachable_soil(self, case: Case) -> None:
        """Keep a fault for every block below which the method would not reach far enough."""
        model, soil, ground = case.support.model, case.soil, case.ground

        def kind() -> None:
            with self.faults.at('soil', entry=self.faults.entries.soil):
                if model == 'infinite_elements' and soil is not None:
                    require_kind(case.support.geometry, soil.poisson_ratio, soil.loss_factor)

        def reach(index: int, block: Foundation) -> None:
            with self.faults.at('foundations', index):
                if block.on is not None:
                    return
                if model == THIN_LAYERS and ground is not None:
                    proportions(ground, block.contact, case.embedments[index], case.speed_range)
                elif model == 'infinite_elements' and soil is not None:
                    infinite_range(soil, block.contact, case.support.geometry, case.speed_range)

        self.faults.attempt(kind)
        self.faults.attempt_each(reach, case.foundations)
        self.faults.attempt(lambda: SiteEntries(self.faults).refuse_unreachable(case))

    def _speed_range(self) -> tuple[float, float]:
        low, high = self.faults.entries.speed_range_rpm
        if not 0.0 <= low < high:
            raise self.faults.error('speed_range_rpm', problem='must be two rising speeds >= 0 '
                                                               f'rpm, got [{low:g}, {high:g}]')
        return rpm_to_rad_s(low), rpm_to_rad_s(high)
