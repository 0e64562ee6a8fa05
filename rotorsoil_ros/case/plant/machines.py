"""Which machines a case file describes, each as one of its own among its neighbours."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations
import math
from pathlib import Path
from typing import Any, TYPE_CHECKING, TypeAlias

from rotorsoil_ros.case import document
from rotorsoil_ros.case.case_errors import CaseError, Faults
from rotorsoil_ros.case.entries.entry import Place
from rotorsoil_ros.case.entries.sensors import sensors_of
from rotorsoil_ros.case.plant.berth import Berth, beside, refuse_seats_elsewhere, renamed
from rotorsoil_ros.case.plant.entries import MachineEntry, PlantDocument, PlantRotor
from rotorsoil_ros.case.schema import Document, FoundationEntry, SensorsEntry
from rotorsoil_ros.channel import Channel, DOFS
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.ground.soil import RigidSoil
from rotorsoil_ros.machine.foundation import Foundation
from rotorsoil_ros.machine.placement import Placement
from rotorsoil_ros.machine.plant.neighbour import Neighbour
from rotorsoil_ros.rotor.assembly import Rotor
from rotorsoil_ros.units import RADIANS_PER_TURN, rpm_to_rad_s

if TYPE_CHECKING:
    from rotorsoil_ros.case.config import Case

# Left ends of two shafts nearer than this are one place [m].
_SAME_PLACE = 1e-3

Build: TypeAlias = "Callable[[Faults], 'Case | None']"


@dataclass(frozen=True)
class PlantEntries:
    """
    Several machines on the same blocks, as their file describes them.

    Attributes
    ----------
    path : Path
        The file.
    entries : PlantDocument
        What it says, with the rotors of other files in it.
    rotor_files : mapping of place to Path
        Where these come from, by the place of their machine.

    """

    path: Path
    entries: PlantDocument
    rotor_files: Mapping[Place, Path]

    @cached_property
    def rotors(self) -> tuple[PlantRotor, ...]:
        """What turns, of every machine."""
        return tuple(machine.rotor for machine in self.entries.machines
                     if isinstance(machine.rotor, PlantRotor))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all machines, in the order of the file."""
        return tuple(machine.name for machine in self.entries.machines)

    @property
    def sources(self) -> tuple[str, ...]:
        """Names of the machines that turn."""
        return tuple(machine.name for machine in self.entries.machines if not machine.idle)

    def case(self, build: Build) -> tuple['Case | None', list[InputError]]:
        """Return the machine that `source` names, or what is wrong with any of them."""
        wrong, cases = self._own_faults(), list['Case']()
        for index in range(len(self.names) if not wrong else 0):
            told = self._faults(index)
            case = build(told)
            wrong += told.found
            if case is not None:
                cases.append(case)
        source = self._source() if self.sources else None
        if isinstance(source, InputError):
            wrong.append(source)
        if wrong or not isinstance(source, int):
            # What all stand on is told once.
            return None, list({str(error): error for error in wrong}.values())
        told = Faults(self.path, self._document(source, sensors=self.entries.sensors))
        case = told.attempt(lambda: self._among(cases, source, told))
        return case, told.found

    def _source(self) -> int | InputError:
        source, sources = self.entries.source, self.sources
        if source is None and len(sources) == 1:
            [source] = sources
        if source is None:
            return self._error('source', problem=(
                'is missing: which machine shakes the others, one of '
                f'{", ".join(sources)} (--set source={sources[0]})'))
        if source not in sources:
            return self._error('source', problem=(
                f'must be a machine that turns, one of {", ".join(sources)}, got '
                f'{source}' + (', which is idle' if source in self.names else '')))
        return self.names.index(source)

    def _among(self, cases: list['Case'], index: int, faults: Faults) -> 'Case | None':
        """Return one of the cases with all others as its neighbours."""
        machines = self.entries.machines
        places = [_place(machine, case.rotor) for machine, case in zip(
            machines, cases, strict=True)]
        rotors = [renamed(case.rotor, name) for case, name in zip(cases, self.names, strict=True)]
        speeds = [rpm_to_rad_s(self._rated(number)) for number in range(len(machines))]
        neighbours = tuple(
            Neighbour(rotor, place, speed) for number, (rotor, place, speed) in enumerate(
                zip(rotors, places, speeds, strict=True)) if number != index)
        own, name, ratio = cases[index], self.names[index], machines[index].ratio
        fastest = [max(speed, case.speed_range[1] if speed else 0.0)
                   for speed, case in zip(speeds, cases, strict=True)]
        berth = Berth(
            self.entries.name, places[index], neighbours, self.names, index, speeds[index],
            tuple(fastest[:index] + fastest[index + 1:]),
            tuple(self._remarks(index, own.foundations, places[index])),
            None if ratio is None else (ratio.of, ratio.times))
        for number, (rotor, place) in enumerate(zip(rotors, places, strict=True)):
            faults.attempt(partial(refuse_seats_elsewhere, self._faults(number), rotor, place,
                                   own.foundations))
        if faults.found:
            return None
        couples = tuple(f'{name}_{disc}' for disc in own.couples)
        with faults.at('machines'):
            model = berth.model(rotors[index], own.foundations,
                                [RigidSoil() for _ in own.foundations], couples=couples)
        on_ground = [Channel(probe.name, '', axis)
                     for probe in own.ground_probes for axis in DOFS[:3]]
        sensors = sensors_of(faults, [*model.channels, *on_ground], own.foundations)
        return None if sensors is None else replace(
            own, name=name, rotor=rotors[index], couples=couples, berth=berth,
            journals=tuple(replace(journal, name=f'{name}_{journal.name}')
                           for journal in own.journals),
            sensors=sensors)

    def _remarks(
        self, index: int, foundations: Sequence[Foundation], place: Placement,
    ) -> Iterator[str]:
        """Yield what looks odd about a machine and the blocks below it."""
        machine = self.entries.machines[index]
        if machine.ratio is not None:
            yield (f'machines.{index}.ratio: {machine.name} turns with {machine.ratio.of}: what '
                   'their teeth or belts exert on each other is not modelled, only their blocks '
                   'join them')
        blocks = {block.name: block for block in foundations}
        for bearing in self._document(index).rotor.bearings:
            block = blocks.get(bearing.foundation or '', foundations[0] if foundations else None)
            if block is None or (bearing.foundation is None and len(foundations) > 1):
                continue
            outside = beside(block, place.point(bearing.position))
            if outside > 0.0:
                yield (f'machines.{index}.place: {bearing.name} of {machine.name} stands '
                       f'{outside:.4g} m beside {block.name}; a place is in m')

    def _document(self, index: int, *, sensors: SensorsEntry | None = None) -> Document:
        """Return what the file says of one machine and of all that it stands on."""
        entries, machine, rotor = self.entries, self.entries.machines[index], self.rotors[index]
        block, of_file = machine.foundation, ('machines', index) in self.rotor_files
        # The blocks of another file are not here; where there are none it means nothing.
        bearings = [bearing.model_copy(update={'foundation': (
            block or (bearing.foundation if entries.foundations else None) if of_file
            else bearing.foundation or block)}) for bearing in rotor.bearings]
        height = machine.place.z if machine.place.z is not None else rotor.shaft_height
        common = {key: getattr(entries, key) for key in type(entries).model_fields
                  if key in Document.model_fields}
        return Document.model_construct(**common | {
            'foundations': [_centred(entry) for entry in entries.foundations],
            'rotor': rotor.model_copy(update={'bearings': bearings, 'shaft_height': height}),
            'unbalances': machine.unbalances, 'speed_range_rpm': self._speed_range(index),
            'sensors': sensors or SensorsEntry()})

    def _faults(self, index: int) -> Faults:
        under = ('machines', index)
        return Faults(self.path, self._document(index), under=under,
                      rotor_file=self.rotor_files.get(under), seats=self._seats)

    @cached_property
    def _seats(self) -> tuple[str, ...]:
        """Which seats the bearings of all machines stand on, as `renamed` calls them."""
        return tuple(bearing.seat or f'{name}_{bearing.name}' for name, rotor in zip(
            self.names, self.rotors, strict=True) for bearing in rotor.bearings)

    def _rated(self, index: int) -> float:
        """Return the speed at which a machine runs while another is looked at [rpm]."""
        machine = self.entries.machines[index]
        if machine.ratio is not None:
            return machine.ratio.times * self._rated(self.names.index(machine.ratio.of))
        return machine.rated_rpm or 0.0

    def _speed_range(self, index: int) -> tuple[float, float]:
        machine = self.entries.machines[index]
        if machine.speed_range_rpm is not None:
            return machine.speed_range_rpm
        if machine.ratio is not None:
            low, high = self._speed_range(self.names.index(machine.ratio.of))
            return machine.ratio.times * low, machine.ratio.times * high
        assert self.entries.speed_range_rpm is not None
        return self.entries.speed_range_rpm

    def _error(self, *place: int | str, problem: str) -> CaseError:
        return CaseError(self.path, place, problem)

    def _own_faults(self) -> list[InputError]:
        """Return what is wrong with the machines among each other."""
        found: list[InputError] = []
        if not self.sources:
            found.append(self._error('machines', problem=(
                'must name at least one machine that turns, got '
                + (f'{", ".join(self.names)}, idle all of them' if self.names else 'none'))))
        without = [machine.name for machine in self.entries.machines
                   if machine.speed_range_rpm is None and machine.ratio is None]
        if without and self.entries.speed_range_rpm is None:
            found.append(self._error('speed_range_rpm', problem=(
                f'is missing, and {", ".join(without)} say none of their own')))
        blocks = [block.name for block in self.entries.foundations]
        for index, machine in enumerate(self.entries.machines):
            found += [self._error('machines', index, *filter(None, key.split('.')),
                                  problem=problem)
                      for key, problem in self._faults_of(index, machine, blocks)]
        for first, second in combinations(range(len(self.names)), 2):
            found += [self._error('machines', second, key, problem=problem)
                      for key, problem in self._twice(first, second)]
        for index in range(0 if found else len(self.names)):
            found += self._rated_beyond(index)
        return found

    def _faults_of(
        self, index: int, machine: MachineEntry, blocks: list[str],
    ) -> list[tuple[str, str]]:
        """Return at which key one machine is at fault, and why."""
        found = []
        if machine.foundation is not None and machine.foundation not in blocks:
            found.append(('foundation', f'must be one of {", ".join(blocks) or "none"}, got '
                                        f'{machine.foundation}'))
        if abs(machine.place.heading) > RADIANS_PER_TURN:
            found.append(('place.heading', 'must be within one turn, -6.28 to 6.28 rad, got '
                          f"{machine.place.heading:g}; degrees are written '90 deg'"))
        rotor = self.rotors[index]
        if machine.place.z is None and rotor.shaft_height is None:
            found.append(('place.z', 'is missing, and so is rotor.shaft_height'))
        elif (('machines', index) not in self.rotor_files
                and None not in (machine.place.z, rotor.shaft_height)
                and machine.place.z != rotor.shaft_height):
            found.append(('place.z', f'must be rotor.shaft_height, {rotor.shaft_height:g} m, or '
                                     f'one of both left out, got {machine.place.z:g} m'))
        if rotor.oil_temperatures:
            found.append(('rotor.oil_temperatures', 'is for a machine of its own: several are '
                                                    'answered at the oil of their case only'))
        return found + self._faults_of_speed(machine)

    def _faults_of_speed(self, machine: MachineEntry) -> list[tuple[str, str]]:
        told = [key for key, is_told in (
            ('rated_rpm', machine.rated_rpm is not None), ('ratio', machine.ratio is not None),
            ('idle', machine.idle)) if is_told]
        if not told:
            return [('rated_rpm', 'is missing, and so are ratio and idle')]
        if len(told) > 1:
            return [('', f'needs one of rated_rpm, ratio and idle, got {" and ".join(told)}')]
        if machine.rated_rpm is not None and not machine.rated_rpm > 0.0:
            return [('rated_rpm', 'must be > 0 rpm (idle: true for a machine that stands), got '
                                  f'{machine.rated_rpm:g}')]
        if machine.ratio is not None:
            return self._faults_of_ratio(machine)
        return []

    def _faults_of_ratio(self, machine: MachineEntry) -> list[tuple[str, str]]:
        assert machine.ratio is not None
        if not 0.0 < machine.ratio.times < math.inf:
            return [('ratio.times', 'must be > 0 (a shaft that turns the other way has heading '
                                    f'180 deg), got {machine.ratio.times:g}')]
        ratios = {one.name: one.ratio.of for one in self.entries.machines if one.ratio}
        passed = [machine.name]
        while passed[-1] in ratios:
            of = ratios[passed[-1]]
            if of not in self.names:
                # Told once, where it is said.
                return [] if len(passed) > 1 else [(
                    'ratio.of', f'must be one of {", ".join(self.names)}, got {of}')]
            if of in passed:
                # Told once, at the first of those that make it up.
                circle = passed[passed.index(of):]
                return [] if machine.name != min(circle, key=self.names.index) else [(
                    'ratio.of', f'goes round in a circle: {" of ".join([*circle, of])}')]
            passed.append(of)
        if passed[-1] not in self.sources:
            return [('ratio.of', f'must be a machine that turns, got {passed[-1]}, which is idle')]
        return []

    def _twice(self, first: int, second: int) -> list[tuple[str, str]]:
        """Return what two machines have in common and must not."""
        one, other = self.entries.machines[first], self.entries.machines[second]
        found = []
        if one.name == other.name:
            found.append(('name', f'must differ from that of machines.{first}, got {one.name} '
                                  'twice'))
        apart = math.dist((one.place.x, one.place.y, one.place.z or 0.0),
                          (other.place.x, other.place.y, other.place.z or 0.0))
        turned = math.remainder(one.place.heading - other.place.heading, RADIANS_PER_TURN)
        if apart < _SAME_PLACE and abs(turned) < _SAME_PLACE:
            found.append(('place', f'must differ from that of {one.name} (machines.{first}): two '
                                   'shafts cannot lie in one place'))
        return found

    def _rated_beyond(self, index: int) -> Iterator[InputError]:
        """Yield that a machine is not looked at where it runs while others are."""
        (low, high), rated = self._speed_range(index), self._rated(index)
        machine = self.entries.machines[index]
        if not machine.idle and 0.0 <= low < high and not low <= rated <= high:
            key = 'ratio' if machine.ratio else 'rated_rpm'
            yield self._error('machines', index, key, problem=(
                'must lie in the speed range of the machine, '
                f'{low:g} to {high:g} rpm, got {rated:g}'))


