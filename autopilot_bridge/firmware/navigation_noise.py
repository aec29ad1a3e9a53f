"""The navigation filter's noise from EKF2_* and EK3_*.

Both firmwares give the noise of an inertial sensor as a standard deviation in a prediction step: a step of dt
adds the variance `(noise x dt)^2` to the velocity or the angle, so the density is `noise x sqrt(dt)`. A bias
that walks by `noise x dt` in a step has the random walk `noise x sqrt(dt)`.
"""

import math
from typing import Any, Final

from autopilot_bridge.firmware.mapping import FieldMap, field_values
from autopilot_bridge.parameters import ParameterStore

_EK3_STEP_S: Final = 0.012  # EKF_TARGET_DT of ArduPilot 4.6.3
_VERTICAL_TO_HORIZONTAL: Final = 1.5  # both firmwares: of a receiver's errors

_PX4_FIELDS: Final = (
    FieldMap("accel_bias_m_s2", "EKF2_ABIAS_INIT"),
    FieldMap("barometer_noise_m", "EKF2_BARO_NOISE"),
    FieldMap("magnetometer_noise_gauss", "EKF2_MAG_NOISE"),
)
_ARDUPILOT_FIELDS: Final = (
    FieldMap("barometer_noise_m", "EK3_ALT_M_NSE"),
    FieldMap("magnetometer_noise_gauss", "EK3_MAG_M_NSE"),
)


def px4_noise(store: ParameterStore) -> dict[str, Any]:
    """Fields of `NavigationParameters` from EKF2_GYR_NOISE, EKF2_GPS_P_NOISE, ..."""
    step_s = store.limited("EKF2_PREDICT_US") * 1e-6
    position_m = store.limited("EKF2_GPS_P_NOISE")
    velocity_m_s = store.limited("EKF2_GPS_V_NOISE")
    return {
        **field_values(store, _PX4_FIELDS),
        **field_values(
            store,
            _inertial(step_s, "EKF2_GYR_NOISE", "EKF2_ACC_NOISE", "EKF2_GYR_B_NOISE", "EKF2_ACC_B_NOISE"),
        ),
        "gps_position_noise_m": (position_m, _VERTICAL_TO_HORIZONTAL * position_m),
        "gps_velocity_noise_m_s": (velocity_m_s, _VERTICAL_TO_HORIZONTAL * velocity_m_s),
    }


def ardupilot_noise(store: ParameterStore) -> dict[str, Any]:
    """Fields of `NavigationParameters` from EK3_GYRO_P_NSE, EK3_POSNE_M_NSE, ..."""
    position_m = store.limited("EK3_POSNE_M_NSE")
    horizontal_m_s = store.limited("EK3_VELNE_M_NSE")
    vertical_m_s = store.limited("EK3_VELD_M_NSE")
    return {
        **field_values(store, _ARDUPILOT_FIELDS),
        **field_values(
            store,
            _inertial(_EK3_STEP_S, "EK3_GYRO_P_NSE", "EK3_ACC_P_NSE", "EK3_GBIAS_P_NSE", "EK3_ABIAS_P_NSE"),
        ),
        "gps_position_noise_m": (position_m, _VERTICAL_TO_HORIZONTAL * position_m),
        "gps_velocity_noise_m_s": (horizontal_m_s, vertical_m_s),
    }


def _inertial(step_s: float, gyro: str, accel: str, gyro_bias: str, accel_bias: str) -> tuple[FieldMap, ...]:
    root = math.sqrt(step_s)
    return (
        FieldMap("gyro_noise_rad_s_sqrt_hz", gyro, root),
        FieldMap("accel_noise_m_s2_sqrt_hz", accel, root),
        FieldMap("gyro_bias_walk_rad_s_sqrt_s", gyro_bias, root),
        FieldMap("accel_bias_walk_m_s2_sqrt_s", accel_bias, root),
    )
