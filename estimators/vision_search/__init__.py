"""The place of a tagged target, from what the cameras of a team detect and do not detect.

Source: Tisdale, Ryan, Kim, Tornqvist and Hedrick 2008, "A multiple UAV system for vision-based search and
localization"; docs/vision_search.md.
"""

from estimators.vision_search.estimate import AreaEstimate
from estimators.vision_search.estimator import VisionSearchEstimator
from estimators.vision_search.parameters import BeliefKind, VisionSearchParameters

__all__ = ["AreaEstimate", "BeliefKind", "VisionSearchEstimator", "VisionSearchParameters"]
