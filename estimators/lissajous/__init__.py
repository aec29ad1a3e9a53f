"""Motion of a vehicle along a Lissajous pattern whose frequencies are uncertain.

Source: Steckenrider, Leamy and Furukawa 2020, section III; docs/papers.md.
"""

from estimators.lissajous.estimate import LissajousEstimate
from estimators.lissajous.estimator import LissajousEstimator
from estimators.lissajous.parameters import Form, LissajousParameters, Source

__all__ = ["Form", "LissajousEstimate", "LissajousEstimator", "LissajousParameters", "Source"]
