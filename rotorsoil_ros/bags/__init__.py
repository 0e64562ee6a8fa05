"""Logs in MCAP: written, read, mended, answered."""
