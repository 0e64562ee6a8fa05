"""Build as an ament_python package (colcon) or as a plain Python package (pip)."""

from glob import glob
from pathlib import Path
import re

from setuptools import find_packages, setup

NAME = 'rotorsoil_ros'
VERSION = re.search(r"__version__ = '(.+)'", Path(NAME, '__init__.py').read_text())[1]

setup(
    name=NAME,
    version=VERSION,
    description='What a rotor on real soil should vibrate like, as a ROS 2 node.',
    long_description=Path('README.md').read_text() if Path('README.md').exists() else '',
    long_description_content_type='text/markdown',
    license='Apache-2.0',
    maintainer='rotorsoil_ros maintainers',
    maintainer_email='maintainers@rotorsoil-ros.example',
    python_requires='>=3.11,<3.14',
    packages=find_packages(include=[NAME, f'{NAME}.*']),
    # rotorsoil_ros/config is a link to config: reachable without an ament index, kept once.
    package_data={NAME: ['py.typed', 'config/*.yaml', 'config/library/*.yaml',
                         'wire/interfaces/*/msg/*.msg']},
    data_files=[
        ('share/ament_index/resource_index/packages', [f'resource/{NAME}']),
        (f'share/{NAME}', ['package.xml']),
        (f'share/{NAME}/config', sorted(glob('config/*.yaml'))),
        (f'share/{NAME}/config/library', sorted(glob('config/library/*.yaml'))),
        (f'share/{NAME}/layouts', sorted(glob('layouts/*'))),
        (f'share/{NAME}/launch', sorted(glob('launch/*.*'))),
    ],
    zip_safe=False,
    install_requires=[
        'setuptools',
        'lz4>=4.0.2',
        'matplotlib>=3.8',
        'mcap>=1.2.1',
        'numpy>=1.26',
        'pint>=0.23',
        'pydantic>=2.5',
        'PyYAML>=6.0.1',
        'rich>=13.0',
        'scikit-fem>=10.0',
        'scipy>=1.11.1',
        'zstandard>=0.20',
    ],
    extras_require={
        # ROSS brings plotly of another age along: an environment of its own is the best place.
        'bench': ['plotly<6', 'ross-rotordynamics>=2.3'],
        # For the tests, where mosquitto is not installed; it wants younger libraries than ours do.
        'broker': ['amqtt>=0.12'],
        'cluster': ['distributed>=2024.1'],
        'docs': [
            'furo>=2024.8.6',
            'myst-parser>=4.0',
            'numpydoc>=1.8',
            'sphinx>=8.0',
            'ziamath>=0.12',
        ],
        'bags': ['rosbags>=0.11.0'],
        'mqtt': ['paho-mqtt>=2.0', 'protobuf>=4.25'],
        'opcua': ['asyncua>=2.0'],
        'frames': ['pandas>=2.0', 'xarray>=2023.6'],
        'ros': [
            'ros-jazzy-common-interfaces>=5.3.6',
            'ros-jazzy-rclpy>=7.1.6',
            'ros-rclpy[fastrtps]>=7.1.6',
        ],
        'tables': ['openpyxl>=3.1.0', 'pyarrow>=14.0.1', 'pyuff>=2.4.6'],
        'viewer': ['rerun-sdk>=0.38'],
        'zenoh': ['eclipse-zenoh>=1.2'],
        'test': [
            'asyncua>=2.0',
            'cyclonedds>=11.0; sys_platform == "linux" and platform_machine == "x86_64"',
            'distributed>=2024.1',
            'eclipse-zenoh>=1.2',
            'foxglove-sdk>=0.30.3',
            'hypothesis>=6.100',
            'mypy>=1.10',
            'openpyxl>=3.1.0',
            'paho-mqtt>=2.0',
            'pandas>=2.0',
            'protobuf>=4.25',
            'pyarrow>=14.0.1',
            'pytest>=8.2',
            'pytest-xdist>=3.6',
            'pyuff>=2.4.6',
            'ros-parser>=0.9.0',
            'rosbags>=0.11.0',
            'ruff>=0.6',
            'types-PyYAML',
            'xarray>=2023.6',
        ],
    },
    entry_points={
        'console_scripts': [
            f'rotorsoil = {NAME}.cli:main',
            f'rotorsoil_node = {NAME}.node:main',
        ],
        # Called as its module, so that naming it by hand does not load it twice.
        'pytest11': [f'{NAME}.testing.plugin = {NAME}.testing.plugin'],
    },
)
