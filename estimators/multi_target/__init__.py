"""An unknown number of targets, from scans of range and bearing.

Source: Yousuf, Lendek and Busoniu, "Exploration-Based Search for an Unknown Number of Targets using a UAV";
docs/multi_target.md.
"""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
