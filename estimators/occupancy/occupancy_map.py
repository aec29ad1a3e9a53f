"""The occupancy map of a search: scores of cells that searching lowers and that identified anomalies raise.

Source: Lum, Rysdyk and Pongpunwattana 2005, section IV-B, equations 10 and 11; docs/papers.md. North and east
are metres from home; arrays have rows to the north and columns to the east.
"""

import numpy as np
from numpy.typing import NDArray

from estimators.occupancy.detection import DetectionModel
from estimators.tracking.grid import GridBelief, GridLayout

Array = NDArray[np.float64]


class OccupancyMap:
    """Scores of the cells, shared by every searcher, and the probability of detection so far.

    The initial scores are the prior probability that the target is in a cell. Later they are no longer
    probabilities: equation 11 isn't normalised, and raising adds belief.

    Attributes:
        layout: the cells.
        scores: (rows, columns), used for decisions.
        belief: where the target is if no searcher has detected it so far. It does not change when a target is
            identified (Bourgault et al. 2003).
    """

    def __init__(self, layout: GridLayout, prior: Array | None = None) -> None:
        """Initialise the map.

        Args:
            layout: the cells.
            prior: (rows, columns), relative probability of each cell, finite and not negative; None: all
                equal.

        Raises:
            EstimatorError: the prior has another shape, or no probability above zero.
        """
        self.layout = layout
        self.belief = GridBelief(layout, prior)
        self.scores: Array = self.belief.mass.copy()
        self._centres = layout.centres()

    @property
    def probability_of_detection(self) -> float:
        """Probability that a target on the map would have been detected so far."""
        return self.belief.probability_of_detection

    def search(
        self, start_ne_m: tuple[float, float], end_ne_m: tuple[float, float], model: DetectionModel
    ) -> None:
        """Lower the scores along a straight stretch of track on which nothing was detected (eq. 10, 11)."""
        north, east = self._centres
        missed = 1.0 - model.probability(north, east, start_ne_m, end_ne_m)
        self.scores *= missed
        self.belief.update(missed)

    def raise_around(self, north_m: float, east_m: float, *, radius_m: float, height: float) -> None:
        """Raise the scores around an identified target by a Gaussian, so that other searchers converge.

        Args:
            north_m, east_m: position of the target.
            radius_m: scores farther away do not change; it is two standard deviations of the Gaussian.
            height: height of the Gaussian's peak, in multiples of the prior's mean score.
        """
        north, east = self._centres
        distance2 = (north - north_m) ** 2 + (east - east_m) ** 2
        sigma_m = 0.5 * radius_m
        peak = height / (self.layout.rows * self.layout.columns)
        self.scores += np.where(distance2 <= radius_m**2, peak * np.exp(-0.5 * distance2 / sigma_m**2), 0.0)

    def dismiss(self, north_m: float, east_m: float, model: DetectionModel) -> None:
        """Lower the scores around a false anomaly, as a pass right over it does (eq. 11)."""
        north, east = self._centres
        distance2 = (north - north_m) ** 2 + (east - east_m) ** 2
        missed = 1.0 - model.probability_overhead * np.exp(-0.5 * distance2 / model.range_m**2)
        self.scores *= missed
        self.belief.update(missed)
