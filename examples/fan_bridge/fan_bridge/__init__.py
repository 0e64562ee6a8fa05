"""Bring the rpm of a PLC to the twin of a fan."""
