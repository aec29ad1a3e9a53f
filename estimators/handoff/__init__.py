"""The decision which of the handoff aircraft's tracks is the tracker's target (Tolman et al. 2021)."""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
