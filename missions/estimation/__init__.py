"""Estimators for flights: during a flight, in their own process, and over logs; reports and pictures."""
