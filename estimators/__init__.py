"""Onboard estimators and the logs they can be fed from."""
