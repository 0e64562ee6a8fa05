"""Start the node for one machine: `ros2 launch rotorsoil_ros rotorsoil.launch.py case:=...`."""

from pathlib import Path

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackageShare

from launch import LaunchContext, LaunchDescription


def _node(context: LaunchContext) -> list[Node]:
    machine, case, logs = (LaunchConfiguration(name).perform(context)
                           for name in ('machine', 'case', 'log_directory'))
    shipped = Path(FindPackageShare('rotorsoil_ros').perform(context), 'config', f'{machine}.yaml')
    return [Node(
        package='rotorsoil_ros', executable='rotorsoil_node', name='rotorsoil', output='screen',
        parameters=[{
            'machines': [machine], f'{machine}.case': case or str(shipped),
            'log.directory': logs,
        }])]


def generate_launch_description() -> LaunchDescription:
    """Return the node and its arguments."""
    return LaunchDescription([
        DeclareLaunchArgument('machine', default_value='paper_rotor',
                              description='Name of the machine, first part of its topics.'),
        DeclareLaunchArgument('case', default_value='',
                              description='Case file; empty: the shipped one of that name.'),
        DeclareLaunchArgument('log_directory', default_value='',
                              description='Directory for logs; empty: no logs.'),
        OpaqueFunction(function=_node),
    ])
