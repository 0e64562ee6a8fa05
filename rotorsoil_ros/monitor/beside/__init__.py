"""Machines on the same blocks: what of a measured vector is theirs."""
