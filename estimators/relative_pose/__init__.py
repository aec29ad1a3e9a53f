"""The relative pose of two aircraft from their range, headings, pressures and motion, without GPS."""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
