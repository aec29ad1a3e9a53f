"""Limits and preferences of flight, in the common meaning of PX4 (MPC_*, RTL_*) and ArduPilot (WPNAV_*,
RTL_*).
"""

import math
from dataclasses import dataclass, field
from enum import IntEnum

from autopilot_bridge.flight.surroundings_parameters import (
    AvoidanceParameters,
    FollowParameters,
    Precision,
    PrecisionParameters,
)
from flightsim.foundation.checks import Finite, NotNegative, NotNegativeOrInf, Positive, PositiveOrInf, Share
from flightsim.foundation.options import Options


class ReturnDestination(IntEnum):
    """The possible targets of a return: PX4 RTL_TYPE | ArduPilot RTL_AUTOLAND. Rally points are
    `RallyRule`'s.
    """

    HOME = 0  # circle over home; land by `return_loiter_time_s` (RTL_TYPE 0)
    LANDING_SEQUENCE = 1  # straight to the plan's landing sequence (RTL_AUTOLAND 2)
    HOME_THEN_LANDING_SEQUENCE = 2  # over home first (RTL_AUTOLAND 1)
    CLOSEST = 3  # home or the landing sequence, whichever is closer (RTL_TYPE 3)
    ALONG_PLAN = 4  # along the plan to its landing, or back along it to home (RTL_TYPE 2)
    ALONG_PLAN_SHORTER = 5  # whichever way along the plan has fewer waypoints (RTL_TYPE 4)
    LANDING_OR_RALLY = 6  # the landing sequence or a rally point, home only without either (RTL_TYPE 1)


ALONG_PLAN = (ReturnDestination.ALONG_PLAN, ReturnDestination.ALONG_PLAN_SHORTER)


@dataclass(frozen=True, slots=True, kw_only=True)
class RallyRule:
    """Which rally points a return considers.

    Attributes:
        used: rally points are considered at all.
        home_competes: home is used when it is closer (PX4 RTL_TYPE 0 and 3 | RALLY_INCL_HOME).
        limit_m: points farther away are not used (RALLY_LIMIT_KM); infinite: no limit.
        within_fence: only those inside the geofence (ArduCopter).
        altitude_is_ground: a point's altitude is that of its ground, and the return's heights are over it
            (PX4); else it is the return altitude (ArduPilot).
    """

    used: bool = True
    home_competes: bool = True
    limit_m: float = math.inf
    within_fence: bool = False
    altitude_is_ground: bool = True

    def __post_init__(self) -> None:
        if not self.limit_m > 0.0:
            raise ValueError(f"limit_m = {self.limit_m} is not positive")


