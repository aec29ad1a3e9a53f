"""Exploration map: the probability that a target at a place was never detected.

Source: Yousuf, Lendek and Busoniu, equation 15. The product over the scans of 1 - p_D is that probability
for a static target, so with a density of targets before the search it is the intensity of the undetected
ones.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.grid import GridLayout
from estimators.tracking.range_bearing import RangeBearingSensor, Viewpoint, detection_probabilities

__all__ = ["ExplorationMap"]

Array = NDArray[np.float64]

_EDGE_SIGMAS: Final = 4.0


class ExplorationMap:
    """The map on the centres of square cells, linear between them.

    Args:
        layout: the cells of the searched area.
        sensor: what is known about the sensor.
        forget_s: time constant with which the map returns to 1, for targets that move or appear; infinity:
            never.

    Attributes:
        layout: as given.
        undetected: (rows, columns), 1 at first.
    """

    def __init__(self, layout: GridLayout, sensor: RangeBearingSensor, forget_s: float = math.inf) -> None:
        self.layout = layout
        self.undetected: Array = np.ones((layout.rows, layout.columns))
        self._forget_s = forget_s
        self._sensor: Array = sensor.values
        north, east = np.broadcast_arrays(*layout.centres())
        self._north: Array = np.ascontiguousarray(north).ravel()
        self._east: Array = np.ascontiguousarray(east).ravel()
        self._seen: Array = np.empty(self._north.size)
        # a measurement of a target at the edge may lie outside
        self._edge_m = _EDGE_SIGMAS * math.hypot(
            sensor.range_sigma_m, sensor.bearing_sigma_rad * sensor.forward_scale_m
        )

    def predict(self, dt_s: float) -> None:
        """Forget some of what was seen."""
        if math.isfinite(self._forget_s):
            self.undetected[:] = 1.0 - (1.0 - self.undetected) * math.exp(-dt_s / self._forget_s)

    def look(self, viewpoint: Viewpoint) -> None:
        """Multiply by 1 - p_D (equation 15)."""
        self.undetected *= 1.0 - self.seen(viewpoint)

    def seen(self, viewpoint: Viewpoint) -> Array:
        """Probability of detection in each cell, (rows, columns); valid until the next call."""
        detection_probabilities(self._north, self._east, self._sensor, viewpoint.values, self._seen)
        return self._seen.reshape(self.undetected.shape)

    def at(self, north_m: Array, east_m: Array) -> Array:
        """The map at places (n,); beyond the outermost centres that of the nearest edge, and 0 far outside
        the area, where no target is expected.
        """
        layout = self.layout
        y = np.clip((north_m - layout.south_m) / layout.cell_m - 0.5, 0.0, layout.rows - 1.0)
        x = np.clip((east_m - layout.west_m) / layout.cell_m - 0.5, 0.0, layout.columns - 1.0)
        row = np.minimum(y.astype(np.int64), layout.rows - 2)
        column = np.minimum(x.astype(np.int64), layout.columns - 2)
        fy, fx, u = y - row, x - column, self.undetected
        south = u[row, column] * (1.0 - fx) + u[row, column + 1] * fx
        north = u[row + 1, column] * (1.0 - fx) + u[row + 1, column + 1] * fx
        found = south * (1.0 - fy) + north * fy
        return np.where(self.near_area(north_m, east_m), found, 0.0)

    def points(self) -> tuple[Array, Array, Array]:
        """North and east (n,) of the cells, and the area in each in which no target was detected, m^2."""
        return self._north, self._east, self.undetected.ravel() * self.layout.cell_m**2

    def near_area(self, north_m: Array, east_m: Array) -> NDArray[np.bool_]:
        """Which places (n,) can be those of measurements of targets in the area."""
        layout, margin = self.layout, self._edge_m
        found: NDArray[np.bool_] = (north_m >= layout.south_m - margin) & (north_m <= layout.north_m + margin)
        found &= (east_m >= layout.west_m - margin) & (east_m <= layout.east_m + margin)
        return found

    @property
    def undetected_area_m2(self) -> float:
        """Integral of the map over the area."""
        return float(self.undetected.sum()) * self.layout.cell_m**2

    @property
    def area_m2(self) -> float:
        """The whole area."""
        return self.undetected.size * self.layout.cell_m**2
