"""What a machine answers while its speed changes."""
