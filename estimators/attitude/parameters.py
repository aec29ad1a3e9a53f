"""Parameters of the attitude filter. The defaults are suitable for every vehicle and log; see
docs/attitude.md.
"""

from dataclasses import dataclass, fields
from enum import StrEnum
from math import isfinite
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import require_members

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
class AttitudeParameters:
    """Gains, models and uncertainty of the attitude filter.

    Attributes:
        vehicle: form of the filter.
        imu: inertial message.
        imu_instance: `id` of the inertial message, for messages that have one (HIGHRES_IMU, RAW_IMU).
        airspeed: source of the airspeed.
        gain_1_s: k_p, gain from the reference to the attitude.
        bias_gain_1_s2: k_I, gain from the accelerometer to the gyro bias.
        rest_gain_1_s: gain used instead of k_p while the vehicle is disarmed; k_I is then a quarter of its
            square.
        rest_bias_time_s: longest averaging time for the gyro bias about the down axis at rest.
        reference_tolerance_m_s2: difference of the reference's length from g at which its weight is one half.
        trim_roll_rad, trim_pitch_rad: rotation of the board relative to the vehicle; None: the vehicle's
            parameters AHRS_TRIM_X and AHRS_TRIM_Y if they are known (PX4 corrects its sensors itself).
        gap_max_s: a longer gap of the inertial messages restarts the filter.
        airspeed_age_max_s: an older airspeed is not used.
        airspeed_min_m_s: below it lift is negligible, and angle of attack and sideslip are taken as zero.
        longitudinal: whether the change of airspeed is taken into account (Tolman et al. 2021 assume
            unaccelerated flight).
        speed_gain_1_s: gain from the airspeed to the filter that provides its rate of change.
        attack: whether the angle of attack is estimated; otherwise it is zero.
        lift_1_m: k_L / m; None: learned in flight.
        lift_slope_1_m_rad: lift slope over mass and square of airspeed; None: computed with the ratio below.
        lift_slope_ratio_1_rad: ratio of lift slope to k_L, used when the slope is not specified.
        lift_time_s: averaging time for learning k_L.
        climb_time_s: averaging time with which the rate of climb corrects the angle of attack; infinite: no
            correction.
        thrust_m_s2: k_M / m, thrust acceleration at full throttle.
        thrust_loss_1_m: k_T / m, its loss per square of airspeed.
        throttle_trim: value used when no throttle is received, 0..1.
        side_force_ratio_1_rad: ratio of side force per sideslip to mean lift; infinite: no sideslip.
        side_force_time_s: time constant of the side force's smoothing.
        drag_1_s: initial value of a multirotor's drag acceleration per speed.
        drag_velocity_gain_1_s: gain from the velocity computed from drag to the velocity filter.
        drag_learning_m_s: difference of the two velocities at which a sample has half weight in learning the
            drag; infinite: the drag is not learned.
        gyro_noise_rad_rts: angular random walk, rad/s/sqrt(Hz).
        gyro_bias_walk_rad_s_rts: random walk of the gyro bias, rad/s per square root of a second.
        gyro_bias_start_rad_s: standard deviation of the gyro bias at the start.
        rest_error_rad: standard error of the reference at rest.
        flight_error_rad: standard error of the reference in steady flight.
        manoeuvre_error: standard error of the reference per manoeuvre load (rad at 1 g).
        reference_time_s: correlation time of the reference's errors.
    """

    vehicle: VehicleKind = VehicleKind.AUTO
    imu: ImuSource = ImuSource.AUTO
    imu_instance: int = 0
    airspeed: AirspeedSource = AirspeedSource.AUTO
    gain_1_s: float = 0.11
    bias_gain_1_s2: float = 0.003
    rest_gain_1_s: float = 0.5
    rest_bias_time_s: float = 20.0
    reference_tolerance_m_s2: float = 2.0
    trim_roll_rad: float | None = None
    trim_pitch_rad: float | None = None
    gap_max_s: float = 2.0
    airspeed_age_max_s: float = 3.0
    airspeed_min_m_s: float = 6.0
    longitudinal: bool = True
    speed_gain_1_s: float = 2.0
    attack: bool = True
    lift_1_m: float | None = None
    lift_slope_1_m_rad: float | None = None
    lift_slope_ratio_1_rad: float = 10.0
    lift_time_s: float = 10.0
    climb_time_s: float = 10.0
    thrust_m_s2: float = 0.0
    thrust_loss_1_m: float = 0.0
    throttle_trim: float = 0.5
    side_force_ratio_1_rad: float = 3.0
    side_force_time_s: float = 1.0
    drag_1_s: float = 0.4
    drag_velocity_gain_1_s: float = 0.5
    drag_learning_m_s: float = 5.0
    gyro_noise_rad_rts: float = 1e-3
    gyro_bias_walk_rad_s_rts: float = 1e-5
    gyro_bias_start_rad_s: float = 0.01
    rest_error_rad: float = 0.01
    flight_error_rad: float = 0.03
    manoeuvre_error: float = 0.08
    reference_time_s: float = 3.0

    def __post_init__(self) -> None:
        require_members(self, vehicle=VehicleKind, imu=ImuSource, airspeed=AirspeedSource)
        for name, (low, high) in _RANGES.items():
            value = getattr(self, name)
            if value is None:
                continue
            if not low <= value <= high or (name not in _MAY_BE_INFINITE and not isfinite(value)):
                raise ValueError(f"{name} {value:g} is not in {low:g}..{high:g}")


_RANGES: Final[dict[str, tuple[float, float]]] = {
    "imu_instance": (0, 255),
    "gain_1_s": (0.0, 50.0),
    "bias_gain_1_s2": (0.0, 10.0),
    "rest_gain_1_s": (0.0, 50.0),
    "rest_bias_time_s": (0.1, 1e4),
    "reference_tolerance_m_s2": (0.01, float("inf")),
    "trim_roll_rad": (-TRIM_LIMIT_RAD, TRIM_LIMIT_RAD),
    "trim_pitch_rad": (-TRIM_LIMIT_RAD, TRIM_LIMIT_RAD),
    "gap_max_s": (0.05, 60.0),
    "airspeed_age_max_s": (0.1, 60.0),
    "airspeed_min_m_s": (1.0, 100.0),
    "speed_gain_1_s": (0.01, 20.0),
    "lift_1_m": (1e-6, 100.0),
    "lift_slope_1_m_rad": (1e-6, 1e3),
    "lift_slope_ratio_1_rad": (1.0, 200.0),
    "lift_time_s": (0.5, 1e4),
    "climb_time_s": (0.5, float("inf")),
    "thrust_m_s2": (0.0, 100.0),
    "thrust_loss_1_m": (0.0, 10.0),
    "throttle_trim": (0.0, 1.0),
    "side_force_ratio_1_rad": (0.1, float("inf")),
    "side_force_time_s": (0.01, 100.0),
    "drag_1_s": (0.05, 5.0),
    "drag_velocity_gain_1_s": (0.01, 20.0),
    "drag_learning_m_s": (0.01, float("inf")),
    "gyro_noise_rad_rts": (0.0, 1.0),
    "gyro_bias_walk_rad_s_rts": (0.0, 0.1),
    "gyro_bias_start_rad_s": (0.0, 1.0),
    "rest_error_rad": (0.0, 1.0),
    "flight_error_rad": (0.0, 1.0),
    "manoeuvre_error": (0.0, 1.0),
    "reference_time_s": (0.01, 100.0),
}
_MAY_BE_INFINITE: Final = frozenset(name for name, (_, high) in _RANGES.items() if not isfinite(high))


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
