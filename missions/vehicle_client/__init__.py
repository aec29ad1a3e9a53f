"""Talking to a vehicle on the bench through MAVSDK: what it is, its parameters, its logs, its health."""
