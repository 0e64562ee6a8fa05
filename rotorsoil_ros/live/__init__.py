"""Streams: the monitor, its messages, logs, viewer and node."""
