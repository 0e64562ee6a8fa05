"""
What a rotor on real soil should vibrate like, as a ROS 2 node.

Conventions
-----------
Every amplitude is complex and zero-to-peak: x(t) = Re(X exp(+i omega t)).
Axes: x horizontal and lateral, y along the shaft, z up; positive spin takes z into x.
A rotor node has the degrees of freedom (x, z, rx, rz); a block and its contact have
(x, y, z, rx, ry, rz) at the contact centre.
Inside the package everything is SI and rad/s; names of user-facing keys say their unit.
"""

__version__ = '0.1.0'
