"""Verbs that live as long as the node does."""
