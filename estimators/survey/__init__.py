"""Magnetic surveys: compensation, lines, levels, anomalies and the map (docs/magnetic_survey.md)."""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
