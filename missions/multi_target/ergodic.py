"""A baseline: ergodic coverage of the targets that are still to be found. What is expected changes with each
scan (Miller, Silverman, MacIver and Murphey 2016, "Ergodic exploration of distributed information"), and what
was flown is forgotten with a time constant.
"""

import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from estimators.multi_target.search_belief import SearchBelief
from estimators.tracking.range_bearing import Viewpoint
from flightsim.foundation.geodetic_position import NorthEast
from missions.patterns.ergodic import ErgodicCoverage
from missions.search.area import Area

__all__ = ["ErgodicPlanner"]

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
        self._coverage = ErgodicCoverage(area.height_m, area.width_m, kept=_FORGOTTEN)

    def next_place(
        self, belief: SearchBelief, here: NorthEast, direction_rad: float | None, others: Sequence[Viewpoint]
    ) -> NorthEast:
        area = self._area
        for north_m, east_m in (here, *((view.north_m, view.east_m) for view in others)):
            self._coverage.visit(north_m - area.south_m, east_m - area.west_m)
        north, east, undetected_m2 = belief.exploration.points()
        detected = belief.points()
        expected = self._coverage.expected(
            np.concatenate((north, detected[0])) - area.south_m,
            np.concatenate((east, detected[1])) - area.west_m,
            np.concatenate((belief.parameters.birth_per_m2 * undetected_m2, detected[2])),
        )
        course = self._coverage.course_rad(here[0] - area.south_m, here[1] - area.west_m, expected)
        if direction_rad is not None:
            turn = math.remainder(course - direction_rad, math.tau)
            course = direction_rad + max(-self._turn_limit_rad, min(self._turn_limit_rad, turn))
        return area.nearest(
            here[0] + self._step_m * math.cos(course), here[1] + self._step_m * math.sin(course)
        )
