"""Finite elements near the contact, infinite elements with exponential decay beyond."""
