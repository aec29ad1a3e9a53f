"""A client for a vehicle on the bench through MAVSDK: identity, parameters, logs, health."""
