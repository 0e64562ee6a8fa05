"""Mappings of a case file: what all have in common, and those that are long."""
