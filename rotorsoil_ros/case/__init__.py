"""Files: the case in YAML, the cache of tables, the pictures."""
