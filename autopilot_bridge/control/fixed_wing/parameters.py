"""Gains and limits of the fixed-wing control laws; beside each field the parameters of PX4 | ArduPilot."""

import math
from dataclasses import dataclass

from autopilot_bridge.control.fixed_wing.gains import gains_for
from flightsim.flight_envelope import FlightEnvelope
from flightsim.foundation.checks import Finite, NotNegative, Positive, Share
from flightsim.foundation.options import Options


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedWingParameters(Options):
    """Parameters of `FixedWingController`.

    Speeds are equivalent airspeeds, surfaces -1..1, throttle 0..1. Defaults are PX4's where PX4 has them;
    `for_envelope` makes the parameters of an aircraft. Gains of the rate loops are in surface per rad/s
    (PX4's units; ArduPilot's RLL_RATE_* and PTCH_RATE_* times 4/pi) and hold at `scaling_airspeed_m_s`.

    Raises:
        ValueError: a field is not finite or outside its range.
    """

    # airspeeds
    airspeed_stall_m_s: NotNegative = 7.0  # FW_AIRSPD_STALL | AIRSPEED_STALL; 0: four fifths of the lowest
    airspeed_min_m_s: Positive = 10.0  # FW_AIRSPD_MIN | AIRSPEED_MIN
    airspeed_trim_m_s: Positive = 15.0  # FW_AIRSPD_TRIM | AIRSPEED_CRUISE
    airspeed_max_m_s: Positive = 20.0  # FW_AIRSPD_MAX | AIRSPEED_MAX
    ground_speed_min_m_s: NotNegative = 5.0  # FW_GND_SPD_MIN | MIN_GROUNDSPEED: airspeed is raised for it

    # lateral guidance
    heading_p_1_s: Positive = (
        0.8885  # 4 pi damping / period of NPFG_DAMPING, NPFG_PERIOD | NAVL1_DAMPING, _PERIOD
    )
    roll_limit_rad: Positive = math.radians(50.0)  # FW_R_LIM | ROLL_LIMIT_DEG
    roll_slew_rad_s: Positive = math.radians(90.0)  # FW_PN_R_SLEW_MAX | (none)
    load_factor_max: NotNegative = 2.0  # (none): bank is limited to this load factor of a level turn
    stall_prevention: bool = True  # (always) | STALL_PREVENTION: bank is limited by the airspeed there is
    stall_margin: Positive = 1.1  # (none): airspeed over the stall speed in the turn that limits the bank

    # throttle
    powered: bool = True  # (none): a glider flies its airspeed by pitch alone
    trim_throttle: Share = 0.6  # FW_THR_TRIM | TRIM_THROTTLE
    trim_throttle_min_speed: Share = 0.0  # FW_THR_ASPD_MIN; 0: as at trim airspeed
    trim_throttle_max_speed: Share = 0.0  # FW_THR_ASPD_MAX; 0: as at trim airspeed
    throttle_min: Share = 0.0  # FW_THR_MIN | THR_MIN
    throttle_max: Share = 1.0  # FW_THR_MAX | THR_MAX
    throttle_slew_1_s: NotNegative = 0.0  # FW_THR_SLEW_MAX | THR_SLEWRATE; 0: no limit

    # pitch
    pitch_min_rad: Finite = math.radians(-30.0)  # FW_P_LIM_MIN | PTCH_LIM_MIN_DEG
    pitch_max_rad: Finite = math.radians(30.0)  # FW_P_LIM_MAX | PTCH_LIM_MAX_DEG
    trim_pitch_rad: Finite = 0.0  # FW_PSP_OFF | PTCH_TRIM_DEG: pitch of level flight at trim airspeed
    lift_angle_rad: NotNegative = 0.0  # (none): angle of attack over that of zero lift, at trim; 0: none

    # total energy
    climb_max_m_s: Positive = 5.0  # FW_T_CLMB_MAX | TECS_CLMB_MAX: full throttle, trim airspeed
    sink_min_m_s: Positive = 2.0  # FW_T_SINK_MIN | TECS_SINK_MIN: throttle at its least, trim airspeed
    sink_max_m_s: Positive = 5.0  # FW_T_SINK_MAX | TECS_SINK_MAX
    climb_rate_target_m_s: Positive = 3.0  # FW_T_CLMB_R_SP | (TECS_CLMB_MAX): of height steps
    sink_rate_target_m_s: Positive = 2.0  # FW_T_SINK_R_SP | (TECS_SINK_MAX)
    height_time_constant_s: Positive = 5.0  # FW_T_ALT_TC | TECS_TIME_CONST
    airspeed_time_constant_s: Positive = 5.0  # FW_T_TAS_TC | TECS_TIME_CONST
    height_rate_ff: NotNegative = 0.3  # FW_T_HRATE_FF
    height_acceleration_m_s2: Positive = 1.5  # (none): of the height trajectory
    energy_balance_ff: NotNegative = 1.0  # FW_T_SEB_R_FF
    pitch_damping: NotNegative = 0.1  # FW_T_PTCH_DAMP | TECS_PTCH_DAMP
    pitch_integral_1_s: NotNegative = 0.1  # FW_T_I_GAIN_PIT | TECS_INTEG_GAIN
    throttle_damping: NotNegative = 0.05  # FW_T_THR_DAMPING | TECS_THR_DAMP
    throttle_integral_1_s: NotNegative = 0.02  # FW_T_THR_INTEG | TECS_INTEG_GAIN
    speed_weight: NotNegative = 1.0  # FW_T_SPDWEIGHT | TECS_SPDWEIGHT: pitch flies height (0) or airspeed (2)
    energy_rate_time_constant_s: NotNegative = 0.4  # FW_T_STE_R_TC
    vertical_acceleration_max_m_s2: Positive = 7.0  # FW_T_VERT_ACC | TECS_VERT_ACC
    turn_energy_rate_m2_s3: NotNegative = 15.0  # FW_T_RLL2THR | TECS_RLL2THR: energy rate per load factor
    airspeed_noise_m_s: Positive = 0.07  # FW_T_SPD_STD | (TECS_SPD_OMEGA)
    airspeed_rate_noise_m_s2: Positive = 0.2  # FW_T_SPD_DEV_STD
    airspeed_rate_process_noise_m_s2: Positive = 0.2  # FW_T_SPD_PRC_STD

    # attitude
    roll_time_constant_s: Positive = 0.4  # FW_R_TC | RLL2SRV_TCONST
    pitch_time_constant_s: Positive = 0.4  # FW_P_TC | PTCH2SRV_TCONST
    roll_rate_max_rad_s: Positive = math.radians(70.0)  # FW_R_RMAX | RLL2SRV_RMAX
    pitch_rate_max_up_rad_s: Positive = math.radians(60.0)  # FW_P_RMAX_POS | PTCH2SRV_RMAX_UP
    pitch_rate_max_down_rad_s: Positive = math.radians(60.0)  # FW_P_RMAX_NEG | PTCH2SRV_RMAX_DN
    yaw_rate_max_rad_s: Positive = math.radians(50.0)  # FW_Y_RMAX
    sideslip_gain_rad_s_per_m_s2: NotNegative = (
        0.0  # (none) | YAW2SRV_SLIP: yaw rate per lateral acceleration
    )

    # body rates
    airspeed_scaling: bool = True  # FW_ARSP_SCALE_EN | (always)
    scaling_airspeed_m_s: Positive = 15.0  # FW_AIRSPD_TRIM | SCALING_SPEED
    rate_roll_p: NotNegative = 0.05  # FW_RR_P | RLL_RATE_P
    rate_roll_i: NotNegative = 0.1  # FW_RR_I | RLL_RATE_I
    rate_roll_d: NotNegative = 0.0  # FW_RR_D | RLL_RATE_D
    rate_roll_ff: NotNegative = 0.5  # FW_RR_FF | RLL_RATE_FF
    rate_roll_integral_max: NotNegative = 0.2  # FW_RR_IMAX | RLL_RATE_IMAX
    rate_pitch_p: NotNegative = 0.08  # FW_PR_P | PTCH_RATE_P
    rate_pitch_i: NotNegative = 0.1  # FW_PR_I | PTCH_RATE_I
    rate_pitch_d: NotNegative = 0.0  # FW_PR_D | PTCH_RATE_D
    rate_pitch_ff: NotNegative = 0.5  # FW_PR_FF | PTCH_RATE_FF
    rate_pitch_integral_max: NotNegative = 0.4  # FW_PR_IMAX | PTCH_RATE_IMAX
    rate_yaw_p: NotNegative = 0.05  # FW_YR_P | YAW2SRV_DAMP
    rate_yaw_i: NotNegative = 0.1  # FW_YR_I | YAW2SRV_INT
    rate_yaw_d: NotNegative = 0.0  # FW_YR_D
    rate_yaw_ff: NotNegative = 0.3  # FW_YR_FF
    rate_yaw_integral_max: NotNegative = 0.2  # FW_YR_IMAX | YAW2SRV_IMAX
    rate_derivative_cutoff_hz: Positive = 20.0  # IMU_DGYRO_CUTOFF | RLL_RATE_FLTD
    roll_to_rudder_ff: Finite = 0.0  # FW_RLL_TO_YAW_FF | KFF_RDDRMIX: rudder per aileron
    trim_aileron: Finite = 0.0  # TRIM_ROLL
    trim_elevator: Finite = 0.0  # TRIM_PITCH
    trim_rudder: Finite = 0.0  # TRIM_YAW

    # wheels
    wheel_time_constant_s: Positive = 0.5  # (FW_W_EN) | STEER2SRV_TCONST: heading error to yaw rate
    wheel_rate_max_rad_s: Positive = math.radians(30.0)  # FW_W_RMAX | GROUND_STEER_DPS
    wheel_p: NotNegative = 0.5  # FW_WR_P | STEER2SRV_P
    wheel_i: NotNegative = 0.1  # FW_WR_I | STEER2SRV_I
    wheel_integral_max: NotNegative = 0.4  # FW_WR_IMAX | STEER2SRV_IMAX
    wheel_ff: NotNegative = 0.2  # FW_WR_FF | STEER2SRV_FF

    def check_together(self) -> None:
        for name in ("trim_aileron", "trim_elevator", "trim_rudder"):
            if abs(getattr(self, name)) > 1.0:
                raise ValueError(f"{name} = {getattr(self, name)} is not in -1..1")
        for low, high in (
            ("airspeed_stall_m_s", "airspeed_min_m_s"),
            ("airspeed_min_m_s", "airspeed_max_m_s"),
            ("throttle_min", "throttle_max"),
            ("pitch_min_rad", "pitch_max_rad"),
        ):
            if getattr(self, low) >= getattr(self, high):
                raise ValueError(f"{low} = {getattr(self, low)} is not below {high} = {getattr(self, high)}")
        if not self.airspeed_min_m_s <= self.airspeed_trim_m_s <= self.airspeed_max_m_s:
            raise ValueError(
                f"airspeed_trim_m_s = {self.airspeed_trim_m_s} is not in "
                f"airspeed_min_m_s..airspeed_max_m_s = {self.airspeed_min_m_s}..{self.airspeed_max_m_s}"
            )
        for name, limit_deg in (("roll_limit_rad", 80.0), ("pitch_max_rad", 80.0)):
            if getattr(self, name) > math.radians(limit_deg):
                raise ValueError(f"{name} = {getattr(self, name)} is more than {limit_deg} deg")
        if self.pitch_min_rad < math.radians(-80.0):
            raise ValueError(f"pitch_min_rad = {self.pitch_min_rad} is less than -80 deg")
        if self.load_factor_max < 1.0:
            raise ValueError(f"load_factor_max = {self.load_factor_max} is not 1 or more")
        if self.speed_weight > 2.0:
            raise ValueError(f"speed_weight = {self.speed_weight} is not in 0..2")

    @classmethod
    def for_envelope(cls, envelope: FlightEnvelope) -> "FixedWingParameters":
        """Parameters for an aircraft, from what it can do (`gains.gains_for`)."""
        return cls(**gains_for(envelope))  # type: ignore[arg-type]  # every value has its field's type
