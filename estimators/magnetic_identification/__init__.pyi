"""Public names of `estimators.magnetic_identification`, each where it is defined; see `__init__.py`."""

from estimators.magnetic_identification.estimate import IdentificationEstimate as IdentificationEstimate
from estimators.magnetic_identification.estimator import (
    MagneticIdentificationEstimator as MagneticIdentificationEstimator,
)
from estimators.magnetic_identification.estimator import (
    MagneticIdentificationParameters as MagneticIdentificationParameters,
)
