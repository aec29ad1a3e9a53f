"""A target followed by line of sight from an aircraft that does not know its own position."""

from estimators.orbit_target.estimator import OrbitTargetEstimate, OrbitTargetEstimator, OrbitTargetParameters

__all__ = ["OrbitTargetEstimate", "OrbitTargetEstimator", "OrbitTargetParameters"]
