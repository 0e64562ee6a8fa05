"""Shafts, discs and bearings, at every speed."""