def with_rotors(
    path: Path, content: dict[str, Any], files: dict[str, str],
) -> tuple[dict[str, Any], dict[Place, Path], list[InputError]]:
    """
    Return a document with the rotors in it that it says are in other files.

    Parameters
    ----------
    path : Path
        What errors name; files that the document names lie beside it.
    content : dict
        The document; stays as it is.
    files : dict of str to str
        What such files say; those that are read are added.

    Returns
    -------
    content, rotor_files, faults : dict, dict of place to Path, list of InputError
        The document, where its rotors come from by the place of their machine, and which of
        them were not found.

    """
    machines = content.get('machines')
    if not isinstance(machines, list):
        return content, {}, []
    whole, wrong, found = list[Any](), list[InputError](), dict[Place, Path]()
    for index, machine in enumerate(machines):
        rotor = machine.get('rotor') if isinstance(machine, dict) else None
        if isinstance(rotor, dict) and rotor.keys() == {'file'} and isinstance(rotor['file'], str):
            try:
                machine = machine | {'rotor': _rotor(path, index, rotor['file'], files)}
                found['machines', index] = path.parent / rotor['file']
            except InputError as error:
                wrong.append(error)
        whole.append(machine)
    return content | {'machines': whole}, found, wrong


def _rotor(path: Path, index: int, name: str, files: dict[str, str]) -> dict[str, Any]:
    """Return the rotor that another case file describes."""
    file = path.parent / name
    if name not in files:
        document.read(file)  # says what is wrong with it as a file
        files[name] = file.read_text(encoding='utf-8')
    content = document.parse(files[name], source=str(file))
    rotor = content.get('rotor') if isinstance(content, dict) else None
    if not isinstance(rotor, dict) or 'file' in rotor:
        raise CaseError(path, ('machines', index, 'rotor', 'file'), (
            f'must be the case file of a machine with its rotor, got {name}'))
    return rotor


def written_out(
    machine: Mapping[str, Any], files: Mapping[str, str], *, on_blocks: bool,
) -> Mapping[str, Any]:
    """Return the rotor of a machine as its document says it, or as the file says that it names."""
    rotor: Mapping[str, Any] = machine['rotor']
    if rotor.get('file') not in files:
        return rotor
    own: dict[str, Any] = document.parse(files[rotor['file']], source=rotor['file'])['rotor']
    if machine.get('foundation') is not None or not on_blocks:
        for bearing in own['bearings']:
            bearing.pop('foundation', None)
    return {key: value for key, value in own.items()
            if key != 'shaft_height' or machine['place'].get('z') is None}


def _place(machine: MachineEntry, rotor: Rotor) -> Placement:
    return Placement(machine.place.x, machine.place.y, machine.place.heading, rotor.is_upright)


def _centred(entry: FoundationEntry) -> FoundationEntry:
    """Return a block that is where the axes begin, unless it says where it is."""
    placed = entry.centre_y is not None or (
        entry.on is not None and bool(entry.on.place or entry.on.places))
    return entry if placed else entry.model_copy(update={'centre_y': 0.0})
