"""Turns of the heading: a commanded one, and the change of course at a waypoint."""

import math
from typing import Final

from flightsim.foundation.vectors import Vector, wrap_pi

_TURNED_RAD: Final = math.radians(1.0)
SAME_PLACE_M: Final = 0.1
"""Places closer than this horizontally are one place."""


class Turn:
    """A commanded turn with its direction and rate (CONDITION_YAW); afterwards the heading is held.

    Args:
        angle_rad: heading to turn to; with `relative` the angle to turn by.
        direction: positive clockwise, negative counter-clockwise, 0: the shorter way (relative: clockwise).
        rate_max_rad_s: None: the vehicle's own limit.
        relative: turn by the angle, not to it.
    """

    def __init__(
        self,
        angle_rad: float,
        *,
        direction: int = 0,
        rate_max_rad_s: float | None = None,
        relative: bool = False,
    ) -> None:
        self._angle_rad = angle_rad
        self._direction = direction
        self._relative = relative
        self._left_rad = math.nan
        self.rate_max_rad_s = rate_max_rad_s

    def left_rad(self, heading_rad: float) -> float:
        """The remaining angle of the turn from a heading, positive clockwise; fixed at the first call."""
        if math.isnan(self._left_rad):
            if self._relative:
                self._left_rad = math.copysign(self._angle_rad, -1.0 if self._direction < 0 else 1.0)
            else:
                self._left_rad = wrap_pi(self._angle_rad - heading_rad)
                if self._direction * self._left_rad < 0.0:
                    self._left_rad += math.copysign(2.0 * math.pi, self._direction)
        return self._left_rad

    def advance(self, turned_rad: float) -> None:
        """Record that the heading has turned by an angle."""
        self._left_rad -= turned_rad

    @property
    def done(self) -> bool:
        """The wanted heading is reached."""
        return abs(self._left_rad) < _TURNED_RAD


def turn_angle(before: Vector, corner: Vector, after: Vector) -> float:
    """Horizontal change of course at a corner, 0 (straight) to pi; 0 next to a vertical leg."""
    n1, e1 = corner[0] - before[0], corner[1] - before[1]
    n2, e2 = after[0] - corner[0], after[1] - corner[1]
    if math.hypot(n1, e1) < SAME_PLACE_M or math.hypot(n2, e2) < SAME_PLACE_M:
        return 0.0
    return abs(math.atan2(n1 * e2 - e1 * n2, n1 * n2 + e1 * e2))
