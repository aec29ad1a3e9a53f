"""The baseline of a search by steps: places along the legs of a parallel sweep."""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from flightsim.foundation.geodetic_position import NorthEast
from missions.patterns.iamsar import parallel_sweep
from missions.patterns.polyline import Polyline
from missions.search.area import Area

_LEAST_LEGS: Final = 2
_MOST_LEGS: Final = 200


def sweep_path(area: Area, start: NorthEast, length_m: float, spacing_m: float | None) -> Polyline:
    """A parallel sweep of the area that begins at the corner nearest to a place.

    Args:
        length_m: length of the flight, with the way to its beginning.
        spacing_m: track spacing; None: the smallest with which one pass is not longer than the flight.
    """

    def made(spacing: float) -> list[NorthEast]:
        north_m, east_m = area.centre_ne_m
        path = parallel_sweep(width_m=area.width_m, height_m=area.height_m, spacing_m=spacing)
        forth = [(north_m + n, east_m + e) for n, e in path.vertices_m]
        turned = [(2.0 * north_m - n, e) for n, e in forth]
        return min(
            (forth, forth[::-1], turned, turned[::-1]), key=lambda vertices: math.dist(vertices[0], start)
        )

    if spacing_m is not None:
        return Polyline(tuple(made(spacing_m)))
    short_m = min(area.height_m, area.width_m)
    found = made(short_m / _LEAST_LEGS)
    for legs in range(_LEAST_LEGS + 1, _MOST_LEGS):
        vertices = made(short_m / legs)
        if math.dist(start, vertices[0]) + Polyline(tuple(vertices)).length_m > length_m:
            break
        found = vertices
    return Polyline(tuple(found))


class SweepPlanner:
    """The baseline: places along a path, one step apart, whatever is detected. After its end the path is
    flown back.

    Args:
        path: from the origin.
        step_m: distance between places.
    """

    def __init__(self, path: Polyline, step_m: float) -> None:
        vertices = np.asarray(path.vertices_m)
        along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(vertices, axis=0).T))))
        at = np.arange(0.0, along[-1] + 1e-9, step_m)
        north, east = (np.interp(at, along, vertices[:, axis]) for axis in (0, 1))
        forth = list(zip(north.tolist(), east.tolist(), strict=True))
        self._places = forth + forth[-2:0:-1]
        self._step_m = step_m
        self._next = 0

    def next_place(
        self, belief: SearchBelief, here: NorthEast, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> NorthEast:
        return self.along(here)

    def along(self, here: NorthEast) -> NorthEast:
        """The next place from a place."""
        target = self._places[self._next % len(self._places)]
        away_m = math.dist(here, target)
        if away_m > 1.5 * self._step_m:  # the way to the path, in steps too
            share = self._step_m / away_m
            return here[0] + share * (target[0] - here[0]), here[1] + share * (target[1] - here[1])
        self._next += 1
        return target
