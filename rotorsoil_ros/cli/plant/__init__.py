"""What verbs say of several machines at once."""
