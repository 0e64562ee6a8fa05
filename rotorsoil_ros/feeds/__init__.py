"""What the node answers, for those who do not speak ROS: control rooms and other halls."""
