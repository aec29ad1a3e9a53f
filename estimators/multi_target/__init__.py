"""An unknown number of targets, from scans of range and bearing.

Source: Yousuf, Lendek and Busoniu, "Exploration-Based Search for an Unknown Number of Targets using a UAV";
docs/multi_target.md.
"""

from typing import TYPE_CHECKING

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from estimators.multi_target.estimate import MultiTargetEstimate, SearchEstimate
    from estimators.multi_target.estimator import MultiTargetEstimator
    from estimators.multi_target.parameters import Belief, MultiTargetParameters

__all__ = ["Belief", "MultiTargetEstimate", "MultiTargetEstimator", "MultiTargetParameters", "SearchEstimate"]

__getattr__ = lazy_exports(
    __name__,
    {
        "Belief": "estimators.multi_target.parameters",
        "MultiTargetEstimate": "estimators.multi_target.estimate",
        "MultiTargetEstimator": "estimators.multi_target.estimator",
        "MultiTargetParameters": "estimators.multi_target.parameters",
        "SearchEstimate": "estimators.multi_target.estimate",
    },
)
