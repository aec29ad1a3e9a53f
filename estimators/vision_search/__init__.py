"""The place of a tagged target, from what the cameras of a team detect and do not detect.

Source: Tisdale, Ryan, Kim, Tornqvist and Hedrick 2008, "A multiple UAV system for vision-based search and
localization"; docs/vision_search.md.
"""

from flightsim.foundation.lazy_exports import lazy_exports

__getattr__, __dir__, __all__ = lazy_exports(__name__, __file__)
