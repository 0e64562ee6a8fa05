"""Several machines in one case file, each of them the source of an answer of its own."""
