"""Events as bytes of ROS messages, with or without ROS installed."""
