"""Machines, channels and values as they stand in the address space of OPC UA."""

import asyncio
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING

from asyncua import ua

from rotorsoil_ros.feeds.board import MachineBoard
from rotorsoil_ros.feeds.points import Point, Quality, quantities_of, Unit

if TYPE_CHECKING:
    from asyncua import Server

NAMESPACE = 'urn:rotorsoil_ros:values'
ROOT = 'RotorSoil'
UNIT_NAMES = 'http://www.opcfoundation.org/UA/units/un/cefact'
TICKS_TO_1970 = 116_444_736_000_000_000  # of 100 ns, from 1601 on
NANOSECONDS_IN_TICK = 100
PROPERTIES = ('EngineeringUnits', 'EURange')
NODES_AT_ONCE = 500  # between which clients are answered

# What a client is told of a value, by how far it can be trusted.
STATUS: Mapping[Quality, int] = {
    Quality.GOOD: ua.StatusCodes.Good, Quality.STALE: ua.StatusCodes.UncertainLastUsableValue,
    Quality.OUT_OF_TABLE: ua.StatusCodes.BadOutOfRange,
    Quality.UNSTABLE: ua.StatusCodes.BadConfigurationError,
    Quality.STANDING: ua.StatusCodes.BadNoData, Quality.UNANSWERED: ua.StatusCodes.BadNoData,
    Quality.REJECTED: ua.StatusCodes.BadSensorFailure,
    Quality.NOT_MEASURED: ua.StatusCodes.BadNotConnected,
    Quality.WAITING: ua.StatusCodes.BadWaitingForInitialData,
    Quality.SILENT: ua.StatusCodes.BadNoCommunication}

_ORGANIZES, _COMPONENT, _PROPERTY = (ua.NodeId(reference) for reference in (
    ua.ObjectIds.Organizes, ua.ObjectIds.HasComponent, ua.ObjectIds.HasProperty))
_FOLDER, _OBJECT, _WORD, _PROPERTY_TYPE = (ua.NodeId(kind) for kind in (
    ua.ObjectIds.FolderType, ua.ObjectIds.BaseObjectType, ua.ObjectIds.BaseDataVariableType,
    ua.ObjectIds.PropertyType))
# A number with a unit; with a range as well, where one is known.
_NUMBER, _RANGED = (ua.NodeId(kind) for kind in (
    ua.ObjectIds.AnalogUnitType, ua.ObjectIds.AnalogUnitRangeType))


