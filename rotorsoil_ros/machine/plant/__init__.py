"""Several machines on the same blocks, and each as the only one that excites."""
