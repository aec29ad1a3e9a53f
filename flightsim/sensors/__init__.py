"""Simulated sensors: each is rate, delay, noise, buffer and fault, with its own seeded stream."""