class YawBehaviour(IntEnum):
    """Where the nose points on the way without a commanded yaw (MPC_YAW_MODE | WP_YAW_BEHAVIOR)."""

    KEEP = 0
    TOWARDS_TARGET = 1
    ALONG_TRACK = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightParameters(Options):
    """Parameters of every flight task. PX4's and ArduPilot's names stand beside each field.

    Raises:
        ValueError: a field is not finite, or not positive where it must be.
    """

    cruise_speed_m_s: Positive = 5.0  # MPC_XY_CRUISE | WPNAV_SPEED
    max_speed_m_s: Positive = 12.0  # MPC_XY_VEL_MAX | WPNAV_SPEED
    climb_speed_m_s: Positive = 3.0  # MPC_Z_V_AUTO_UP | WPNAV_SPEED_UP
    descend_speed_m_s: Positive = 1.5  # MPC_Z_V_AUTO_DN | WPNAV_SPEED_DN
    acceleration_m_s2: Positive = 3.0  # MPC_ACC_HOR | WPNAV_ACCEL
    corner_acceleration_m_s2: Positive = 2.5  # lateral, in mission corners | WPNAV_ACCEL_C
    acceleration_up_m_s2: Positive = 4.0  # MPC_ACC_UP_MAX | WPNAV_ACCEL_Z
    acceleration_down_m_s2: Positive = 3.0  # MPC_ACC_DOWN_MAX | WPNAV_ACCEL_Z
    jerk_m_s3: Positive = 4.0  # MPC_JERK_AUTO | PSC_JERK_XY
    trajectory_p_1_s: Positive = 1.0  # MPC_XY_TRAJ_P: cross-track and end-of-leg gain
    trajectory_error_max_m: Positive = 2.0  # MPC_XY_ERR_MAX: the trajectory waits for a vehicle so far behind
    yaw_rate_max_rad_s: Positive = math.radians(45.0)  # MPC_YAWRAUTO_MAX | ATC_SLEW_YAW
    yaw_acceleration_rad_s2: Positive = math.radians(60.0)  # MPC_YAWRAUTO_ACC
    yaw_behaviour: YawBehaviour = YawBehaviour.TOWARDS_TARGET  # MPC_YAW_MODE | WP_YAW_BEHAVIOR
    acceptance_radius_m: Positive = 2.0  # NAV_ACC_RAD | WPNAV_RADIUS
    acceptance_altitude_m: Positive = 0.8  # NAV_MC_ALT_RAD
    nose_follows_roi: bool = True  # MIS_MNT_YAW_CTL 0 | MNT1_TYPE 0: no gimbal that turns by itself
    use_waypoint_yaw: bool = True  # param4 of mission items turns the nose (PX4); ArduPilot ignores it

    takeoff_altitude_m: Positive = 2.5  # MIS_TAKEOFF_ALT
    takeoff_speed_m_s: Positive = 1.5  # MPC_TKO_SPEED | WPNAV_SPEED_UP
    takeoff_ramp_time_s: NotNegative = 3.0  # MPC_TKO_RAMP_T | TKOFF_SLEW_TIME
    spoolup_time_s: NotNegative = 1.0  # COM_SPOOLUP_TIME | MOT_SPOOL_TIME

    land_speed_m_s: Positive = 0.7  # MPC_LAND_SPEED | LAND_SPEED
    land_descend_speed_m_s: Positive = 1.5  # MPC_Z_V_AUTO_DN | LAND_SPEED_HIGH or WPNAV_SPEED_DN
    land_slow_altitude_m: Positive = 5.0  # MPC_LAND_ALT2 | LAND_ALT_LOW: at and below, land_speed
    land_fast_altitude_m: Positive = 10.0  # MPC_LAND_ALT1 | LAND_ALT_LOW: at and above, land_descend_speed

    return_altitude_m: Positive = 30.0  # RTL_RETURN_ALT | RTL_ALT, above home
    return_descend_altitude_m: NotNegative = 10.0  # RTL_DESCEND_ALT | RTL_ALT_FINAL, above home
    return_loiter_time_s: Finite = 0.0  # RTL_LAND_DELAY | RTL_LOIT_TIME; negative (PX4 -1): hold, don't land
    return_stops: bool = False  # ArduPilot stops after the climb, over home and before the landing
    return_loiters_high: bool = False  # ArduPilot waits before it descends, PX4 at the descend altitude
    return_speed_m_s: Positive = 5.0  # MPC_XY_CRUISE | RTL_SPEED
    return_cone_half_angle_rad: NotNegative = math.radians(
        45.0
    )  # RTL_CONE_ANG; ArduPilot: atan(1/RTL_CONE_SLOPE); 0: off
    return_min_distance_m: NotNegativeOrInf = (
        10.0  # RTL_MIN_DIST: the cone rule works within this range; inf: everywhere
    )
    return_climb_min_m: NotNegative = 0.0  # RTL_CLIMB_MIN
    return_height_max_m: PositiveOrInf = math.inf  # no higher over home; ArduPilot: under FENCE_ALT_MAX
    return_stays_at_m: NotNegative = 0.0  # hovers there at the end; 0: lands | RTL_ALT_FINAL
    return_destination: ReturnDestination = ReturnDestination.HOME  # RTL_TYPE
    rally: RallyRule = field(default_factory=RallyRule)  # RTL_TYPE | RALLY_*

    orbit_radius_m: Positive = 20.0  # default of DO_ORBIT | CIRCLE_RADIUS
    orbit_speed_m_s: Positive = 3.0  # default of DO_ORBIT | CIRCLE_RATE
    orbit_acceleration_max_m_s2: Positive = 2.0

    manual_speed_m_s: Positive = 10.0  # MPC_VEL_MANUAL | LOIT_SPEED
    manual_climb_speed_m_s: Positive = 3.0  # MPC_Z_VEL_MAX_UP | PILOT_SPEED_UP
    manual_descend_speed_m_s: Positive = 1.5  # MPC_Z_VEL_MAX_DN | PILOT_SPEED_DN
    manual_tilt_rad: Positive = math.radians(35.0)  # MPC_MAN_TILT_MAX | ANGLE_MAX
    manual_yaw_rate_rad_s: Positive = math.radians(150.0)  # MPC_MAN_Y_MAX | PILOT_Y_RATE
    acro_rate_rad_s: Positive = math.radians(100.0)  # MC_ACRO_R_MAX, MC_ACRO_P_MAX | ACRO_RP_RATE
    acro_yaw_rate_rad_s: Positive = math.radians(100.0)  # MC_ACRO_Y_MAX | ACRO_Y_RATE
    manual_throttle_min: Positive = 0.08  # MPC_MANTHR_MIN
    manual_deadzone: NotNegative = 0.1  # MPC_HOLD_DZ
    manual_expo: Share = 0.6  # MPC_XY_MAN_EXPO

    guided_timeout_s: Positive = 3.0  # GUID_TIMEOUT

    return_precision: Precision = Precision.NONE  # RTL_PLD_MD
    follow: FollowParameters = field(default_factory=FollowParameters)  # FLW_TGT_* | FOLL_*
    precision: PrecisionParameters = field(default_factory=PrecisionParameters)  # PLD_* | PLND_*
    avoidance: AvoidanceParameters = field(default_factory=AvoidanceParameters)  # CP_* | AVOID_*

    def check_together(self) -> None:
        if self.land_fast_altitude_m < self.land_slow_altitude_m:
            raise ValueError(
                f"land_fast_altitude_m = {self.land_fast_altitude_m} is below "
                f"land_slow_altitude_m = {self.land_slow_altitude_m}"
            )
        if self.manual_deadzone >= 1.0:
            raise ValueError(f"manual_deadzone = {self.manual_deadzone} is not in 0..1 (1 excluded)")
        if self.return_cone_half_angle_rad > math.pi / 2.0:
            raise ValueError(
                f"return_cone_half_angle_rad = {self.return_cone_half_angle_rad} is not in 0..pi/2"
            )
