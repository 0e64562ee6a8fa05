"""Contacts of any plan on a half-space, by boundary elements."""
