"""How the machine vibrates on its own: modes, criticals, stability, and what they are called."""
