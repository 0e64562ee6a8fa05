"""Rotors that ROSS has saved, as cases; ROSS itself is not needed."""

from rotorsoil_ros.case.ross.rotor import Imported, read

__all__ = ['Imported', 'read']
