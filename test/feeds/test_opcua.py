"""Clients of OPC UA read what the node said, with its unit and its stamp, and change nothing."""

import asyncio
from contextlib import asynccontextmanager
import socket

from asyncua import Client, ua
from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
from asyncua.server.internal_server import InternalServer
import numpy as np
import pytest

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.feeds.address_space import NAMESPACE, STATUS
from rotorsoil_ros.feeds.opcua import MOST_KEPT, OpcUaOutlet, OpcUaSettings
from rotorsoil_ros.feeds.points import Quality

from brokers import certified
from plants import Hands, Plant, RUNNING, Running, SECOND, START, totals, until

ANYWHERE = 'opc.tcp://127.0.0.1:0'
X = Channel('bearing_1', 'housing', 'x')
FAST_S = 0.02


def served(settings, plant, hands):
    """Start a server; return it and its address, or its failure."""
    running = Running(OpcUaOutlet(settings), plant.board, hands.clock)
    until(lambda: running.said or not running.is_alive, 'a server')
    return running, running.said[0].split()[3].rstrip(',') if running.said else ''


@pytest.fixture(scope='module')
def plant(machine):
    return Plant(machine)


@pytest.fixture(scope='module')
def hands():
    return Hands()


@pytest.fixture(scope='module')
def address(plant, hands):
    running, address = served(OpcUaSettings(ANYWHERE, period_s=FAST_S), plant, hands)
    yield address
    running.end()
    assert running.failure is None


@asynccontextmanager
async def client(address, **options):
    async with Client(address, timeout=600, **options) as found:
        yield found


async def node_of(reader, path):
    index = await reader.get_namespace_index(NAMESPACE)
    return reader.get_node(ua.NodeId(path, index))


async def read(reader, path):
    node = await node_of(reader, path)
    return await node.read_data_value(raise_on_bad_status=False)


async def wait_for(reader, path, holds):
    """Read a value until something holds of it."""
    async with asyncio.timeout(600):
        while True:
            if holds(found := await read(reader, path)):
                return found
            await asyncio.sleep(FAST_S)


def has(quality):
    return lambda found: found.StatusCode.value == STATUS[quality]


def test_a_value_is_found_by_its_path_with_unit_stamp_and_status(plant, address):
    async def look():
        async with client(address) as reader:
            plant.turns(1.0, RUNNING)
            found = await wait_for(reader, f'fan/{X}/Amplitude', has(Quality.GOOD))
            assert found.Value.Value == pytest.approx(abs(plant.expected(X, RUNNING)), rel=1e-14)
            assert found.SourceTimestamp.timestamp() == (START + SECOND) / SECOND
            index = await reader.get_namespace_index(NAMESPACE)
            browsed = await reader.nodes.objects.get_child(
                [f'{index}:{name}' for name in ('RotorSoil', 'fan', X, 'Amplitude')])
            assert browsed.nodeid == ua.NodeId(f'fan/{X}/Amplitude', index)
            assert await browsed.read_type_definition() == ua.NodeId(ua.ObjectIds.AnalogUnitType)
            unit = await (await browsed.get_child('0:EngineeringUnits')).read_value()
            # Of UN/ECE recommendation 20, in the number that OPC UA part 8 makes of it.
            assert (unit.UnitId, unit.DisplayName.Text) == (5067858, 'm')
            assert 'zero-to-peak' in unit.Description.Text
            phase = await node_of(reader, f'fan/{X}/Phase')
            limits = await (await phase.get_child('0:EURange')).read_value()
            assert (limits.Low, limits.High) == (-np.pi, np.pi)
    asyncio.run(look())


@pytest.mark.parametrize('quality, happens', [
    (Quality.OUT_OF_TABLE, lambda plant: (plant.turns(2.0, 1e4), plant.ticks(2.5))),
    (Quality.STALE, lambda plant: (plant.turns(3.0, RUNNING), *(
        plant.ticks(second) for second in range(3, 9)))),
    (Quality.GOOD, lambda plant: plant.turns(9.0, RUNNING))])
