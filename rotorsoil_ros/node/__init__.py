"""The ROS graph: the only wing that knows rclpy."""


def main() -> int:
    """Run the node; a Ctrl-C while the libraries are still being loaded ends it quietly."""
    try:
        from rotorsoil_ros.node.node import main as run
    except KeyboardInterrupt:
        return 0
    return run()
