"""Hear an Int32 in rpm, tell a JointState in rad/s."""

import math
from typing import Any

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Int32


class FanBridge(Node):  # type: ignore[misc]
    """Hears `/plc/fan/rpm`, tells `/plant_fan/joint_states`."""

    def __init__(self, **options: Any) -> None:
        super().__init__('fan_bridge', **options)
        self._told = self.create_publisher(JointState, '/plant_fan/joint_states', 10)
        self.create_subscription(Int32, '/plc/fan/rpm', self._hear, 10)

    def _hear(self, message: Int32) -> None:
        told = JointState(name=['rotor'], velocity=[message.data * 2.0 * math.pi / 60.0])
        told.header.stamp = self.get_clock().now().to_msg()
        self._told.publish(told)


def main() -> None:
    """Run the bridge until it is stopped."""
    rclpy.init()
    rclpy.spin(FanBridge())


if __name__ == '__main__':
    main()
