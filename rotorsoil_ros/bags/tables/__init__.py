"""Tables in and out: what a plant has measured becomes a bag, and a log becomes a table."""
