"""An unknown number of targets, from scans of range and bearing.

Source: Yousuf, Lendek and Busoniu, "Exploration-Based Search for an Unknown Number of Targets using a UAV";
docs/multi_target.md.
"""

from estimators.multi_target.estimate import MultiTargetEstimate, SearchEstimate
from estimators.multi_target.estimator import MultiTargetEstimator
from estimators.multi_target.parameters import Belief, MultiTargetParameters

__all__ = ["Belief", "MultiTargetEstimate", "MultiTargetEstimator", "MultiTargetParameters", "SearchEstimate"]
