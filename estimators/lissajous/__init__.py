"""Motion of a vehicle along a Lissajous pattern whose frequencies are uncertain (seed 000)."""

from estimators.lissajous.estimate import LissajousEstimate
from estimators.lissajous.estimator import LissajousEstimator
from estimators.lissajous.parameters import Form, LissajousParameters, Source

__all__ = ["Form", "LissajousEstimate", "LissajousEstimator", "LissajousParameters", "Source"]
