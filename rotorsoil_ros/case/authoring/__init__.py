"""Cases that a program writes: from what a plant knows, and into a file with its comments."""
