"""Pictures and pages on paper."""
