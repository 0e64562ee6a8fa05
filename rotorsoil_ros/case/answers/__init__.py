"""What a machine answers, by the kind of question."""
