"""Foundations that bend: when a block is rigid, and what stands in for one that is not."""
