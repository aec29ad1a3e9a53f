"""A baseline: ergodic coverage, by which the share of time in a region tends to the share of the targets that
are expected there.

Source: Mathew and Mezic 2011, "Metrics for ergodicity and design of ergodic dynamics for multi-agent
systems", equations 7 to 22: spectral multiscale coverage with first-order dynamics. The distribution is that
of the targets that are still to be found, so it changes with each scan (Miller, Silverman, MacIver and
Murphey 2016, "Ergodic exploration of distributed information"), and what was flown is forgotten with a time
constant.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from flightsim.foundation.geodetic_position import NorthEast
from missions.search.area import Area

__all__ = ["ErgodicPlanner"]

Array = NDArray[np.float64]

_ORDER: Final = 12
"""Waves along each side: the shortest is about as long as the paper's sensor is wide."""
_UNEQUAL: Final = 1.2
_FORGOTTEN: Final = 0.9  # share of a step's weight after one more step: what was flown in the last ten counts


class ErgodicPlanner:
    """Steps in the direction in which the difference of both distributions falls most.

    Args:
        area: that is covered.
        step_m: length of a step.
        turn_limit_rad: largest change of direction in a step.
    """

    def __init__(self, area: Area, step_m: float, turn_limit_rad: float = math.pi) -> None:
        self._area = area
        self._step_m = step_m
        self._turn_limit_rad = turn_limit_rad
        orders = np.arange(_ORDER + 1)
        rows, columns = (axis.ravel() for axis in np.meshgrid(orders, orders, indexing="ij"))
        self._north = rows * math.pi / area.height_m
        self._east = columns * math.pi / area.width_m
        norm = np.where(rows > 0, math.sqrt(0.5), 1.0) * np.where(columns > 0, math.sqrt(0.5), 1.0)
        self._scale = 1.0 / norm
        # the norm of a Sobolev space of negative order: large scales first (equation 8)
        # the sides differ a little, or a start on a diagonal of a square would never leave it
        self._weight = (1.0 + rows**2 + _UNEQUAL * columns**2) ** -1.5
        self._flown = np.zeros(len(rows))
        self._total = 0.0

    def next_place(
        self, belief: SearchBelief, here: NorthEast, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> NorthEast:
        for place in (here, *((view.north_m, view.east_m) for view in others)):
            self._flown += self._waves(*place)
            self._total += 1.0
        share = self._weight * (self._flown / self._total - self._expected(belief))
        n, e = here[0] - self._area.south_m, here[1] - self._area.west_m
        slope_n = -share @ (self._scale * self._north * np.sin(self._north * n) * np.cos(self._east * e))
        slope_e = -share @ (self._scale * self._east * np.cos(self._north * n) * np.sin(self._east * e))
        self._flown *= _FORGOTTEN
        self._total *= _FORGOTTEN
        course = math.atan2(-slope_e, -slope_n)
        if direction_rad is not None:
            turn = math.remainder(course - direction_rad, math.tau)
            course = direction_rad + max(-self._turn_limit_rad, min(self._turn_limit_rad, turn))
        return self._area.nearest(
            here[0] + self._step_m * math.cos(course), here[1] + self._step_m * math.sin(course)
        )

    def _waves(self, north_m: float, east_m: float) -> Array:
        """The cosines at a place (equation 4)."""
        north, east = north_m - self._area.south_m, east_m - self._area.west_m
        found: Array = self._scale * np.cos(self._north * north) * np.cos(self._east * east)
        return found

    def _expected(self, belief: SearchBelief) -> Array:
        """Coefficients of the targets that are expected and not found."""
        north, east, undetected_m2 = belief.exploration.points()
        detected = belief.points()
        north, east = np.concatenate((north, detected[0])), np.concatenate((east, detected[1]))
        mass = np.concatenate((belief.parameters.birth_per_m2 * undetected_m2, detected[2]))
        # cosines of multiples by their product over both axes
        waves_n = np.cos(np.outer(np.unique(self._north), north - self._area.south_m))
        waves_e = np.cos(np.outer(np.unique(self._east), east - self._area.west_m))
        found: Array = self._scale * ((waves_n * mass) @ waves_e.T).ravel() / mass.sum()
        return found
