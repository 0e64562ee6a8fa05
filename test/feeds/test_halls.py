"""Several halls are heard through one router: the same bytes, each under its own name."""

from contextlib import ExitStack
import json
from types import SimpleNamespace

import pytest
import zenoh

from rotorsoil_ros.channel import Channel
from rotorsoil_ros.errors import InputError
from rotorsoil_ros.feeds.board import Board
from rotorsoil_ros.feeds.halls import (
    attachment_of,
    hearing,
    joined,
    key_of,
    MODELS_EVERY,
    topic_of,
    ZenohSender,
)
from rotorsoil_ros.feeds.hearsay import Inbox
from rotorsoil_ros.feeds.points import Quality
from rotorsoil_ros.wire.definitions import DIAGNOSTICS, JOINT_STATE, STRING, type_hash
from rotorsoil_ros.wire.messages import DIAGNOSTICS_TOPIC

from plants import free_port, Plant, RUNNING, SECOND, until

X = Channel('bearing_1', 'housing', 'x')


@pytest.fixture
def router():
    """Yield the address of a router, which is no part of ours."""
    address = f'tcp/127.0.0.1:{free_port()}'
    config = zenoh.Config()
    for key, value in (('mode', 'router'), ('listen/endpoints', [address]),
                       ('scouting/multicast/enabled', False)):
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config):
        yield address


def test_two_halls_are_heard_through_a_router_also_by_who_comes_later(router, machine):
    with ExitStack() as stack:
        halls = {}
        for name in ('/hall_1', '/hall_2'):
            sender = ZenohSender(stack.enter_context(joined(connect=[router], wait=pytest.fail)))
            halls[name] = Plant(machine, namespace=name, inbox=sender), sender
        inbox = Inbox()
        session = stack.enter_context(joined(connect=[router], wait=pytest.fail))
        stack.enter_context(hearing(session, inbox))
        board = Board(inbox, plant=False)

        def told(quality):
            for number, (hall, sender) in enumerate(halls.values()):
                hall.turns(1.0, RUNNING + number)
                hall.ticks(1.5)
                for _ in range(MODELS_EVERY):
                    sender.repeat()
            board.refresh(SECOND)
            found = [seen.points.get((X, 'Amplitude')) for seen in board.machines.values()]
            return len(found) == 2 and all(point and point.quality is quality for point in found)

        until(lambda: told(Quality.GOOD), 'both halls')
        for number, (name, (hall, _)) in enumerate(halls.items()):
            seen = board.machines[f'{name[1:]}.fan']
            assert seen.channels == tuple(machine.table.channels)  # from its model
            assert seen.points[X, 'Amplitude'].value == pytest.approx(
                abs(hall.expected(X, RUNNING + number)), rel=1e-14)
            until(lambda seen=seen: told(Quality.GOOD)
                  and seen.points['', 'State'].value == 'OK', 'a state')


def test_bytes_and_type_go_as_they_are(router):
    heard = []
    with (joined(connect=[router], wait=pytest.fail) as one,
          joined(connect=[router], wait=pytest.fail) as two):
        subscriber = two.declare_subscriber('rotorsoil/**', lambda sample: heard.append(
            (str(sample.key_expr), sample.payload.to_bytes(), sample.attachment.to_bytes(),
             sample.congestion_control)))
        sender, payload = ZenohSender(one), bytes(range(256))
        until(lambda: sender.take('/hall_2/rotorsoil/fan/amplitude', payload) or heard,
              'a message')
        subscriber.undeclare()
    kind = f'type={JOINT_STATE};hash={type_hash(JOINT_STATE)}'.encode()
    assert heard[0] == ('rotorsoil/hall_2/rotorsoil/fan/amplitude', payload, kind,
                        zenoh.CongestionControl.BLOCK)


def test_names_and_types_are_those_of_the_topics():
    for topic, kind in (('/rotorsoil/fan/model', STRING), (DIAGNOSTICS_TOPIC, DIAGNOSTICS),
                        ('/rotorsoil/fan/phase', JOINT_STATE)):
        assert topic_of(key_of(topic)) == topic
        assert attachment_of(topic) == f'type={kind};hash={type_hash(kind)}'.encode()


def test_models_are_sent_again_for_who_comes_later_and_values_are_not():
    sent = []
    session = SimpleNamespace(declare_publisher=lambda key, **_: SimpleNamespace(
        put=lambda payload, **_: sent.append(key)))
    sender = ZenohSender(session)
    sender.take('/rotorsoil/fan/model', b'a')
    sender.take('/rotorsoil/fan/phase', b'b')
    sent.clear()
    for _ in range(3 * MODELS_EVERY):
        sender.repeat()
    assert sent == 3 * ['rotorsoil/rotorsoil/fan/model']


@pytest.mark.parametrize('given', [{'connect': ['nowhere']}, {'listen': ['tcp/192.0.2.1:1']}])
def test_an_endpoint_that_is_none_is_told_in_one_line(given):
    with pytest.raises(InputError, match='--connect, --listen, --zenoh: ') as told, joined(
            **given, wait=pytest.fail):
        pass
    assert '\n' not in str(told.value)
    assert len(str(told.value)) < 200


def test_a_router_that_is_not_there_is_waited_for():
    address, waited = f'tcp/127.0.0.1:{free_port()}', []

    def wait(said):
        waited.append(said)
        if len(waited) == 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), joined(connect=[address], wait=wait):
        pass
    assert waited == 3 * [f'{address}: nobody answers']
