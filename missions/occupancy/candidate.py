"""A place at which a search that counts by threshold has detected anomalies."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from estimators.occupancy.detection import Anomaly
from estimators.occupancy.localisation import gaussian_centre

_FAR_M: Final = 250.0  # largest distance of a centre from the peaks


@dataclass(slots=True, kw_only=True)
class Candidate:
    """A place at which anomalies were detected.

    Attributes:
        anomalies: (searcher, anomaly), in the order of time.
        noise_nt: standard deviation of a reading.
    """

    anomalies: list[tuple[int, Anomaly]]
    noise_nt: float = 0.5

    @property
    def passes(self) -> int:
        """Number of passes that detected it."""
        return len(self.anomalies)

    @property
    def place_ne_m(self) -> tuple[float, float]:
        """Centre of a Gaussian fitted to the readings; when they do not determine it, the weighted mean of
        the peaks.
        """
        weights = np.array([abs(anomaly.peak_nt) for _, anomaly in self.anomalies])
        places = np.array([(anomaly.north_m, anomaly.east_m) for _, anomaly in self.anomalies])
        north_m, east_m = (weights @ places / weights.sum()).tolist()
        profile = np.array([reading for _, anomaly in self.anomalies for reading in anomaly.profile])
        if len(profile):
            centre = gaussian_centre(profile[:, 0], profile[:, 1], profile[:, 2], noise_nt=self.noise_nt)
            if centre is not None and math.dist(centre, (north_m, east_m)) <= _FAR_M:
                return centre
        return north_m, east_m
