"""What carries the machine: soil under a contact, massless, at every frequency."""
