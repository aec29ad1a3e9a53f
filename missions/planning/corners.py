"""The path of an aircraft in a corner: it rolls into the turn, circles, and rolls out.

The curvature of the path rises linearly while the aircraft rolls in, so that bank and path agree (a
clothoid), stays at 1/R, and falls linearly again. A corner too small for the full curvature consists of the
two ramps only, with a smaller curvature.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from missions.patterns.curve import Array

_STEP_M: Final = 1.0
_LEAST_STEPS: Final = 64


@dataclass(frozen=True, slots=True, kw_only=True)
class Corner:
    """A turn to the right that begins at the origin, heading along the first axis.

    Attributes:
        reach_m: distance from the corner of the two legs to the begin of the turn, and equally to its end.
        arc_m: (n,) distance flown.
        points_m: (n, 2) coordinates along the first leg, and to its right.
        course_rad: (n,) change of course so far.
        curvature_per_m: (n,) curvature.
    """

    reach_m: float
    arc_m: Array
    points_m: Array
    course_rad: Array
    curvature_per_m: Array

    @classmethod
    def of(cls, turn_rad: float, radius_m: float, ramp_m: float) -> "Corner":
        """A corner.

        Args:
            turn_rad: change of course, more than 0 and less than pi.
            radius_m: tightest radius.
            ramp_m: distance over which the curvature rises from 0 to 1/R.
        """
        peak = 1.0 / radius_m
        ramp = ramp_m
        plateau = turn_rad * radius_m - ramp
        if plateau < 0.0:  # the same rate of roll, reversed at half the turn
            ramp = math.sqrt(turn_rad * radius_m * ramp_m)
            peak = turn_rad / ramp
            plateau = 0.0
        length = 2.0 * ramp + plateau
        count = max(_LEAST_STEPS, math.ceil(length / _STEP_M))
        arc = np.linspace(0.0, length, count + 1)
        rise = max(ramp, 1e-9)
        curvature = peak * np.clip(np.minimum(arc, length - arc) / rise, 0.0, 1.0)
        course = _turned(arc, peak, rise, plateau)
        # Simpson's rule on each step, because the course is also known between the points
        middle = _turned(0.5 * (arc[1:] + arc[:-1]), peak, rise, plateau)
        step = length / count / 6.0
        north = step * (np.cos(course[:-1]) + 4.0 * np.cos(middle) + np.cos(course[1:]))
        east = step * (np.sin(course[:-1]) + 4.0 * np.sin(middle) + np.sin(course[1:]))
        points = np.zeros((count + 1, 2))
        points[1:, 0], points[1:, 1] = np.cumsum(north), np.cumsum(east)
        return cls(
            reach_m=float(points[-1, 0]) / (1.0 + math.cos(turn_rad)),
            arc_m=arc,
            points_m=points,
            course_rad=course,
            curvature_per_m=curvature,
        )


def corner_reach_m(turn_rad: float, radius_m: float, ramp_m: float) -> float:
    """Length of each leg that a corner uses."""
    return Corner.of(turn_rad, radius_m, ramp_m).reach_m if turn_rad > 1e-6 else 0.0


def _turned(arc: Array, peak: float, ramp: float, plateau: float) -> Array:
    """Change of course after a distance."""
    rising = np.minimum(arc, ramp)
    level = np.clip(arc - ramp, 0.0, plateau)
    falling = np.clip(arc - ramp - plateau, 0.0, ramp)
    turned: Array = peak * (0.5 * rising**2 / ramp + level + falling - 0.5 * falling**2 / ramp)
    return turned
