"""Tests of packages beside the twin of a machine: no launch file, no sleep, no other graph."""
