"""Health from the times of the last updates and from the covariance."""

import math
from typing import Final

from autopilot_bridge.navigation import fusion as f
from autopilot_bridge.navigation.clocks import Clocks
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.solution import Solution
from autopilot_bridge.navigation.states import ATT, POS, SAMPLE_AGE_S, VEL, X_VEL

_IN_USE_US: Final = 1_000_000
_MAX_TILT_SIGMA_RAD: Final = math.radians(10.0)
_STILL_M_S: Final = 0.5
_REFUSED_US: Final = 1_000_000  # both height sensors refused for this long: the accelerometer is suspected


def report(
    health: NavigationHealth,
    parameters: NavigationParameters,
    solution: Solution,
    clocks: Clocks,
    time_us: int,
    *,
    held: bool,
    at_rest: bool,
) -> None:
    """Write `health` (except the fields of GPS quality and rangefinder)."""
    variance, obs = solution.p.diagonal().tolist(), solution.obs
    horizontal_var = variance[POS] + variance[POS + 1]
    tilt_var = variance[ATT] + variance[ATT + 1]
    health.position_horizontal_accuracy_m = math.sqrt(horizontal_var)
    health.position_vertical_accuracy_m = math.sqrt(variance[POS + 2])
    health.velocity_accuracy_m_s = math.sqrt(variance[VEL] + variance[VEL + 1])
    health.attitude_accuracy_rad = (math.sqrt(tilt_var), math.sqrt(variance[ATT + 2]))

    def within(since_us: int, limit_us: float) -> bool:
        return since_us >= 0 and time_us - since_us <= limit_us

    imu_alive = solution.core[SAMPLE_AGE_S] <= parameters.imu_timeout_s
    aided = not held and within(clocks.horizontal_aid_us, parameters.no_aid_timeout_s * 1e6)
    height = within(clocks.height_us, parameters.height_timeout_s * 1e6)
    health.attitude = bool(imu_alive and tilt_var < _MAX_TILT_SIGMA_RAD**2)
    health.constant_position = held
    health.position_horizontal_relative = aided and bool(imu_alive)
    on_earth = clocks.gps_position_us >= 0
    health.position_horizontal_absolute = health.position_horizontal_relative and on_earth
    # at rest the velocity is good as soon as the zero-velocity updates have brought it there
    speed = math.hypot(solution.core[X_VEL], solution.core[X_VEL + 1])
    still = at_rest and max(speed, health.velocity_accuracy_m_s) < _STILL_M_S
    health.velocity_horizontal = bool(health.position_horizontal_relative or (held and still))
    health.position_vertical_absolute = height and bool(imu_alive)
    health.velocity_vertical = health.position_vertical_absolute
    ready = health.gps_quality and health.yaw_aligned
    health.predicted_position_horizontal_relative = health.position_horizontal_relative or ready
    health.predicted_position_horizontal_absolute = health.position_horizontal_absolute or ready
    health.gps_in_use = within(clocks.gps_us, _IN_USE_US)
    health.barometer_in_use = within(clocks.baro_us, _IN_USE_US)
    health.magnetometer_in_use = within(clocks.mag_us, parameters.magnetometer_timeout_s * 1e6)
    health.dead_reckoning = aided and not health.gps_in_use
    health.time_since_gps_us = time_us - clocks.gps_us if clocks.gps_us >= 0 else -1
    health.magnetometer_test_ratio = float(obs[f.RATIO_MAG])
    health.position_vertical_test_ratio = float(
        obs[f.RATIO_BARO] if clocks.baro_us >= 0 and health.barometer_in_use else obs[f.RATIO_GPS_HEIGHT]
    )
    refused = (
        obs[f.RATIO_BARO] > 1.0
        and obs[f.RATIO_GPS_HEIGHT] > 1.0
        and not within(clocks.height_us, _REFUSED_US)
        and clocks.height_us >= 0
    )
    health.accel_error = bool(refused or not imu_alive)
    if not aided:
        health.gps_glitch = False if not health.gps_quality else health.gps_glitch
