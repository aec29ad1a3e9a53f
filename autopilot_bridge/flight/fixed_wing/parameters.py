"""Limits and rules of fixed-wing flight, in the meaning PX4 (FW_*, NPFG_*, RTL_*) and ArduPlane share."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Final, Self

from autopilot_bridge.control.fixed_wing.gains import gains_for
from autopilot_bridge.flight.fixed_wing.landing_parameters import (
    ClimbOutParameters,
    FlareParameters,
    LandingParameters,
    SurfaceWindParameters,
)
from autopilot_bridge.flight.parameters import RallyRule, ReturnDestination
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.checks import Finite, NotNegative, NotNegativeOrInf, Positive, PositiveOrInf, Share
from flightsim.foundation.options import Options

if TYPE_CHECKING:  # its module brings scipy
    from flightsim.flight_envelope import FlightEnvelope

_PERIODS: Final = 2.5  # of the guidance over the time of a turn through a radian and of a bank's reversal


_FLARE_NOSE_DOWN_RAD: Final = math.radians(3.5)  # in the flare, under the pitch of the approach


class LaunchKind(IntEnum):
    """How the aircraft comes into the air: PX4 RWTO_TKOFF and FW_LAUN_DETCN_ON | TKOFF_THR_MINACC."""

    RUNWAY = 0
    CATAPULT = 1
    HAND = 2


class TurnInRule(IntEnum):
    """How far before a waypoint the turn to the next leg begins."""

    SWITCH_DISTANCE = 0  # PX4: the larger of NAV_ACC_RAD and the guidance's switch distance
    TURN_ANGLE = 1  # ArduPilot: WP_RADIUS, less for turns below 90 degrees


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedWingFlightParameters(Options):
    """Parameters of every fixed-wing flight task. PX4's and ArduPilot's names stand beside each field.

    Airspeeds are equivalent airspeeds. Heights are above home, or above the ground where they say so.

    Raises:
        ValueError: a field is not finite, not positive where it must be, or contradicts another.
    """

    airspeed_min_m_s: Positive = 18.0  # FW_AIRSPD_MIN | AIRSPEED_MIN
    airspeed_trim_m_s: Positive = 25.0  # FW_AIRSPD_TRIM | AIRSPEED_CRUISE
    airspeed_max_m_s: Positive = 35.0  # FW_AIRSPD_MAX | AIRSPEED_MAX
    climb_rate_m_s: Positive = 3.0  # wanted climbs: FW_T_CLMB_R_SP | FBWB_CLIMB_RATE
    sink_rate_m_s: Positive = 2.0  # wanted descents: FW_T_SINK_R_SP | FBWB_CLIMB_RATE
    climb_max_m_s: NotNegative = 5.0  # FW_T_CLMB_MAX | TECS_CLMB_MAX
    sink_max_m_s: Positive = 5.0  # FW_T_SINK_MAX | TECS_SINK_MAX
    bank_max_rad: Positive = math.radians(45.0)  # FW_R_LIM | ROLL_LIMIT_DEG
    pitch_max_rad: Positive = math.radians(25.0)  # FW_P_LIM_MAX | PTCH_LIM_MAX_DEG
    pitch_min_rad: Finite = math.radians(-20.0)  # FW_P_LIM_MIN | PTCH_LIM_MIN_DEG
    trim_pitch_rad: Finite = math.radians(3.0)  # FW_PSP_OFF | PTCH_TRIM_DEG: flown when the height is lost
    trim_throttle: Share = 0.5  # FW_THR_TRIM | TRIM_THROTTLE
    throttle_idle: Share = 0.0  # FW_THR_IDLE | THR_MIN

    guidance_period_s: Positive = 10.0  # NPFG_PERIOD | NAVL1_PERIOD
    guidance_damping: Positive = 0.7  # NPFG_DAMPING | NAVL1_DAMPING
    guidance_period_safety: Positive = 1.5  # NPFG_PERIOD_SF
    guidance_period_lower_bound: bool = True  # NPFG_LB_PERIOD
    guidance_period_upper_bound: bool = True  # NPFG_UB_PERIOD
    roll_time_constant_s: Positive = 0.5  # NPFG_ROLL_TC | RLL2SRV_TCONST
    switch_distance_multiplier: Positive = 0.32  # NPFG_SW_DST_MLT

    acceptance_radius_m: Positive = 20.0  # NAV_ACC_RAD | WP_RADIUS
    acceptance_altitude_m: PositiveOrInf = 10.0  # NAV_FW_ALT_RAD; ArduPilot: infinite
    turn_in: TurnInRule = TurnInRule.SWITCH_DISTANCE
    loiter_exits_aligned: bool = False  # every loiter item ends towards the next waypoint (ArduPilot)
    loiter_radius_m: Finite = 80.0  # NAV_LOITER_RAD | WP_LOITER_RAD; negative: counter-clockwise

    launch: LaunchKind = LaunchKind.RUNWAY
    takeoff_altitude_m: Positive = 30.0  # MIS_TAKEOFF_ALT | TKOFF_ALT
    takeoff_straight: bool = False  # ArduPilot climbs straight out, whatever the place of the item
    takeoff_airspeed_m_s: Positive = 25.0  # FW_TKO_AIRSPD | TECS' climb speed: AIRSPEED_CRUISE
    takeoff_pitch_min_rad: Positive = math.radians(8.0)  # FW_TKO_PITCH_MIN | TKOFF_LVL_PITCH
    takeoff_clearance_m: Positive = 15.0  # straight and nearly level wings below: RWTO_ | TKOFF_LVL_ALT
    takeoff_bank_max_rad: Positive = math.radians(15.0)  # in the climb-out | LEVEL_ROLL_LIMIT
    takeoff_throttle_max: Positive = 1.0  # RWTO_MAX_THR | TKOFF_THR_MAX
    takeoff_throttle_ramp_s: NotNegative = 2.0  # RWTO_RAMP_TIME | TKOFF_THR_SLEW
    takeoff_roll_pitch_rad: Finite = 0.0  # RWTO_PSP: on the runway | TKOFF_GND_PITCH
    rotation_airspeed_m_s: Positive = 20.0  # RWTO_ROT_AIRSPD | TKOFF_ROTATE_SPD
    rotation_time_s: Positive = 1.0  # RWTO_ROT_TIME
    launch_acceleration_m_s2: NotNegative = 15.0  # FW_LAUN_AC_THLD | TKOFF_THR_MINACC
    launch_time_s: NotNegative = 0.05  # FW_LAUN_AC_T: so long
    launch_speed_min_m_s: NotNegative = 0.0  # TKOFF_THR_MINSPD: over ground, too; 0: off
    launch_delay_s: NotNegative = 0.2  # FW_LAUN_MOT_DEL | TKOFF_THR_DELAY: motor off after the launch

    landing_angle_rad: Positive = math.radians(5.0)  # FW_LND_ANG: glide slope without an approach leg
    landing_angle_max_rad: Positive = math.radians(10.0)  # steepest slope flown to meet the place
    landing_airspeed_m_s: Positive = 21.0  # FW_LND_AIRSPD | TECS_LAND_ARSPD
    landing_loiter_altitude_m: Positive = 40.0  # where a landing without an approach begins its slope
    flare_height_m: Positive = 1.5  # above ground, at least: FW_LND_FLALT | LAND_FLARE_ALT
    flare_time_s: Positive = 2.0  # before the ground at the present sink: FW_LND_FL_TIME | LAND_FLARE_SEC
    flare_sink_m_s: Positive = 0.6  # FW_LND_FL_SINK | TECS_LAND_SINK
    flare_pitch_min_rad: Finite = math.radians(1.0)  # FW_LND_FL_PMIN | LAND_PITCH_DEG
    flare_pitch_max_rad: Positive = math.radians(12.0)  # FW_LND_FL_PMAX | LAND_PITCH_DEG
    ground_bank_max_rad: Positive = math.radians(
        5.0
    )  # wing tips free near the ground: FW_WING_* | LEVEL_ROLL_LIMIT
    rangefinder_landing: bool = True  # FW_LND_USETER | RNGFND_LANDING
    pitch_time_constant_s: Positive = 0.25  # FW_P_TC | PTCH2SRV_TCONST: of the flare's haste
    standing_height_m: NotNegative = 0.3  # of the rangefinder on the ground: EKF2_MIN_RNG | RNGFND1_GNDCLR
    landing_abort_climb_m: NotNegative = 30.0  # go-around: straight up to so much above home | LAND_ABORT_DEG
    flaps_takeoff: Share = 0.0  # FW_FLAPS_TO_SCL | TKOFF_FLAP_PCNT
    flaps_landing: Share = 0.0  # FW_FLAPS_LND_SCL | LAND_FLAP_PERCNT
    brake: Share = 0.5  # in the roll-out
    climb_out: ClimbOutParameters = field(default_factory=ClimbOutParameters)
    landing: LandingParameters = field(default_factory=LandingParameters)
    flare: FlareParameters = field(default_factory=FlareParameters)
    surface_wind: SurfaceWindParameters = field(default_factory=SurfaceWindParameters)

    return_altitude_m: Positive = 60.0  # RTL_RETURN_ALT | RTL_ALTITUDE
    return_descend_altitude_m: PositiveOrInf = 60.0  # RTL_DESCEND_ALT; ArduPilot: RTL_ALTITUDE, or infinite
    return_climbs: bool = True  # PX4 climbs and never descends on the way; ArduPilot flies at the altitude
    glide_slope_min_m: PositiveOrInf = math.inf  # GLIDE_SLOPE_MIN: from so high above the target a slope
    return_climb_min_m: NotNegative = 0.0  # RTL_CLIMB_MIN
    return_loiter_time_s: Finite = -1.0  # RTL_LAND_DELAY; negative: for ever
    return_loiter_radius_m: Finite = 80.0  # RTL_LOITER_RAD | RTL_RADIUS; negative: counter-clockwise
    return_destination: ReturnDestination = ReturnDestination.HOME  # RTL_TYPE | RTL_AUTOLAND
    rally: RallyRule = field(default_factory=RallyRule)  # RTL_TYPE | RALLY_*

    manual_bank_max_rad: Positive = math.radians(45.0)  # FW_MAN_R_MAX | ROLL_LIMIT_DEG
    manual_pitch_max_rad: Positive = math.radians(30.0)  # FW_MAN_P_MAX | PTCH_LIM_MAX_DEG
    manual_pitch_down_max_rad: Positive = math.radians(30.0)  # FW_MAN_P_MAX | PTCH_LIM_MIN_DEG
    acro_roll_rate_rad_s: Positive = math.radians(90.0)  # FW_ACRO_X_MAX | ACRO_ROLL_RATE
    acro_pitch_rate_rad_s: Positive = math.radians(90.0)  # FW_ACRO_Y_MAX | ACRO_PITCH_RATE
    acro_yaw_rate_rad_s: Positive = math.radians(45.0)  # FW_ACRO_Z_MAX | ACRO_YAW_RATE
    manual_deadzone: NotNegative = 0.06
    manual_expo: Share = 0.0

    guided_timeout_s: Positive = 3.0  # ArduPlane: attitudes in GUIDED
    position_lost_bank_rad: Positive = math.radians(15.0)  # FW_GPSF_R
    position_lost_wait_s: NotNegativeOrInf = 30.0  # FW_GPSF_LT: then it descends; ArduPilot: infinite
    position_lost_sink_m_s: Positive = 1.5

    @classmethod
    def for_envelope(cls, envelope: FlightEnvelope, **changes: Any) -> Self:
        """Parameters for any aircraft, from what it can do; `changes` are fields that shall differ."""
        e = envelope
        landing = max(1.35 * e.stall_speed_m_s, 1.2 * e.airspeed_min_m_s)
        approach = min(landing, e.airspeed_trim_m_s)
        gains = gains_for(e)
        bank = min(e.bank_max_rad, math.radians(45.0))
        # a circle flown at two thirds of the bank limit's turn rate leaves room for wind
        radius = e.airspeed_trim_m_s**2 / (GRAVITY_M_S2 * math.tan(0.6 * bank))
        climb = max(0.3, 0.6 * e.climb_max_m_s)
        # the guidance commands no turn faster than the aircraft can roll into and fly: else it swings to and
        # fro between its bank limits
        turn_s = e.airspeed_trim_m_s / (GRAVITY_M_S2 * math.tan(bank))
        reversal_s = 2.0 * bank / float(gains["roll_slew_rad_s"])
        # at a flare's lowest pitch it must come down: a nose that is held too high floats on and on
        slower = (e.airspeed_trim_m_s / approach) ** 2 - 1.0
        approach_pitch = e.trim_pitch_rad + float(gains["lift_angle_rad"]) * slower
        climb_pitch = e.trim_pitch_rad + math.atan2(max(0.0, e.climb_max_m_s), e.airspeed_trim_m_s)
        values: dict[str, Any] = {
            "airspeed_min_m_s": e.airspeed_min_m_s,
            "airspeed_trim_m_s": e.airspeed_trim_m_s,
            "airspeed_max_m_s": e.airspeed_max_m_s,
            "climb_rate_m_s": min(3.0, climb),
            "sink_rate_m_s": min(2.5, max(0.8 * e.sink_min_m_s, 0.5)),
            "climb_max_m_s": max(0.0, e.climb_max_m_s),
            "sink_max_m_s": e.sink_max_m_s,
            "bank_max_rad": bank,
            "pitch_min_rad": e.pitch_min_rad,
            "pitch_max_rad": e.pitch_max_rad,
            "trim_pitch_rad": e.trim_pitch_rad,
            "trim_throttle": e.trim_throttle,
            "guidance_period_s": max(10.0, _PERIODS * (turn_s + reversal_s)),
            "manual_bank_max_rad": bank,
            "manual_pitch_max_rad": e.pitch_max_rad,
            "manual_pitch_down_max_rad": -e.pitch_min_rad,
            "takeoff_pitch_min_rad": min(math.radians(10.0), max(math.radians(2.0), 0.6 * climb_pitch)),
            "takeoff_airspeed_m_s": e.airspeed_trim_m_s,
            "rotation_airspeed_m_s": max(1.15 * e.stall_speed_m_s, 0.9 * e.airspeed_min_m_s),
            "landing_airspeed_m_s": approach,
            "flare_pitch_min_rad": min(math.radians(1.0), approach_pitch - _FLARE_NOSE_DOWN_RAD),
            "pitch_time_constant_s": float(gains["pitch_time_constant_s"]),
            "standing_height_m": e.standing_height_m,
            "loiter_radius_m": max(40.0, radius),
            "return_loiter_radius_m": max(40.0, radius),
        }
        values.update(changes)
        return cls(**values)

    def check_together(self) -> None:
        if not self.airspeed_min_m_s <= self.airspeed_trim_m_s <= self.airspeed_max_m_s:
            raise ValueError(
                f"airspeed_trim_m_s = {self.airspeed_trim_m_s} is not between airspeed_min_m_s = "
                f"{self.airspeed_min_m_s} and airspeed_max_m_s = {self.airspeed_max_m_s}"
            )
        if not self.pitch_min_rad < self.pitch_max_rad:
            raise ValueError(
                f"pitch_min_rad = {self.pitch_min_rad} is not below pitch_max_rad = {self.pitch_max_rad}"
            )
        if self.landing_angle_max_rad < self.landing_angle_rad:
            raise ValueError(
                f"landing_angle_max_rad = {self.landing_angle_max_rad} is below "
                f"landing_angle_rad = {self.landing_angle_rad}"
            )
        if self.takeoff_throttle_max > 1.0:
            raise ValueError(f"takeoff_throttle_max = {self.takeoff_throttle_max} is not in 0..1")
        if self.manual_deadzone >= 1.0:
            raise ValueError(f"manual_deadzone = {self.manual_deadzone} is not in 0..1 (1 excluded)")
        for name in ("bank_max_rad", "takeoff_bank_max_rad", "ground_bank_max_rad", "manual_bank_max_rad"):
            if getattr(self, name) >= math.radians(85.0):
                raise ValueError(f"{name} = {getattr(self, name)} is not below 85 degrees")
        for name in ("loiter_radius_m", "return_loiter_radius_m"):
            if abs(getattr(self, name)) < 1.0:
                raise ValueError(f"{name} = {getattr(self, name)} is no circle: at least 1 m either way")