def test_how_far_a_value_can_be_trusted_is_its_status(plant, address, quality, happens):
    async def look():
        async with client(address) as reader:
            happens(plant)
            found = await wait_for(reader, f'fan/{X}/Amplitude', has(quality))
            assert (found.Value.Value is None) == found.StatusCode.is_bad()
            assert (await read(reader, f'fan/{X}/Residual')).StatusCode.value == (
                ua.StatusCodes.BadNotConnected)
    asyncio.run(look())


def test_a_node_that_falls_silent_is_told_and_comes_back(plant, hands, address):
    async def look():
        async with client(address) as reader:
            await wait_for(reader, 'fan/State', lambda found: found.Value.Value is not None)
            hands.now_s += 10.0
            gone = await wait_for(reader, f'fan/{X}/Phase', has(Quality.SILENT))
            assert gone.Value.Value is None
            plant.start()
            plant.turns(10.0, RUNNING)
            await wait_for(reader, f'fan/{X}/Phase', has(Quality.GOOD))
    asyncio.run(look())


def test_a_machine_that_comes_later_is_there_and_one_with_another_case_is_another(
        plant, machine, address):
    async def look():
        async with client(address) as reader:
            other = Plant(machine, name='pump', namespace='/hall_2', inbox=plant.inbox)
            other.turns(1.0, RUNNING)
            await wait_for(reader, f'hall_2.pump/{X}/Amplitude', has(Quality.GOOD))
            other.reshapes([Channel.parse('wheel_x')])
            await wait_for(reader, 'hall_2.pump/wheel_x/Amplitude', has(Quality.WAITING))
            for path in (f'hall_2.pump/{X}', f'hall_2.pump/{X}/Amplitude/EngineeringUnits'):
                with pytest.raises(ua.uaerrors.BadNodeIdUnknown):
                    await (await node_of(reader, path)).read_browse_name()
            pump = await node_of(reader, 'hall_2.pump')
            names = [(await node.read_browse_name()).Name for node in await pump.get_children()]
            assert names == ['Speed', 'State', 'Summary', 'VibrationState', 'VibrationSummary',
                             'Verdict', 'wheel_x']
            assert (await read(reader, f'fan/{X}/Amplitude')).StatusCode.is_good()
    asyncio.run(look())


@pytest.mark.parametrize('which_first', [1, -1])
def test_machine_of_a_plant_stands_below_it(plant, machine, address, which_first):
    async def look():
        async with client(address) as reader:
            for path, adds in [
                    (f'house/{X}/VelocityRms', lambda: totals(plant.inbox, 'house', 1.0,
                                                             {X: (3e-6, 2e-3)})),
                    (f'house/fan/{X}/Amplitude', lambda: Plant(
                        machine, name='house/fan', inbox=plant.inbox).turns(1.0, RUNNING)),
                    ][::which_first]:
                adds()
                await wait_for(reader, path, has(Quality.GOOD))
            index = await reader.get_namespace_index(NAMESPACE)
            browsed = await reader.nodes.objects.get_child(
                [f'{index}:{name}' for name in ('RotorSoil', 'house', 'fan', X, 'Amplitude')])
            assert browsed.nodeid == ua.NodeId(f'house/fan/{X}/Amplitude', index)
    asyncio.run(look())


def test_who_subscribes_is_told_what_changes(plant, address):
    class Told(list):
        def datachange_notification(self, node, value, data):
            self.append(value)

    async def look():
        async with client(address) as reader:
            told = Told()
            subscription = await reader.create_subscription(20, told)
            await subscription.subscribe_data_change(await node_of(reader, f'fan/{X}/Amplitude'))
            for speed in (RUNNING, RUNNING + 1.0):
                plant.turns(20.0 + speed, speed)
                wanted = pytest.approx(abs(plant.expected(X, speed)), rel=1e-14)
                async with asyncio.timeout(600):
                    while wanted not in told:
                        await asyncio.sleep(FAST_S)
    asyncio.run(look())


@pytest.fixture(scope='module')
def tiny(plant, machine, address):
    """Return a machine with one channel, so that each of its nodes can be tried."""
    tiny = Plant(machine, name='tiny', inbox=plant.inbox)
    tiny.reshapes([X])
    return 'tiny'


