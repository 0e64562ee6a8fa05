"""Numbers: soil, foundation, rotor and their coupled response. No stream, no file, no plot."""
