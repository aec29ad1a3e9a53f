"""Check of the heading with which a fixed wing was launched.

On the ground only the magnetometer measures the heading, and iron nearby can deflect it. If GPS velocities
are refused right after the launch while course and nose differ widely, it was deflected: the course is then
the better heading (PX4's EKF2 resets its yaw in the same case, from a separate estimator). Once GPS has
agreed with the heading in flight, a disagreement is an error of the receiver.
"""

import math
from typing import Final

_REFUSED_US: Final = 800_000
_CONFIRMED_US: Final = 10_000_000
_LEAST_ANGLE_RAD: Final = math.radians(15.0)  # less is drift in the wind, and is found by filtering


class HeadingCheck:
    """Watches GPS velocities from the launch until the heading is confirmed.

    Attributes:
        magnetometer_wrong: found so in this flight.
    """

    __slots__ = ("_confirmed", "_refused_since_us", "_since_us", "magnetometer_wrong")

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Before a launch."""
        self.magnetometer_wrong = False
        self._confirmed = False
        self._since_us = -1
        self._refused_since_us = -1

    def judge(self, time_us: int, *, accepted: bool, course_rad: float, yaw_rad: float) -> float:
        """A GPS velocity in fast flight was fused or refused; the angle to turn the heading by, or 0."""
        if self._confirmed:
            return 0.0
        if accepted:
            self._refused_since_us = -1
            if self._since_us < 0:
                self._since_us = time_us
            self._confirmed = time_us - self._since_us >= _CONFIRMED_US
            return 0.0
        self._since_us = -1
        if self._refused_since_us < 0:
            self._refused_since_us = time_us
        angle = math.remainder(course_rad - yaw_rad, 2.0 * math.pi)
        if time_us - self._refused_since_us < _REFUSED_US or abs(angle) < _LEAST_ANGLE_RAD:
            return 0.0
        self._refused_since_us = -1
        self.magnetometer_wrong = True
        return angle
