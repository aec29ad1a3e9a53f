"""What other systems report of the surroundings: the target to follow, the landing target, obstacles.

The landing place is estimated as in PX4's landing target estimator and ArduPilot's AC_PrecLand."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.flight.obstacles import ObstacleMap
from autopilot_bridge.flight.target_motion import TargetMotion

Array = NDArray[np.float64]

_SLOWEST_M_S2: Final = 0.05
ACQUIRED_S: Final = 2.0
"""A target not seen for this time is lost (PX4 LTEST, ArduPilot LANDING_TARGET_TIMEOUT_MS)."""


class LandingTargetTrack:
    """The position of the target in local NED; the target is assumed not to move.

    Attributes:
        motion: the filter of the position.
    """

    def __init__(self) -> None:
        self.motion = TargetMotion(acceleration_m_s2=_SLOWEST_M_S2, still=True)

    def take(self, time_us: int, position_ned_m: Array, *, sigma_m: float) -> bool:
        """Add a measurement; False when it is refused."""
        return self.motion.take(time_us, position_ned_m, None, sigma_m=sigma_m)

    def age_s(self, time_us: int) -> float:
        """Time since the last measurement; infinite when there was none."""
        return self.motion.age_s(time_us)

    def place(self, time_us: int) -> tuple[float, float] | None:
        """(north, east) now; None while the target is lost."""
        if self.motion.age_s(time_us) > ACQUIRED_S:
            return None
        known = self.motion.at(time_us)
        return None if known is None else (float(known[0][0]), float(known[0][1]))

    def forget(self) -> None:
        """Forget the target."""
        self.motion.forget()


class Surroundings:
    """Updated by the services that receive the messages, read by flight tasks.

    Attributes:
        leader: the target to follow.
        landing_target: the place to land at.
        obstacles: distances around the vehicle.
    """

    def __init__(self) -> None:
        self.leader = TargetMotion()
        self.landing_target = LandingTargetTrack()
        self.obstacles = ObstacleMap()
