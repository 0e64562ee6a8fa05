"""Is this foundation right for this machine? Answers, margins, what decides, what to do next."""
