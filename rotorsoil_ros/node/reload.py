"""How does a changed case file come into a running node? Aside, and then all at once."""

from collections.abc import Callable
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.lifecycle import LifecycleNode
from std_srvs.srv import Trigger

from rotorsoil_ros.background import Errand
from rotorsoil_ros.case.machine import Machine

RELOAD_GLANCE_S = 0.05


class Reloader:
    """
    The service `~/<name>/reload` of a machine or plant, which answers when the outcome is known.

    A thread reads the case file, which may have to solve oil films for that, and waits for the
    tables, which other processes compute; the executor only swaps what is ready, so that a speed
    is answered from the old case or from the new one.
    """

    def __init__(
        self, node: LifecycleNode, name: str, *, load: Callable[[], dict[str, Machine]],
        take: Callable[[dict[str, Machine]], str],
    ) -> None:
        self._node, self._name = node, name
        self._load, self._take = load, take
        self._errand: Errand[dict[str, Machine]] | None = None
        self._asked: tuple[Any, Any] | None = None  # response and header of who waits
        self._timer = node.create_timer(
            RELOAD_GLANCE_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._timer.cancel()
        self._service = node.create_service(Trigger, f'~/{name}/reload', self._serve)
        # EventsExecutor knows no coroutines: what every executor calls to answer is held back.
        self._answer = self._service.send_response
        self._service.send_response = self._send

    def destroy(self) -> None:
        """Leave the graph; who waits is told."""
        if self._asked is not None:
            self._reply(f'{self._name}: the node was stopped or cleaned up; the old case stays')
        self._node.destroy_service(self._service)
        self._node.destroy_timer(self._timer)

    def _serve(self, request: Any, response: Any) -> Any:
        del request
        if self._errand is not None:
            response.message = f'{self._name}: a reload is under way'
            return response
        errand = Errand(self._load, name=f'reload {self._name}')
        if not errand.has_begun:
            response.message = f'{errand.failure}; the old case stays'
            return response
        self._errand = errand
        self._timer.reset()
        return response

    def _send(self, response: Any, header: Any) -> None:
        """Answer, unless the outcome is not known yet."""
        if response.message:
            self._answer(response, header)
        else:
            self._asked = response, header

    def _reply(self, text: str, *, is_done: bool = False) -> None:
        """Answer who waits."""
        if self._asked is not None:
            (response, header), self._asked = self._asked, None
            response.success, response.message = is_done, text
            self._answer(response, header)

    def _look(self) -> None:
        """Swap what was loaded."""
        if self._errand is None or not self._errand.is_done:
            return
        errand, self._errand = self._errand, None
        self._timer.cancel()
        if errand.result is not None:
            said, is_taken = f'{self._name}: the new case could not be taken: see the log', False
            try:  # whoever waits is answered whatever it raises, which goes on to the log
                said = self._take(errand.result)
                is_taken = True
                self._node.get_logger().info(said)
            finally:
                self._reply(said, is_done=is_taken)
        else:
            said = f'{errand.failure}; the old case stays'
            self._node.get_logger().error(said)
            self._reply(said)
