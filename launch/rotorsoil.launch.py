"""
Start the node: `ros2 launch rotorsoil_ros rotorsoil.launch.py case:=... or params:=...`.

With `namespace:=hall_1,hall_2` it is one node for each of several halls.
"""

from pathlib import Path
import re
from typing import Any

from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
import yaml

from launch import LaunchContext, LaunchDescription


def machine_of(case: str) -> str:
    """Return the name of the machine of a case: what its file says, as a topic can have it."""
    path = Path(case).expanduser()
    try:
        name = str(yaml.safe_load(path.read_text(encoding='utf-8'))['name'])
    except (OSError, ValueError, yaml.YAMLError, KeyError, TypeError):
        name = path.stem  # a shipped case, or a file of which the node says what is wrong
    plain = re.sub(r'[^a-z0-9_]', '_', name.lower())
    return plain if plain[:1].isalpha() else f'm_{plain}'


def _node(context: LaunchContext) -> list[Node]:
    machine, case, logs, params, namespace = (
        LaunchConfiguration(name).perform(context)
        for name in ('machine', 'case', 'log_directory', 'params', 'namespace'))
    case = case or machine or 'paper_rotor'
    machine = machine or machine_of(case)
    own: list[Any] = [{
        'machines': [machine], f'{machine}.case': case, 'log.directory': logs}]
    return [Node(
        package='rotorsoil_ros', executable='rotorsoil_node', name='rotorsoil',
        namespace=each, output='screen', parameters=[params] if params else own)
        for each in namespace.split(',')]


def generate_launch_description() -> LaunchDescription:
    """Return the node and its arguments."""
    return LaunchDescription([
        DeclareLaunchArgument('machine', default_value='',
                              description='Name of the machine, first part of its topics; '
                                          'empty: that of the case.'),
        DeclareLaunchArgument('case', default_value='',
                              description='Case file, or the name of a shipped case; empty: '
                                          'that of the machine, or paper_rotor.'),
        DeclareLaunchArgument('log_directory', default_value='',
                              description='Directory for logs; empty: no logs.'),
        DeclareLaunchArgument('params', default_value='',
                              description='YAML file of parameters instead of the above.'),
        DeclareLaunchArgument('namespace', default_value='',
                              description='Namespace of the node and of all its topics; '
                                          'several, by commas: a node for each.'),
        OpaqueFunction(function=_node),
    ])
