"""The place to land at, of what a detector sees (PX4's landing target estimator, ArduPilot's AC_PrecLand)."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.flight.target_motion import TargetMotion

Array = NDArray[np.float64]

_SLOWEST_M_S2: Final = 0.05
ACQUIRED_S: Final = 2.0
"""Not seen for this long: out of sight (PX4 LTEST, ArduPilot LANDING_TARGET_TIMEOUT_MS)."""


class LandingTargetTrack:
    """Its place in local NED.

    Attributes:
        motion: the filter behind it.
    """

    __slots__ = ("_still", "motion")

    def __init__(self) -> None:
        self._still = True
        self.motion = TargetMotion(acceleration_m_s2=_SLOWEST_M_S2, still=True)

    def set_moving(self, moving: bool) -> None:
        """The target may move (LTEST_MODE 0, PLND_OPTIONS bit 0)."""
        if moving is self._still:
            self._still = not moving
            self.motion = TargetMotion(acceleration_m_s2=0.5 if moving else _SLOWEST_M_S2, still=not moving)

    def take(self, time_us: int, position_ned_m: Array, *, sigma_m: float) -> bool:
        """A sighting; False when it is refused."""
        return self.motion.take(time_us, position_ned_m, None, sigma_m=sigma_m)

    def age_s(self, time_us: int) -> float:
        """Since it was seen; infinite when it never was."""
        return self.motion.age_s(time_us)

    def place(self, time_us: int) -> tuple[float, float] | None:
        """(north, east) now; None while it is out of sight."""
        if self.motion.age_s(time_us) > ACQUIRED_S:
            return None
        known = self.motion.at(time_us)
        return None if known is None else (float(known[0][0]), float(known[0][1]))

    def velocity(self, time_us: int) -> tuple[float, float]:
        """(north, east) of its motion."""
        known = self.motion.at(time_us)
        return (0.0, 0.0) if known is None else (float(known[1][0]), float(known[1][1]))

    def forget(self) -> None:
        """Nothing is known of it."""
        self.motion.forget()
