"""Start the node: `ros2 launch rotorsoil_ros rotorsoil.launch.py case:=... or params:=...`."""

from pathlib import Path
from typing import Any

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchContext, LaunchDescription


def _node(context: LaunchContext) -> list[Node]:
    machine, case, logs, params, namespace = (
        LaunchConfiguration(name).perform(context)
        for name in ('machine', 'case', 'log_directory', 'params', 'namespace'))
    shipped = Path(FindPackageShare('rotorsoil_ros').perform(context), 'config', f'{machine}.yaml')
    own: list[Any] = [{
        'machines': [machine], f'{machine}.case': case or str(shipped), 'log.directory': logs}]
    return [Node(
        package='rotorsoil_ros', executable='rotorsoil_node', name='rotorsoil',
        namespace=namespace, output='screen', parameters=[params] if params else own)]


def generate_launch_description() -> LaunchDescription:
    """Return the node and its arguments."""
    return LaunchDescription([
        DeclareLaunchArgument('machine', default_value='paper_rotor',
                              description='Name of the machine, first part of its topics.'),
        DeclareLaunchArgument('case', default_value='',
                              description='Case file; empty: the shipped one of that name.'),
        DeclareLaunchArgument('log_directory', default_value='',
                              description='Directory for logs; empty: no logs.'),
        DeclareLaunchArgument('params', default_value='',
                              description='YAML file of parameters instead of the above.'),
        DeclareLaunchArgument('namespace', default_value='',
                              description='Namespace of the node and of all its topics.'),
        OpaqueFunction(function=_node),
    ])
