"""Build as an ament_python package."""

from setuptools import setup

setup(
    name='fan_bridge', version='0.1.0', packages=['fan_bridge'],
    description='Bring the rpm of a PLC to the twin of a fan.',
    maintainer='you', maintainer_email='you@plant.example', license='Apache-2.0',
    data_files=[('share/ament_index/resource_index/packages', ['resource/fan_bridge']),
                ('share/fan_bridge', ['package.xml'])],
    install_requires=['setuptools'], extras_require={'test': ['pytest', 'rotorsoil_ros[ros]']},
    entry_points={'console_scripts': ['fan_bridge = fan_bridge.bridge:main']})
