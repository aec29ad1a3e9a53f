"""The value of a place for the next scan: information about detected targets, and exploration.

Source: Yousuf, Lendek and Busoniu, equation 14; docs/multi_target.md has the forms for several steps and
several vehicles, and why exploration counts what the scan sees.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.exploration import ExplorationMap
from estimators.tracking.information import condensed, detections_at, information_at
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint
from missions.search.planner_parameters import Exploration

__all__ = ["Outlook", "SearchObjective"]

Array = NDArray[np.float64]

_CELL_M = 1.0  # the intensity is summed up in cells of this side: the sensor's scale is some ten metres


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outlook:
    """What is expected to be left after some future scans that detect nothing.

    Attributes:
        mass: (n,) of each point of the intensity.
        undetected: (m,) expected number of undetected targets in each cell of the exploration map; empty
            where the map at the vehicle's place is the exploration.
        views: the scans.
    """

    mass: Array
    undetected: Array
    views: tuple[Viewpoint, ...]


class SearchObjective:
    """Values of places, for one state of the belief.

    Given that a scan detects nothing, the targets are again a Poisson set, of the intensity (1 - p_D) D. So
    for several scans the information is the sum over the scans with the intensity thinned by those before,
    which is exact for the branch in which nothing is detected. The exploration map is thinned in the same
    way.

    Args:
        sensor: what is known about the sensor.
        points: north, east and mass (n,) of the intensity.
        exploration: the map.
        alpha: weight of the exploration, nats: of a target that is detected for the first time, or of an
            unexplored place.
        kind: what exploration is.
        targets_per_m2: expected before the search.
    """

    def __init__(
        self,
        sensor: RangeBearingSensor,
        points: tuple[Array, Array, Array],
        exploration: ExplorationMap,
        alpha: float,
        *,
        kind: Exploration = Exploration.PLACE,
        targets_per_m2: float = 0.0,
    ) -> None:
        self._sensor = sensor
        self._north, self._east, self._mass = condensed(*points, cell_m=_CELL_M)
        self._exploration = exploration
        self._alpha = alpha
        self._cells_north, self._cells_east, undetected_m2 = exploration.points()
        in_view = alpha > 0.0 and kind is Exploration.VIEW
        self._undetected = targets_per_m2 * undetected_m2 if in_view else np.empty(0)

    def outlook(self, views: Sequence[Viewpoint] = ()) -> Outlook:
        """The outlook after the scans that other vehicles are about to take."""
        found = Outlook(mass=self._mass, undetected=self._undetected, views=())
        for view in views:
            found = self.after(found, view)
        return found

    def after(self, outlook: Outlook, view: Viewpoint) -> Outlook:
        """The outlook after one more scan."""
        left = outlook.mass * (1.0 - self._sensor.probability(self._north, self._east, view))
        undetected = outlook.undetected
        if undetected.size:
            undetected = undetected * (
                1.0 - self._sensor.probability(self._cells_north, self._cells_east, view)
            )
        return Outlook(mass=left, undetected=undetected, views=(*outlook.views, view))

    def values(self, outlook: Outlook, places: Array, heading_rad: Array) -> Array:
        """Information plus alpha times exploration of a scan at each place.

        Args:
            outlook: what is left before it.
            places: (k, 2) north and east.
            heading_rad: (k,) heading of the vehicle there.
        """
        viewpoints = np.column_stack((places, heading_rad))
        information = information_at(self._north, self._east, outlook.mass, self._sensor.values, viewpoints)
        if not self._alpha > 0.0:
            return information
        if outlook.undetected.size:
            return information + self._alpha * detections_at(
                self._cells_north, self._cells_east, outlook.undetected, self._sensor.values, viewpoints
            )
        unexplored = self._exploration.at(places[:, 0], places[:, 1])
        for view in outlook.views:
            unexplored = unexplored * (1.0 - self._sensor.probability(places[:, 0], places[:, 1], view))
        return information + self._alpha * unexplored
