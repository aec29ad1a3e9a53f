"""Filter noise that matches the simulated sensors, so that the covariance can be held to the errors.

A flight has the firmware's defaults instead (`firmware/navigation_noise.py`), which are larger.
"""

import math
from typing import Any, Final

MATCHED: Final[dict[str, Any]] = {
    "gyro_noise_rad_s_sqrt_hz": 2.5e-4,
    "gyro_bias_rad_s": 1.1e-3,  # turn-on bias and wandering together
    "gyro_bias_walk_rad_s_sqrt_s": 1.1e-3 * math.sqrt(2.0 / 16000.0),
    "accel_noise_m_s2_sqrt_hz": 1.8e-3,
    "accel_bias_m_s2": 0.025,  # with what scale and cross-axis errors make of gravity
    "accel_bias_walk_m_s2_sqrt_s": 0.025 * math.sqrt(2.0 / 40000.0),
    "gps_position_noise_m": (0.2, 0.5),
    "gps_position_walk_m": (0.06, 0.12),
    "gps_position_tau_s": 100.0,
    "gps_velocity_noise_m_s": (0.07, 0.158),
    "barometer_noise_m": 0.11,
    "barometer_offset_walk_m_per_sqrt_s": 0.01,
    "magnetometer_noise_gauss": 0.003,
    "magnetometer_bias_gauss": 0.0032,
    "airspeed_noise_m_s": 0.4,
    "sideslip_noise_rad": 0.03,
    "wind_walk_m_s_sqrt_s": 0.02,
}
"""Fields of `NavigationParameters` for `SensorSuiteParameters()` and `SensorSuiteParameters.fixed_wing()`."""
