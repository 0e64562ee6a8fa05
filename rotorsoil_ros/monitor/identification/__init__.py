"""Which unbalance, soil or bearing explain a measured run, and how well they are known."""
