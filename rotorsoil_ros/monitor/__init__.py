"""A stream of speeds and measurements becomes answers, comparisons and verdicts."""
