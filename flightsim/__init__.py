"""The world: vehicles, air, sensors. Uses no MAVLink, no sockets and no wall clock."""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
