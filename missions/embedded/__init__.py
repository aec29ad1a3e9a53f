"""The embedded SITL: a simulated world in this process that missions are flown in."""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
