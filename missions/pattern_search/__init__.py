"""The search patterns as missions."""
