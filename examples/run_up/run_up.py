"""
Run a rotor up on the ROS graph, at 300 rad/s^2, and draw what its twin answers: a run-up.

    rotorsoil_node --ros-args -p machines:="[paper_rotor]" -p paper_rotor.case:=paper_rotor &
    python examples/run_up/run_up.py run_up.png
"""

import math
import sys
from typing import Any

import matplotlib.pyplot as plt
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState

MACHINE, CHANNEL = 'paper_rotor', 'disc_1_z'
FASTEST, STEP, PERIOD_S = 900.0, 3.0, 0.01  # [rad/s], [rad/s], [s]


class RunUp(Node):  # type: ignore[misc]
    """Tells speeds and keeps the amplitudes that are answered."""

    def __init__(self, **options: Any) -> None:
        super().__init__('run_up', **options)
        self.speeds: dict[int, float] = {}
        self.amplitudes: dict[int, float] = {}
        self._speaker = self.create_publisher(JointState, f'/{MACHINE}/joint_states', 10)
        self.create_subscription(
            JointState, f'/rotorsoil/{MACHINE}/amplitude', self._hear, 10)
        self.create_timer(PERIOD_S, self._speak)

    @property
    def is_done(self) -> bool:
        """Whether the fastest speed has been told and answered."""
        return FASTEST in (self.speeds.get(stamp) for stamp in self.amplitudes)

    def _speak(self) -> None:
        """Tell the next speed, once somebody hears it and somebody answers."""
        if not (self._speaker.get_subscription_count()
                and self.count_publishers(f'/rotorsoil/{MACHINE}/amplitude')):
            return
        speed = min(FASTEST, STEP * (len(self.speeds) + 1))
        message = JointState(name=['rotor'], velocity=[speed])
        message.header.stamp = self.get_clock().now().to_msg()
        self.speeds[_nanoseconds(message)] = speed
        self._speaker.publish(message)

    def _hear(self, message: JointState) -> None:
        self.amplitudes[_nanoseconds(message)] = message.position[message.name.index(CHANNEL)]

    def draw(self, path: str) -> None:
        """Draw amplitude over speed."""
        known = [stamp for stamp in self.amplitudes if stamp in self.speeds]
        figure, axes = plt.subplots()
        axes.plot([self.speeds[stamp] * 30.0 / math.pi for stamp in known],
                  [2e6 * self.amplitudes[stamp] for stamp in known])
        axes.set(xlabel='speed [rpm]', ylabel=f'{CHANNEL} [um p-p]', title=MACHINE)
        figure.savefig(path)
        plt.close(figure)


def _nanoseconds(message: JointState) -> int:
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def main(path: str) -> None:
    """Run up once."""
    rclpy.init()
    node = RunUp()
    while not node.is_done:
        rclpy.spin_once(node, timeout_sec=0.1)
    node.draw(path)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main(sys.argv[1])
