"""Parameters of the attitude filter. The defaults are suitable for every vehicle and log; see
docs/attitude.md.
"""

from dataclasses import dataclass, fields
from enum import StrEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.options import Options, option

TRIM_LIMIT_RAD: Final = 0.3
"""ArduPilot itself accepts 10 degrees."""


class VehicleKind(StrEnum):
    """The form of the filter that runs."""

    AUTO = "auto"
    """From the type in the autopilot's HEARTBEAT."""
    FIXED_WING = "fixed_wing"
    MULTIROTOR = "multirotor"


class ImuSource(StrEnum):
    """The message from which angular rate and specific force are taken."""

    AUTO = "auto"
    """The first of the others, in their order, whose rate is sufficient."""
    HIGHRES_IMU = "HIGHRES_IMU"
    RAW_IMU = "RAW_IMU"
    SCALED_IMU = "SCALED_IMU"
    SCALED_IMU2 = "SCALED_IMU2"
    SCALED_IMU3 = "SCALED_IMU3"


class AirspeedSource(StrEnum):
    """The message from which the airspeed is taken."""

    AUTO = "auto"
    """The first of the others, in their order, that was received recently."""
    VFR_HUD = "VFR_HUD"
    AIRSPEED = "AIRSPEED"
    PRESSURE = "pressure"
    """Differential pressure in SCALED_PRESSURE or HIGHRES_IMU."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AttitudeParameters(Options):
    """Gains, models and uncertainty of the attitude filter."""

    vehicle: VehicleKind = option(VehicleKind.AUTO, help="Form of the filter.")
    imu: ImuSource = option(ImuSource.AUTO, help="Inertial message.")
    imu_instance: int = option(
        0, least=0, most=255, help="Number of the inertial message, of those that have an id."
    )
    airspeed: AirspeedSource = option(AirspeedSource.AUTO, help="Source of the airspeed.")
    gain_1_s: float = option(
        0.11, least=0.0, most=50.0, help="Gain from the reference to the attitude (k_p)."
    )
    bias_gain_1_s2: float = option(
        0.003, least=0.0, most=10.0, help="Gain from the accelerometer to the gyro bias (k_I)."
    )
    still_gain_1_s: float = option(
        0.5, least=0.0, most=50.0, help="Gain k_p of rovers, boats and others without a model of motion."
    )
    still_bias_gain_1_s2: float = option(
        0.005, least=0.0, most=10.0, help="Gain k_I of vehicles without a model of motion."
    )
    rate_mean_s: float = option(
        0.005,
        least=0.0,
        most=1.0,
        help="Time before a sample over which its rate is the mean, without a model of motion.",
    )
    rest_gain_1_s: float = option(
        0.5, least=0.0, most=50.0, help="Gain k_p while disarmed; k_I is then a quarter of its square."
    )
    rest_bias_time_s: float = option(
        20.0, least=0.1, most=10000.0, help="Longest averaging time of the gyro bias about down at rest."
    )
    reference_tolerance_m_s2: float = option(
        2.0, least=0.01, infinite=True, help="Difference of the reference from g at which it has half weight."
    )
    trim_roll_rad: float | None = option(
        None,
        least=-TRIM_LIMIT_RAD,
        most=TRIM_LIMIT_RAD,
        varies="AHRS_TRIM_X",
        help="Roll of the board relative to the vehicle.",
    )
    trim_pitch_rad: float | None = option(
        None,
        least=-TRIM_LIMIT_RAD,
        most=TRIM_LIMIT_RAD,
        varies="AHRS_TRIM_Y",
        help="Pitch of the board relative to the vehicle.",
    )
    gap_max_s: float = option(
        2.0, least=0.05, most=60.0, help="Longest gap of inertial messages that is bridged."
    )
    airspeed_age_max_s: float = option(
        3.0, least=0.1, most=60.0, help="Largest age of an airspeed that is used."
    )
    airspeed_min_m_s: float = option(
        6.0, least=1.0, most=100.0, help="Airspeed below which lift, and angles of the air, are zero."
    )
    longitudinal: bool = option(
        True, help="Acceleration along the path is taken from the change of airspeed."
    )
    speed_gain_1_s: float = option(
        2.0, least=0.01, most=20.0, help="Gain of the filter that gives the rate of change of the airspeed."
    )
    attack: bool = option(True, help="Angle of attack is estimated; otherwise it is zero.")
    lift_1_m: float | None = option(
        None,
        least=1e-06,
        most=100.0,
        varies="learned in flight",
        help="Lift per square of airspeed over mass (k_L / m).",
    )
    lift_slope_1_m_rad: float | None = option(
        None,
        least=1e-06,
        most=1000.0,
        varies="lift times lift_slope_ratio_1_rad",
        help="Lift slope over mass and square of airspeed.",
    )
    lift_slope_ratio_1_rad: float = option(
        10.0, least=1.0, most=200.0, help="Ratio of lift slope to k_L, for a slope that is not given."
    )
    lift_time_s: float = option(10.0, least=0.5, most=10000.0, help="Averaging time for learning k_L.")
    climb_time_s: float = option(
        10.0,
        least=0.5,
        infinite=True,
        help="Time by which the rate of climb corrects the angle of attack; inf: never.",
    )
    thrust_m_s2: float = option(
        0.0, least=0.0, most=100.0, help="Thrust acceleration at full throttle (k_M / m)."
    )
    thrust_loss_1_m: float = option(
        0.0, least=0.0, most=10.0, help="Loss of thrust acceleration per square of airspeed (k_T / m)."
    )
    throttle_trim: float = option(
        0.5, least=0.0, most=1.0, help="Throttle that is assumed when none is received, 0..1."
    )
    side_force_ratio_1_rad: float = option(
        3.0, least=0.1, infinite=True, help="Ratio of side force per sideslip to lift; inf: no sideslip."
    )
    side_force_time_s: float = option(
        1.0, least=0.01, most=100.0, help="Time constant of the side force's smoothing."
    )
    drag_1_s: float = option(
        0.4, least=0.05, most=5.0, help="Initial value of a multirotor's drag acceleration per speed."
    )
    drag_velocity_gain_1_s: float = option(
        0.5, least=0.01, most=20.0, help="Gain from the velocity computed from drag to the velocity filter."
    )
    drag_learning_m_s: float = option(
        5.0,
        least=0.01,
        infinite=True,
        help="Difference of velocities with half weight in learning the drag; inf: none.",
    )
    gyro_noise_rad_rts: float = option(
        1e-3, least=0.0, most=1.0, help="Angular random walk of the gyros, rad/s/sqrt(Hz)."
    )
    gyro_bias_walk_rad_s_rts: float = option(
        1e-5, least=0.0, most=0.1, help="Random walk of the gyro bias, rad/s per square root of a second."
    )
    gyro_bias_start_rad_s: float = option(
        0.01, least=0.0, most=1.0, help="Standard deviation of the gyro bias at the start."
    )
    rest_error_rad: float = option(0.01, least=0.0, most=1.0, help="Standard error of the reference at rest.")
    flight_error_rad: float = option(
        0.03, least=0.0, most=1.0, help="Standard error of the reference in steady flight."
    )
    manoeuvre_error: float = option(
        0.08, least=0.0, most=1.0, help="Standard error of the reference per manoeuvre load (rad at 1 g)."
    )
    reference_time_s: float = option(
        3.0, least=0.01, most=100.0, help="Correlation time of the reference's errors."
    )


# Order of the coefficients for the compiled step: every numeric parameter, by its name.
NUMBERS: Final = tuple(
    field.name
    for field in fields(AttitudeParameters)
    if field.name not in ("vehicle", "imu", "imu_instance", "airspeed", "trim_roll_rad", "trim_pitch_rad")
)


def coefficients(parameters: AttitudeParameters) -> NDArray[np.float64]:
    """The parameters for the compiled step, in the order of `NUMBERS`; None becomes zero."""
    values = (getattr(parameters, name) for name in NUMBERS)
    return np.array([0.0 if value is None else float(value) for value in values])


def _index(name: str) -> int:
    return NUMBERS.index(name)


GAIN: Final = _index("gain_1_s")
BIAS_GAIN: Final = _index("bias_gain_1_s2")
STILL_GAIN: Final = _index("still_gain_1_s")
STILL_BIAS_GAIN: Final = _index("still_bias_gain_1_s2")
RATE_MEAN: Final = _index("rate_mean_s")
REST_GAIN: Final = _index("rest_gain_1_s")
REST_BIAS_TIME: Final = _index("rest_bias_time_s")
TOLERANCE: Final = _index("reference_tolerance_m_s2")
AIRSPEED_MIN: Final = _index("airspeed_min_m_s")
LONGITUDINAL: Final = _index("longitudinal")
SPEED_GAIN: Final = _index("speed_gain_1_s")
ATTACK: Final = _index("attack")
LIFT_GIVEN: Final = _index("lift_1_m")
LIFT_SLOPE_GIVEN: Final = _index("lift_slope_1_m_rad")
LIFT_SLOPE_RATIO: Final = _index("lift_slope_ratio_1_rad")
LIFT_TIME: Final = _index("lift_time_s")
CLIMB_TIME: Final = _index("climb_time_s")
THRUST: Final = _index("thrust_m_s2")
THRUST_LOSS: Final = _index("thrust_loss_1_m")
THROTTLE_TRIM: Final = _index("throttle_trim")
SIDE_FORCE_RATIO: Final = _index("side_force_ratio_1_rad")
SIDE_FORCE_TIME: Final = _index("side_force_time_s")
DRAG: Final = _index("drag_1_s")
DRAG_VELOCITY_GAIN: Final = _index("drag_velocity_gain_1_s")
DRAG_LEARNING: Final = _index("drag_learning_m_s")
GYRO_NOISE: Final = _index("gyro_noise_rad_rts")
GYRO_BIAS_WALK: Final = _index("gyro_bias_walk_rad_s_rts")
GYRO_BIAS_START: Final = _index("gyro_bias_start_rad_s")
REST_ERROR: Final = _index("rest_error_rad")
FLIGHT_ERROR: Final = _index("flight_error_rad")
MANOEUVRE_ERROR: Final = _index("manoeuvre_error")
REFERENCE_TIME: Final = _index("reference_time_s")