def test_nothing_can_be_written(tiny, address):
    async def look():
        async with client(address) as reader:
            await wait_for(reader, f'{tiny}/{X}/Phase', has(Quality.WAITING))
            root, count = await node_of(reader, tiny), 0
            waiting = [root]
            while waiting:
                node = waiting.pop()
                waiting += await node.get_children() + await node.get_properties()
                if await node.read_node_class() is ua.NodeClass.Variable:
                    for attribute in (ua.AttributeIds.AccessLevel,
                                      ua.AttributeIds.UserAccessLevel):
                        mask = (await node.read_attribute(attribute)).Value.Value
                        assert mask == ua.AccessLevel.CurrentRead.mask
                for attribute in (ua.AttributeIds.Value, ua.AttributeIds.DisplayName,
                                  ua.AttributeIds.AccessLevel):
                    with pytest.raises(ua.UaStatusCodeError):
                        await node.write_attribute(attribute, ua.DataValue(ua.Variant(1.0)))
                count += 1
            assert count > 30
    asyncio.run(look())


def test_no_service_changes_anything(tiny, address):
    async def look():
        async with client(address) as reader:
            await wait_for(reader, f'{tiny}/{X}/Phase', has(Quality.WAITING))
            root = await node_of(reader, tiny)
            index, session = root.nodeid.NamespaceIndex, reader.uaclient
            server = reader.get_node(ua.ObjectIds.Server)
            item = ua.DeleteNodesItem(root.nodeid, True)
            attempts = (
                root.add_folder(index, 'more'), root.add_variable(index, 'more', 1.0),
                root.add_reference(server, ua.ObjectIds.Organizes), root.delete(),
                session.delete_nodes(ua.DeleteNodesParameters([item])),
                server.call_method('0:GetMonitoredItems', ua.Variant(1, ua.VariantType.UInt32)),
                reader.get_node(ua.ObjectIds.Server_ServiceLevel).write_value(
                    ua.Variant(1, ua.VariantType.Byte)),
                reader.get_node(ua.ObjectIds.Server_NamespaceArray).write_value(['mine']),
                root.set_writable(),
                reader.register_namespace('mine'))
            for attempt in attempts:
                with pytest.raises(ua.UaError):
                    await attempt
            assert 'mine' not in await reader.get_namespace_array()
            assert (await root.read_browse_name()).Name == tiny
    asyncio.run(look())


@pytest.fixture(scope='module')
def certificates(tmp_path_factory):
    folder = tmp_path_factory.mktemp('certificates')
    known = certified(folder, 'known', 'urn:control:room')
    (folder / 'trusted').mkdir()
    (folder / 'trusted' / 'known.pem').write_bytes(known[0].read_bytes())
    return {'server': certified(folder, 'server', 'urn:plant:rotorsoil'), 'known': known,
            'stranger': certified(folder, 'stranger', 'urn:some:body'), 'folder': folder}


@pytest.fixture(scope='module')
def guarded(certificates, plant, machine):
    folder = certificates['folder']
    users = folder / 'users'
    users.write_text('operator:secret:with:colons\n\nviewer:öffnen\n')
    users.chmod(0o600)
    certificate, key = certificates['server']
    running, address = served(
        OpcUaSettings(ANYWHERE, certificate=certificate, key=key, users=users,
                      trusted=folder / 'trusted', period_s=FAST_S), Plant(machine), Hands())
    assert running.failure is None
    assert running.said == [f'OPC UA at {address}, encrypted, for 2 users']
    yield address
    running.end()


async def reads(address, certificates, who, *, user='', password=''):
    reader = Client(address, timeout=600)
    if who:
        certificate, key = certificates[who]
        reader.application_uri = {
            'known': 'urn:control:room', 'stranger': 'urn:some:body'}[who]
        await reader.set_security(SecurityPolicyBasic256Sha256, certificate, key)
    if user:
        reader.set_user(user)
        reader.set_password(password)
    async with reader:
        found = await read(reader, 'fan/State')
        return found.StatusCode.value


@pytest.mark.parametrize('user, password', [
    ('operator', 'secret:with:colons'), ('viewer', 'öffnen')])
