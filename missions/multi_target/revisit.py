"""A baseline: a sweep that leaves its path for what it detects, and returns to where it left."""

import math
from collections.abc import Sequence
from typing import Final

from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from flightsim.foundation.geodetic_position import NorthEast
from missions.patterns.polyline import Polyline
from missions.search.sweep import SweepPlanner

__all__ = ["RevisitPlanner"]

_NEAR: Final = 6.0
"""A detour goes to detected targets within so many steps of the vehicle; the next leg passes the others."""
_TRIES: Final = 4
"""Scans from the place of a target after which it is left: they find a target, or show that there is none."""


class RevisitPlanner:
    """Goes to the nearest target that is detected and not found, until it is found or was not detected again;
    without one, along the sweep.

    Args:
        path: of the sweep, from the origin.
        step_m: distance between places.
    """

    def __init__(self, path: Polyline, step_m: float) -> None:
        self._sweep = SweepPlanner(path, step_m)
        self._step_m = step_m
        self._looked: list[NorthEast] = []

    def next_place(
        self, belief: SearchBelief, here: NorthEast, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> NorthEast:
        detected = [(cluster.north_m, cluster.east_m) for cluster in belief.candidates]
        near = [place for place in detected if math.dist(here, place) <= _NEAR * self._step_m]
        near = [place for place in near if self._visits(place) < _TRIES]
        if not near:
            return self._sweep.along(here)
        target = min(near, key=lambda place: math.dist(here, place))
        away_m = math.dist(here, target)
        if away_m <= self._step_m:
            self._looked.append(target)
            return target
        share = self._step_m / away_m
        return here[0] + share * (target[0] - here[0]), here[1] + share * (target[1] - here[1])

    def _visits(self, place: NorthEast) -> int:
        """Number of scans that were taken at a place."""
        return sum(math.dist(place, looked) <= 0.5 * self._step_m for looked in self._looked)
