"""What several tests know of the house."""

# Packages of ROS: one wing imports them, everything else runs without.
ROS = {'rclpy', 'builtin_interfaces', 'diagnostic_msgs', 'lifecycle_msgs', 'rcl_interfaces',
       'sensor_msgs', 'std_msgs', 'std_srvs'}
