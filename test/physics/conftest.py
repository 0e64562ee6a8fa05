"""What several tests of the physics need."""

import numpy as np
import pytest

from rotorsoil_ros.physics import beam


@pytest.fixture
def no_shear(monkeypatch):
    """Make shafts stiff in shear, as Euler, Bernoulli and Rayleigh have them."""
    monkeypatch.setattr(beam, 'shear_coefficient', lambda nu, ratio: np.full_like(nu, 1e9))
