"""The ROS graph: the only wing that knows rclpy."""
