"""Files that describe foundations that bend, and what is asked of them."""
