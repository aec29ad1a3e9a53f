"""Public names of `estimators.vision_search`, each where it is defined; see `__init__.py`."""

from estimators.vision_search.estimate import AreaEstimate as AreaEstimate
from estimators.vision_search.estimator import VisionSearchEstimator as VisionSearchEstimator
from estimators.vision_search.parameters import BeliefKind as BeliefKind
from estimators.vision_search.parameters import VisionSearchParameters as VisionSearchParameters
