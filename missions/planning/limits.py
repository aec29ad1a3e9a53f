"""What a vehicle can do, as a planner needs it, and refusing what it can't."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Final

from missions.errors import PlanError


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleLimits:
    """Limits of a multicopter for planning.

    Attributes:
        speed_m_s: largest ground speed (PX4 MPC_XY_VEL_MAX 12; ArduCopter WPNAV_SPEED 10).
        acceleration_m_s2: largest horizontal acceleration (PX4 MPC_ACC_HOR 3; ArduCopter WPNAV_ACCEL 2.5).
        yaw_rate_rad_s: how fast the nose may turn (PX4 MPC_YAWRAUTO_MAX 60 deg/s).
        smoothing_s: time over which an acceleration builds up; jerk stays below 2 acceleration / smoothing.
        altitude_min_m, altitude_max_m: above home. 120 m is the ceiling of the open category (EU 2019/947).
        reach_m: farthest from home a pattern may go.
    """

    speed_m_s: float = 12.0
    acceleration_m_s2: float = 3.0
    yaw_rate_rad_s: float = math.radians(60.0)
    smoothing_s: float = 0.8
    altitude_min_m: float = 1.5
    altitude_max_m: float = 120.0
    reach_m: float = 5000.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0.0):
                raise PlanError(
                    f"vehicle limit {field.name} = {value} is not possible; it must be more than 0"
                )

    @property
    def lateral_m_s2(self) -> float:
        """Share of the acceleration for turning; with `tangential_m_s2` at once it makes the whole
        (0.8, 0.6, 1).
        """
        return 0.8 * self.acceleration_m_s2

    @property
    def tangential_m_s2(self) -> float:
        """Share of the acceleration for gaining and losing speed."""
        return 0.6 * self.acceleration_m_s2

    def check_speed(self, speed_m_s: float) -> None:
        """Refuse a ground speed the vehicle can't fly."""
        if not (math.isfinite(speed_m_s) and 0.0 < speed_m_s <= self.speed_m_s):
            raise PlanError(
                f"speed {speed_m_s:g} m/s is not in 0..{self.speed_m_s:g} m/s, the vehicle's range; "
                "change --speed"
            )

    def check_altitude(self, altitude_m: float) -> None:
        """Refuse an altitude above home outside the limits."""
        if not self.altitude_min_m <= altitude_m <= self.altitude_max_m:
            raise PlanError(
                f"altitude {altitude_m:g} m is not in {self.altitude_min_m:g}..{self.altitude_max_m:g} m "
                "above home; change --altitude"
            )

    def check_reach(self, distance_m: float) -> None:
        """Refuse a pattern that leads too far from home."""
        if not distance_m <= self.reach_m:
            raise PlanError(
                f"the pattern reaches {distance_m:.0f} m from home, more than {self.reach_m:g} m; "
                "make it smaller"
            )


WIDEST_LIMITS: Final = VehicleLimits(speed_m_s=20.0, acceleration_m_s2=5.0)
"""What is refused for any vehicle; a vehicle's own limits are read from it later."""

DEFAULT_LIMITS: Final[Mapping[str, VehicleLimits]] = MappingProxyType(
    {
        "px4": VehicleLimits(speed_m_s=12.0, acceleration_m_s2=3.0),
        "ardupilot": VehicleLimits(speed_m_s=10.0, acceleration_m_s2=2.5),
    }
)
"""By firmware, with its default parameters: MPC_XY_VEL_MAX and MPC_ACC_HOR; WPNAV_SPEED and WPNAV_ACCEL."""
