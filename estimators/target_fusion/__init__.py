"""A target's place, fused from the detections of a team of drones.

Source: Steckenrider, Leamy and Furukawa 2020, section III-C; docs/papers.md.
"""

from estimators.target_fusion.estimate import TargetEstimate
from estimators.target_fusion.estimator import TargetFusionEstimator
from estimators.target_fusion.parameters import Heading, Mount, Range, TargetFusionParameters

__all__ = ["Heading", "Mount", "Range", "TargetEstimate", "TargetFusionEstimator", "TargetFusionParameters"]
