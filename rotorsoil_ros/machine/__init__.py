"""Rotors on foundations on ground, solved together: response and modes."""
