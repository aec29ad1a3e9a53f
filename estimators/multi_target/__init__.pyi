"""Public names of `estimators.multi_target`, each where it is defined; see `__init__.py`."""

from estimators.multi_target.estimate import MultiTargetEstimate as MultiTargetEstimate
from estimators.multi_target.estimate import SearchEstimate as SearchEstimate
from estimators.multi_target.estimator import MultiTargetEstimator as MultiTargetEstimator
from estimators.multi_target.parameters import Belief as Belief
from estimators.multi_target.parameters import MultiTargetParameters as MultiTargetParameters