def test_who_is_known_reads_encrypted(guarded, certificates, user, password):
    status = asyncio.run(reads(guarded, certificates, 'known', user=user, password=password))
    assert status == STATUS[Quality.WAITING]


@pytest.mark.parametrize('who, user, password', [
    ('known', 'operator', 'secret'), ('known', 'operator', ''), ('known', 'nobody', 'secret'),
    ('known', '', ''), ('stranger', 'operator', 'secret:with:colons'),
    ('', 'operator', 'secret:with:colons'), ('', '', '')])
def test_nobody_else_does(guarded, certificates, who, user, password):
    with pytest.raises((ua.UaError, ConnectionError, TimeoutError)):
        asyncio.run(reads(guarded, certificates, who, user=user, password=password))


@pytest.mark.parametrize('given, said', [
    ({'endpoint': 'http://127.0.0.1:4840'}, "--endpoint: must be opc.tcp://HOST:PORT, got 'http"),
    ({'endpoint': 'opc.tcp://127.0.0.1'}, '--endpoint: must be opc.tcp://HOST:PORT'),
    ({'endpoint': 'opc.tcp://127.0.0.1:99999'}, '--endpoint: must be opc.tcp://HOST:PORT'),
    ({'endpoint': 'opc.tcp://0.0.0.0:4840'}, 'is reached from the network, which needs'),
    ({'certificate': 'server.pem'}, '--certificate and --key: one needs the other'),
    ({'trusted': 'trusted'}, '--trusted: needs --certificate and --key')])
def test_what_cannot_be_meant_is_refused(given, said):
    with pytest.raises(InputError, match=said):
        OpcUaSettings(**{'endpoint': ANYWHERE} | given)


@pytest.mark.parametrize('text, mode, said', [
    ('a:b', 0o644, 'must be readable by its owner only'), ('', 0o600, 'names no user'),
    ('a:b\nnobody\n', 0o600, 'line 2: must be name:password'),
    (':b', 0o600, 'line 1: must be name:password')])
def test_users_that_cannot_be_used_are_refused(tmp_path, text, mode, said):
    users = tmp_path / 'users'
    users.write_text(text)
    users.chmod(mode)
    with pytest.raises(InputError, match=said):
        OpcUaOutlet(OpcUaSettings(ANYWHERE, users=users))


def test_a_port_that_is_in_use_is_told_in_one_line(machine):
    with socket.create_server(('127.0.0.1', 0)) as taken:
        endpoint = f'opc.tcp://127.0.0.1:{taken.getsockname()[1]}'
        running, _ = served(OpcUaSettings(endpoint), Plant(machine), Hands())
        running.end()
    assert isinstance(running.failure, InputError)
    assert str(running.failure).startswith(f'--endpoint: {endpoint}: ')
    assert '\n' not in str(running.failure)


@pytest.mark.parametrize('given, said', [
    ({'certificate': 'nowhere.pem'}, 'nowhere.pem: No such file or directory'),
    ({'certificate': 'other.pem'}, 'other.pem: must be a certificate in PEM or DER'),
    ({'key': 'other.pem'}, 'other.pem: must be a private key without password in PEM or DER'),
    ({'key': 'stranger_key.pem'}, 'stranger_key.pem: must be the key of '),
    ({'trusted': 'nowhere'}, 'nowhere: must be a directory'),
    ({'trusted': '.'}, 'known_key.pem: must be a certificate in PEM or DER')])
def test_files_that_are_no_certificate_are_told_in_one_line(certificates, given, said):
    folder = certificates['folder']
    (folder / 'other.pem').write_text('no certificate\n')
    whole = {'certificate': 'server.pem', 'key': 'server_key.pem'} | given
    with pytest.raises(InputError, match=said) as told:
        OpcUaOutlet(OpcUaSettings(
            ANYWHERE, **{name: folder / value for name, value in whole.items()}))
    assert '\n' not in str(told.value)


def test_the_library_has_every_limit_that_is_set():
    server = InternalServer()
    assert all(getattr(server, limit) > most for limit, most in MOST_KEPT.items())
