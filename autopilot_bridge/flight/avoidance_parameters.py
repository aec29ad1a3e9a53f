"""Parameters of the distance from obstacles: PX4's CP_*, ArduPilot's AVOID_*."""

import math
from dataclasses import dataclass

from flightsim.foundation.checks import check_fields, require_not_negative, require_positive


@dataclass(frozen=True, slots=True, kw_only=True)
class AvoidanceParameters:
    """Distance from obstacles.

    Attributes:
        enabled: for pilots (CP_DIST not negative; AVOID_ENABLE bit 1 with PRX1_TYPE).
        guided: for streamed velocities too (ArduPilot).
        margin_m: distance from obstacles (CP_DIST, AVOID_MARGIN).
        delay_s: of sensor and control (CP_DELAY).
        guard_rad: obstacles within this angle of the direction of flight count (PX4).
        go_without_data: fly also in directions without a sensor (CP_GO_NO_DATA; ArduPilot always).
        slide: along obstacles (AVOID_BEHAVE 0).
        timeout_s: older measurements are not used.
        deceleration_m_s2: deceleration of the stop (AVOID_ACCEL_MAX).
    """

    enabled: bool = False
    guided: bool = False
    margin_m: float = 2.0
    delay_s: float = 0.4
    guard_rad: float = math.radians(30.0)
    go_without_data: bool = True
    slide: bool = False
    timeout_s: float = 0.5
    deceleration_m_s2: float = 2.0

    def __post_init__(self) -> None:
        check_fields(self, require_not_negative, but={"deceleration_m_s2": require_positive})
