"""Patterns flown by aircraft with wings."""
