"""From what sensors send to displacement vectors that know the speed they belong to."""
