"""A target followed by line of sight from an aircraft that does not know its own position."""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
