"""Magnetic targets: which anomalies of the field are one (Lum, Rysdyk and Pongpunwattana 2005)."""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
