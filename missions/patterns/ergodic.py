"""Ergodic coverage: the share of time in each part of an area tends to the share that is expected there.

Source: Mathew and Mezic 2011, "Metrics for ergodicity and design of ergodic dynamics for multi-agent
systems", equations 4 to 22: spectral multiscale coverage with first-order dynamics.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from missions.errors import PlanError
from missions.patterns.polyline import Polyline

__all__ = ["ErgodicCoverage", "ergodic"]

Array = NDArray[np.float64]

_ORDER: Final = 12
"""Waves along each side."""
_UNEQUAL: Final = 1.2
_MOST_RAD: Final = 0.5 * math.pi
"""Turn between two legs: that of a square, for which the spacing of a vehicle's tracks is made."""


class ErgodicCoverage:
    """The difference of what was flown and what is expected, by the cosines of a rectangle.

    Args:
        height_m, width_m: sides, north and east.
        kept: share of a step's weight after one more step; 1: nothing is forgotten.
    """

    def __init__(self, height_m: float, width_m: float, *, kept: float = 1.0) -> None:
        orders = np.arange(_ORDER + 1)
        rows, columns = (axis.ravel() for axis in np.meshgrid(orders, orders, indexing="ij"))
        self._north = rows * math.pi / height_m
        self._east = columns * math.pi / width_m
        norm = np.where(rows > 0, math.sqrt(0.5), 1.0) * np.where(columns > 0, math.sqrt(0.5), 1.0)
        self._scale = 1.0 / norm
        # the norm of a Sobolev space of negative order: large scales first (equation 8)
        # the sides differ a little, or a start on a diagonal of a square would never leave it
        self._weight = (1.0 + rows**2 + _UNEQUAL * columns**2) ** -1.5
        self._flown = np.zeros(len(rows))
        self._total = 0.0
        self._kept = kept

    def expected(self, north_m: Array, east_m: Array, mass: Array) -> Array:
        """Coefficients of what is expected at places (n,) from the south-western corner."""
        # cosines of multiples by their product over both axes
        waves_n = np.cos(np.outer(np.unique(self._north), north_m))
        waves_e = np.cos(np.outer(np.unique(self._east), east_m))
        found: Array = self._scale * ((waves_n * mass) @ waves_e.T).ravel() / mass.sum()
        return found

    def uniform(self) -> Array:
        """Those of the same everywhere."""
        found = np.zeros(len(self._north))
        found[0] = 1.0
        return found

    def visit(self, north_m: float, east_m: float) -> None:
        """Count a step at a place from the south-western corner (equation 4)."""
        self._flown += self._scale * np.cos(self._north * north_m) * np.cos(self._east * east_m)
        self._total += 1.0

    def course_rad(self, north_m: float, east_m: float, expected: Array) -> float:
        """Course in which the difference falls most (equation 22), after which what was flown fades."""
        share = self._weight * (self._flown / self._total - expected)
        north, east = self._north, self._east
        slope_n = -share @ (self._scale * north * np.sin(north * north_m) * np.cos(east * east_m))
        slope_e = -share @ (self._scale * east * np.cos(north * north_m) * np.sin(east * east_m))
        self._flown *= self._kept
        self._total *= self._kept
        return math.atan2(-slope_e, -slope_n)


def ergodic(
    *, width_m: float, height_m: float, spacing_m: float, length_m: float, heading_rad: float = 0.0
) -> Polyline:
    """Ergodic coverage of a rectangle, from its middle: each part has an equal share of the time, first
    coarsely and later finely. The path stays half a spacing inside, except for single turns.

    Args:
        width_m, height_m: sides, east and north.
        spacing_m: length of a leg.
        length_m: of the whole pattern.
        heading_rad: of the first step.
    """
    for name, value in (("width", width_m), ("height", height_m), ("length", length_m)):
        if not (math.isfinite(value) and value > 0.0):
            raise PlanError(f"search area {name} {value:g} m leaves nothing to search; ask for more than 0 m")
    most_m = 0.5 * min(width_m, height_m)
    if not 0.0 < spacing_m <= most_m:
        raise PlanError(
            f"track spacing {spacing_m:g} m does not fit the area of {width_m:g} m by {height_m:g} m; "
            f"ask for more than 0 m and at most {most_m:g} m"
        )
    height_m, width_m = height_m - spacing_m, width_m - spacing_m
    coverage = ErgodicCoverage(height_m, width_m)
    expected = coverage.uniform()
    north, east, course = 0.5 * height_m, 0.5 * width_m, heading_rad
    vertices = [(0.0, 0.0)]
    for _ in range(max(1, math.ceil(length_m / spacing_m))):
        coverage.visit(north, east)
        if len(vertices) > 1:
            wanted = coverage.course_rad(north, east, expected)
            if not (0.0 <= north <= height_m and 0.0 <= east <= width_m):  # a turn led out: back
                wanted = math.atan2(0.5 * width_m - east, 0.5 * height_m - north)
            turn = math.remainder(wanted - course, math.tau)
            course += max(-_MOST_RAD, min(_MOST_RAD, turn))
        north, east = north + spacing_m * math.cos(course), east + spacing_m * math.sin(course)
        vertices.append((north - 0.5 * height_m, east - 0.5 * width_m))
    return Polyline(tuple(vertices))