class AddressSpace:
    """
    Objects of a server: `RotorSoil`, plants and machines below it, channels below these.

    Nodes are called by their path, `fan/drive_end_housing_x/Amplitude`, and keep that name as
    long as case and machine keep theirs. A machine of a plant stands below it: `house/fan/...`.
    """

    def __init__(self, server: 'Server', index: int) -> None:
        self._server, self._index = server, index
        self._known: dict[str, dict[tuple[str, str], ua.NodeId]] = {}
        self._places: set[str] = set()

    async def open(self) -> None:
        """Make the place where machines will stand."""
        await self._add([self._object(ua.NodeId(ua.ObjectIds.ObjectsFolder), ROOT, ROOT, ROOT,
                                      kind=_FOLDER, by=_ORGANIZES)])

    async def take_shape(self, machine: MachineBoard) -> Iterator[Point]:
        """Make the nodes of what is new of a machine, delete those of what is gone."""
        known = self._known.get(machine.name)
        if known is None:
            known = self._known[machine.name] = {}
            plant, _, _ = machine.name.rpartition('/')
            for path, below in ((plant, ROOT), (machine.name, plant or ROOT)):
                if path and path not in self._places:
                    self._places.add(path)
                    await self._add([self._object(
                        self._id(below), path, path.rpartition('/')[2], path, kind=_OBJECT,
                        by=_ORGANIZES)])
        gone = [key for key in known if key not in machine.points]
        fresh = [point for key, point in machine.points.items() if key not in known]
        for channel in dict.fromkeys(channel for channel, _ in gone):
            await self._delete(f'{machine.name}/{channel}',
                               [known.pop(key) for key in gone if key[0] == channel])
        items: list[ua.AddNodesItem] = []
        for channel in dict.fromkeys(point.channel for point in fresh):
            if channel:
                items.append(self._object(self._id(machine.name), f'{machine.name}/{channel}',
                                          channel, channel, kind=_OBJECT, by=_COMPONENT))
        for point in fresh:
            known[point.key] = self._id(path_of(point))
            items += self._variable(point)
        await self._add(items)
        return iter(fresh)

    async def write(self, points: Iterable[Point]) -> None:
        """Tell values, each with its own stamp and how far it can be trusted."""
        for point in points:
            node = self._known.get(point.machine, {}).get(point.key)
            if node is not None:
                await self._server.write_attribute_value(node, _data(point))

    async def _add(self, items: list[ua.AddNodesItem]) -> None:
        for start in range(0, len(items), NODES_AT_ONCE):
            for result in await self._server.iserver.isession.add_nodes(
                    items[start:start + NODES_AT_ONCE]):
                result.StatusCode.check()
            await asyncio.sleep(0)

    async def _delete(self, channel: str, values: list[ua.NodeId]) -> None:
        """Delete a channel with its values and what belongs to these."""
        parts = [*values, *(self._id(f'{node.Identifier}/{name}') for node in values
                            for name in PROPERTIES)]
        # Who refers to a node is searched for in all others: only once, for the channel.
        items = [ua.DeleteNodesItem(node, False) for node in parts]
        items.append(ua.DeleteNodesItem(self._id(channel), True))
        await self._server.iserver.isession.delete_nodes(ua.DeleteNodesParameters(items))
        await asyncio.sleep(0)

    def _id(self, path: str) -> ua.NodeId:
        return ua.NodeId(path, self._index)

    def _item(
        self, parent: ua.NodeId, path: str, name: ua.QualifiedName, kind: ua.NodeId,
        by: ua.NodeId,
    ) -> ua.AddNodesItem:
        return ua.AddNodesItem(
            ParentNodeId=parent, ReferenceTypeId=by, RequestedNewNodeId=self._id(path),
            BrowseName=name, TypeDefinition=kind)

    def _object(
        self, parent: ua.NodeId, path: str, name: str, says: str, *, kind: ua.NodeId,
        by: ua.NodeId,
    ) -> ua.AddNodesItem:
        item = self._item(parent, path, ua.QualifiedName(name, self._index), kind, by)
        item.NodeClass = ua.NodeClass.Object
        item.NodeAttributes = ua.ObjectAttributes(
            DisplayName=ua.LocalizedText(name), Description=ua.LocalizedText(says))
        return item

    def _variable(self, point: Point) -> Iterator[ua.AddNodesItem]:
        """Yield a variable and the properties that tell its unit and its range."""
        path, unit = path_of(point), point.unit
        says = quantities_of(point.channel)[point.quantity].says
        item = self._item(
            self._id(path.rpartition('/')[0]), path, ua.QualifiedName(point.quantity, self._index),
            _WORD if unit is None else _NUMBER if unit.range is None else _RANGED, _COMPONENT)
        yield _read_only(
            item, point.quantity, f'{says} [{unit.symbol}]: {unit.says}' if unit else says,
            ua.Variant(None, ua.VariantType.Null),
            ua.ObjectIds.String if unit is None else ua.ObjectIds.Double)
        if unit is not None:
            yield self._property(path, PROPERTIES[0], ua.ObjectIds.EUInformation,
                                 _information(unit))
            if unit.range is not None:
                yield self._property(path, PROPERTIES[1], ua.ObjectIds.Range,
                                     ua.Range(*unit.range))

    def _property(self, path: str, name: str, kind: int, value: object) -> ua.AddNodesItem:
        item = self._item(self._id(path), f'{path}/{name}', ua.QualifiedName(name, 0),
                          _PROPERTY_TYPE, _PROPERTY)
        return _read_only(item, name, name,
                          ua.Variant(value, ua.VariantType.ExtensionObject), kind)


def path_of(point: Point) -> str:
    """Return the path of a value, by which its node is called."""
    return '/'.join(filter(None, (point.machine, point.channel, point.quantity)))


def _read_only(
    item: ua.AddNodesItem, name: str, says: str, value: ua.Variant, kind: int,
) -> ua.AddNodesItem:
    item.NodeClass = ua.NodeClass.Variable
    item.NodeAttributes = ua.VariableAttributes(
        DisplayName=ua.LocalizedText(name), Description=ua.LocalizedText(says), Value=value,
        DataType=ua.NodeId(kind), ValueRank=ua.ValueRank.Scalar,
        AccessLevel=ua.AccessLevel.CurrentRead.mask,
        UserAccessLevel=ua.AccessLevel.CurrentRead.mask)
    return item


def _information(unit: Unit) -> ua.EUInformation:
    """Return a unit as OPC UA knows it: the bytes of its common code are its number."""
    return ua.EUInformation(
        NamespaceUri=UNIT_NAMES, UnitId=int.from_bytes(unit.code.encode(), 'big'),
        DisplayName=ua.LocalizedText(unit.symbol), Description=ua.LocalizedText(unit.says))


def _data(point: Point) -> ua.DataValue:
    kind = ua.VariantType.String if point.unit is None else ua.VariantType.Double
    value = ua.Variant(None, ua.VariantType.Null) if point.value is None else ua.Variant(
        point.value, kind)
    stamp = ua.win_epoch_to_datetime(TICKS_TO_1970 + point.stamp_ns // NANOSECONDS_IN_TICK)
    return ua.DataValue(
        value, StatusCode=ua.StatusCode(STATUS[point.quality]),
        SourceTimestamp=stamp if point.stamp_ns else None)
