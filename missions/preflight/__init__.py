"""Checks before a flight: findings from a vehicle's messages and parameters."""
