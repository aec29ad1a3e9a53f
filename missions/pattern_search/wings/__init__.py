"""Patterns flown by fixed wings."""
