"""Roll and pitch by a complementary filter on SO(3), for fixed wings and multirotors (docs/attitude.md)."""

from estimators.attitude.estimate import AttitudeEstimate
from estimators.attitude.estimator import AttitudeEstimator
from estimators.attitude.parameters import AirspeedSource, AttitudeParameters, ImuSource, VehicleKind

__all__ = [
    "AirspeedSource",
    "AttitudeEstimate",
    "AttitudeEstimator",
    "AttitudeParameters",
    "ImuSource",
    "VehicleKind",
]
