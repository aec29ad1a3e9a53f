"""Magnetic targets: which anomalies of the field are one (Lum, Rysdyk and Pongpunwattana 2005)."""

from estimators.magnetic_identification.estimate import IdentificationEstimate
from estimators.magnetic_identification.estimator import (
    MagneticIdentificationEstimator,
    MagneticIdentificationParameters,
)

__all__ = ["IdentificationEstimate", "MagneticIdentificationEstimator", "MagneticIdentificationParameters"]
