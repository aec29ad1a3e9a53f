"""Public names of `estimators.orbit_target`, each where it is defined; see `__init__.py`."""

from estimators.orbit_target.estimator import OrbitTargetEstimate as OrbitTargetEstimate
from estimators.orbit_target.estimator import OrbitTargetEstimator as OrbitTargetEstimator
from estimators.orbit_target.parameters import OrbitTargetParameters as OrbitTargetParameters
