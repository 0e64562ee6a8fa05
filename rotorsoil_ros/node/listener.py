"""A node that only listens: what the answering nodes of a graph say, for a feed."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

import rclpy
from rclpy.context import Context
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.task import Future

from rotorsoil_ros.feeds.hearsay import HEARD, MODEL, places_in, Taker, type_of
from rotorsoil_ros.node.interfaces import message_class
from rotorsoil_ros.wire.definitions import DIAGNOSTICS
from rotorsoil_ros.wire.messages import DIAGNOSTICS_TOPIC

LOOK_S = 1.0  # how often the graph is searched for machines
# Nobody resends to a feed, and nobody waits for one: the next value is worth more than the last.
VALUES = QoSProfile(depth=5, reliability=ReliabilityPolicy.BEST_EFFORT)
RESENT = QoSProfile(depth=1000, reliability=ReliabilityPolicy.RELIABLE)  # of who sends them on
REPORTS = QoSProfile(depth=1000, reliability=ReliabilityPolicy.BEST_EFFORT)
MODELS = QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE,
                    durability=DurabilityPolicy.TRANSIENT_LOCAL)


class GraphListener(Node):  # type: ignore[misc]
    """
    Hears every machine of the graph, also those that come later, and puts bytes into an inbox.

    It publishes nothing and offers no service. With `every`, each value is wanted, not the last.
    """

    def __init__(self, inbox: Taker, context: Context, *, every: bool = False) -> None:
        super().__init__('rotorsoil_feed', context=context, start_parameter_services=False,
                         enable_rosout=False)
        self._inbox, self._values = inbox, RESENT if every else VALUES
        self._heard: set[str] = set()
        self._hear(DIAGNOSTICS_TOPIC, DIAGNOSTICS, REPORTS)
        self.create_timer(LOOK_S, self._look)
        self._executor = EventsExecutor(context=context)
        self._executor.add_node(self)

    def hear(self, seconds: float) -> None:
        """Take in what comes within some time."""
        self._executor.spin_until_future_complete(Future(), timeout_sec=seconds)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.destroy_node()

    def _look(self) -> None:
        """Subscribe to whoever answers and is not heard yet."""
        topics = {topic: kinds[0] for topic, kinds in self.get_topic_names_and_types()
                  if len(kinds) == 1}
        for place in places_in(topics):
            for name in HEARD:
                topic = f'/{place.path}/{name}'
                if topic in topics and topic not in self._heard:
                    self._hear(topic, type_of(name), MODELS if name == MODEL else self._values)

    def _hear(self, topic: str, kind: str, profile: QoSProfile) -> None:
        self._heard.add(topic)
        self.create_subscription(message_class(kind), topic, partial(self._inbox.take, topic),
                                 profile, raw=True)


@contextmanager
def listening(inbox: Taker, *, every: bool = False) -> Iterator[GraphListener]:
    """Hear a graph in a context of its own."""
    from rclpy.signals import SignalHandlerOptions

    context = Context()
    rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
    try:
        listener = GraphListener(inbox, context, every=every)
        try:
            yield listener
        finally:
            listener.close()
    finally:
        context.try_shutdown()
