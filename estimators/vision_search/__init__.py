"""The place of a tagged target, from what the cameras of a team detect and do not detect.

Source: Tisdale, Ryan, Kim, Tornqvist and Hedrick 2008, "A multiple UAV system for vision-based search and
localization"; docs/vision_search.md.
"""

from typing import TYPE_CHECKING

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from estimators.vision_search.estimate import AreaEstimate
    from estimators.vision_search.estimator import VisionSearchEstimator
    from estimators.vision_search.parameters import BeliefKind, VisionSearchParameters

__all__ = ["AreaEstimate", "BeliefKind", "VisionSearchEstimator", "VisionSearchParameters"]

__getattr__ = lazy_exports(
    __name__,
    {
        "AreaEstimate": "estimators.vision_search.estimate",
        "BeliefKind": "estimators.vision_search.parameters",
        "VisionSearchEstimator": "estimators.vision_search.estimator",
        "VisionSearchParameters": "estimators.vision_search.parameters",
    },
)
