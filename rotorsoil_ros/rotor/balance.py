"""How much unbalance a balance grade leaves on a rotor."""

import math

from rotorsoil_ros.errors import require


def permissible_unbalance(*, grade: float, mass: float, speed: float) -> float:
    """
    Return the residual unbalance of a whole rotor that its balance grade permits.

    Parameters
    ----------
    grade : float
        Eccentricity times speed [m/s]: G 6.3 is 6.3e-3 m/s.
    mass : float
        Of the rotor [kg].
    speed : float
        Highest service speed [rad/s].

    Returns
    -------
    float
        Moment m e = grade * mass / speed [kg m].

    References
    ----------
    ISO 21940-11:2016 (before: ISO 1940-1): a grade G is the permissible eccentricity times the
    highest service speed, e_per Omega in mm/s, and U_per = e_per m.

    """
    require(0.0 < grade < math.inf, 'grade', '> 0 m/s and finite', grade)
    require(0.0 < mass < math.inf, 'mass', '> 0 kg and finite', mass)
    require(0.0 < speed < math.inf, 'speed', '> 0 rad/s and finite', speed)
    return grade * mass / speed
