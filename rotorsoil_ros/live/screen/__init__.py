"""What an engineer sees: the parts of one screen for the rerun viewer."""
