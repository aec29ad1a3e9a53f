"""The filter's arrays, and the ways its estimate may jump."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import covariance as cov
from autopilot_bridge.navigation import states as s
from autopilot_bridge.navigation.fusion import OBS_SIZE
from autopilot_bridge.navigation.mechanisation import refresh_rotation
from autopilot_bridge.navigation.parameters import NavigationParameters
from flightsim.foundation.atmosphere import GRAVITY_M_S2
from flightsim.foundation.geodesy import LocalFrame, earth_rate_ned_rad_s, normal_gravity_m_s2
from flightsim.foundation.rotations import multiply, quaternion_from_euler

Array = NDArray[np.float64]

UNKNOWN_POSITION_M: Final = 100.0
UNKNOWN_VELOCITY_M_S: Final = 10.0
UNKNOWN_VERTICAL_VELOCITY_M_S: Final = 3.0
UNKNOWN_HEIGHT_M: Final = 50.0
_BETTER_SOLUTION: Final = 3.0  # times better an accuracy: differential or RTK corrections have come


class Solution:
    """Nominal state, covariance and history, with the jumps: align, reset position, velocity, height, yaw.

    Attributes:
        core, p, history, work, obs, process: arrays of `states.py`, `covariance.py` and `fusion.py`.
        row: of the history's newest entry; rows: how many there are; steps: how many have been written.
        steps_per_s: physics rate.
    """

    def __init__(self, parameters: NavigationParameters, *, physics_rate_hz: int) -> None:
        self._parameters = parameters
        self.period_us = 1_000_000 // physics_rate_hz
        self.rows = (
            math.ceil(parameters.history_s * physics_rate_hz)
            + physics_rate_hz // parameters.covariance_rate_hz
        )
        self.core: Array = np.zeros(s.CORE_SIZE)
        size = s.ERROR_SIZE_WITH_WIND if parameters.fixed_wing else s.ERROR_SIZE
        self.p: Array = np.zeros((size, size))
        self.history: Array = np.zeros((self.rows, s.HISTORY_COLUMNS))
        self.work: Array = np.zeros(s.WORK_SIZE)
        self.obs: Array = np.zeros(OBS_SIZE)
        self.process: Array = process_from(parameters)
        self.core[s.GRAVITY] = GRAVITY_M_S2
        self.core[s.STRETCH : s.STRETCH + 2] = 1.0
        horizontal, vertical = parameters.gps_position_walk_m
        self.gps_error_var = (horizontal**2, horizontal**2, vertical**2)
        self.clear()

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New tuning; the variances of the GPS error stay until the receiver reports its accuracy again."""
        self._parameters = parameters
        horizontal, _, vertical = self.gps_error_var
        self.process[:] = process_from(parameters)
        self.process[cov.GPS_VAR_HORIZONTAL] = horizontal
        self.process[cov.GPS_VAR_VERTICAL] = vertical

    def clear(self) -> None:
        """Nothing is known, except the frame, with the gravity and the rotation of its origin."""
        gravity, rate = self.core[s.GRAVITY], self.core[s.EARTH_RATE : s.EARTH_RATE + 3].copy()
        stretch = self.core[s.STRETCH : s.STRETCH + 2].copy()
        self.core[:] = 0.0
        self.core[s.Q] = 1.0
        self.core[s.GRAVITY] = gravity
        self.core[s.EARTH_RATE : s.EARTH_RATE + 3] = rate
        self.core[s.STRETCH : s.STRETCH + 2] = stretch
        self.core[s.TERRAIN_DOWN] = math.nan
        refresh_rotation(self.core)
        self.p[:] = 0.0
        self.history[:] = 0.0
        self.work[:] = 0.0
        self.row = 0
        self.steps = 0
        self._accuracy_step = 0  # when the receiver last reported its accuracy

    def set_frame(self, frame: LocalFrame) -> None:
        """Gravity and Earth's rotation of the frame's origin, and the lengths of its metres."""
        origin = frame.origin
        self.core[s.GRAVITY] = normal_gravity_m_s2(origin.lat_deg, origin.alt_m)
        self.core[s.EARTH_RATE : s.EARTH_RATE + 3] = earth_rate_ned_rad_s(origin.lat_deg)
        self.core[s.STRETCH : s.STRETCH + 2] = frame.stretch

    def set_gps_accuracy(self, eph_m: float, epv_m: float) -> None:
        """What the receiver reports beyond its white noise is the slow error's standard deviation.

        A worse accuracy widens the slow error at once. A somewhat better one does so with the error's time
        constant: reports go up and down, the atmosphere does not. An accuracy better by a factor of
        `_BETTER_SOLUTION` means that the receiver has gone over to a better solution (RTK): the slow error
        shrinks with it.
        """
        p = self._parameters
        reported = (
            max(eph_m**2 - p.gps_position_noise_m[0] ** 2, p.gps_position_walk_m[0] ** 2),
            max(epv_m**2 - p.gps_position_noise_m[1] ** 2, p.gps_position_walk_m[1] ** 2),
        )
        elapsed_s = (self.steps - self._accuracy_step) * self.period_us * 1e-6
        self._accuracy_step = self.steps
        fade = math.exp(-2.0 * elapsed_s / p.gps_position_tau_s)
        accepted = []
        for axes, new in zip(((0, 1), (2,)), reported, strict=True):
            old = self.gps_error_var[axes[0]]
            if new >= old:
                for axis in axes:
                    self.p[s.GPS_ERROR + axis, s.GPS_ERROR + axis] += new - old
            elif new * _BETTER_SOLUTION**2 < old:
                for axis in axes:
                    self._shrink_gps_error(axis, math.sqrt(new / old))
            else:
                new += (old - new) * fade
            accepted.append(new)
        horizontal, vertical = accepted
        self.gps_error_var = (horizontal, horizontal, vertical)
        self.process[cov.GPS_VAR_HORIZONTAL] = horizontal
        self.process[cov.GPS_VAR_VERTICAL] = vertical

    def _shrink_gps_error(self, axis: int, factor: float) -> None:
        self.core[s.X_GPS_ERROR + axis] *= factor
        self.p[s.GPS_ERROR + axis, :] *= factor
        self.p[:, s.GPS_ERROR + axis] *= factor

    def row_at(self, measured_us: int, time_us: int) -> int:
        """History row of a past time; -1 when it's older than the history."""
        back = max(0, (time_us - measured_us + self.period_us // 2) // self.period_us)
        if back >= min(self.rows, self.steps):
            return -1
        return (self.row - back) % self.rows

    def past_position(self, row: int) -> Array:
        """Position at a row of the history, as seen now."""
        return (
            self.history[row, s.HISTORY_POS : s.HISTORY_POS + 3]
            + self.core[s.CORRECTION_POS : s.CORRECTION_POS + 3]
        )

    def past_velocity(self, row: int) -> Array:
        """Velocity at a row of the history, as seen now."""
        return (
            self.history[row, s.HISTORY_VEL : s.HISTORY_VEL + 3]
            + self.core[s.CORRECTION_VEL : s.CORRECTION_VEL + 3]
        )

    def align(self, roll_rad: float, pitch_rad: float, yaw_rad: float, *, yaw_sigma_rad: float) -> None:
        """Start at rest at the frame's origin with this attitude. Tilt and biases get their correlation from
        the updates that follow, so their priors are wide and independent here."""
        quaternion_from_euler(roll_rad, pitch_rad, yaw_rad, self.core[s.Q : s.Q + 4])
        self.refresh()
        p = self._parameters
        for i in range(3):
            cov.forget(self.p, s.VEL + i, 0.5**2)
            cov.forget(self.p, s.GYRO_BIAS + i, p.gyro_bias_rad_s**2)
            cov.forget(self.p, s.GPS_ERROR + i, self.gps_error_var[i])
            cov.forget(self.p, s.POS + i, p.at_rest_noise_m**2 if i < 2 else 0.1**2)
        cov.forget(self.p, s.BARO_OFFSET, UNKNOWN_HEIGHT_M**2)
        for i in range(s.WIND, len(self.p)):
            cov.forget(self.p, i, p.wind_prior_m_s**2)
        self.widen_attitude(yaw_sigma_rad)

    def widen_attitude(self, yaw_sigma_rad: float) -> None:
        """Attitude, accelerometer and magnetometer bias are as uncertain again as at alignment."""
        p = self._parameters
        for i in range(3):
            cov.forget(self.p, s.ATT + i, p.alignment_tilt_rad**2 if i < 2 else yaw_sigma_rad**2)
            cov.forget(self.p, s.ACCEL_BIAS + i, p.accel_bias_m_s2**2)
        self.forget_mag_bias()

    def forget_mag_bias(self) -> None:
        """The magnetometer's bias is as uncertain as at alignment."""
        self.core[s.X_MAG_BIAS : s.X_MAG_BIAS + 3] = 0.0
        for i in range(3):
            cov.forget(self.p, s.MAG_BIAS + i, self._parameters.magnetometer_bias_gauss**2)

    def refresh(self) -> None:
        """Bring what follows from the quaternion up to date."""
        core = self.core
        refresh_rotation(core)
        rotation = core[s.R : s.R + 9].reshape(3, 3)
        core[s.FORCE_NED : s.FORCE_NED + 3] = rotation @ (
            core[s.ACCEL : s.ACCEL + 3] - core[s.ACCEL_BIAS + 1 : s.ACCEL_BIAS + 4]
        )

    def turn_yaw(self, angle_rad: float, *, yaw_sigma_rad: float) -> None:
        """Rotate the attitude, present and past, about the vertical; widen the attitude."""
        turn: Array = np.array([math.cos(0.5 * angle_rad), 0.0, 0.0, math.sin(0.5 * angle_rad)])
        turned: Array = np.zeros(4)
        multiply(turn, self.core[s.Q : s.Q + 4], turned)
        self.core[s.Q : s.Q + 4] = turned
        for row in range(self.rows):
            multiply(turn, self.history[row, s.HISTORY_Q : s.HISTORY_Q + 4], turned)
            self.history[row, s.HISTORY_Q : s.HISTORY_Q + 4] = turned
        self.refresh()
        self.widen_attitude(yaw_sigma_rad)

    def move_horizontally(self, north_m: float, east_m: float) -> None:
        """Position jumps and is unknown around its new value, as is the GPS error."""
        cov.shift(self.core, s.POS, north_m, east_m, 0.0)
        for i in range(2):
            cov.forget(self.p, s.POS + i, UNKNOWN_POSITION_M**2)
            cov.forget(self.p, s.GPS_ERROR + i, self.gps_error_var[i])
            self.core[s.X_GPS_ERROR + i] = 0.0

    def change_velocity(self, north_m_s: float, east_m_s: float, *, sigma_m_s: float) -> None:
        """Horizontal velocity jumps, with a new variance."""
        cov.shift(self.core, s.VEL, north_m_s, east_m_s, 0.0)
        cov.forget(self.p, s.VEL, sigma_m_s**2)
        cov.forget(self.p, s.VEL + 1, sigma_m_s**2)

    def move_vertically(self, down_m: float, *, with_baro: bool) -> None:
        """Height jumps and is unknown; `with_baro`: the barometer's offset jumps along and stays known to
        it."""
        p = self.p
        cov.shift(self.core, s.POS, 0.0, 0.0, down_m)
        if with_baro:
            self.core[s.X_BARO_OFFSET] += down_m
            for i in (s.POS + 2, s.BARO_OFFSET):
                for j in (s.POS + 2, s.BARO_OFFSET):
                    p[i, j] += UNKNOWN_HEIGHT_M**2
        else:
            cov.forget(p, s.POS + 2, UNKNOWN_HEIGHT_M**2)

    def change_vertical_velocity(self, down_m_s: float) -> None:
        """Vertical velocity jumps and is unknown around its new value."""
        cov.shift(self.core, s.VEL, 0.0, 0.0, down_m_s)
        cov.forget(self.p, s.VEL + 2, UNKNOWN_VERTICAL_VELOCITY_M_S**2)

    def forget_gps_height_error(self) -> None:
        """The slow error of GPS heights is unknown."""
        cov.forget(self.p, s.GPS_ERROR + 2, self.gps_error_var[2])
        self.core[s.X_GPS_ERROR + 2] = 0.0

    def set_baro_offset(self, offset_m: float) -> None:
        """The barometer's offset is unknown around this value."""
        self.core[s.X_BARO_OFFSET] = offset_m
        cov.forget(self.p, s.BARO_OFFSET, UNKNOWN_HEIGHT_M**2)

    def widen_baro_offset(self, variance_m2: float) -> None:
        """The barometer's offset may have changed by so much."""
        self.p[s.BARO_OFFSET, s.BARO_OFFSET] += variance_m2

    def position(self) -> tuple[float, float, float]:
        """Present position, NED, m."""
        return (float(self.core[s.X_POS]), float(self.core[s.X_POS + 1]), float(self.core[s.X_POS + 2]))


def _correlation_s(sigma: float, walk: float) -> float:
    """Time constant of the Gauss-Markov process with this 1-sigma and this random walk (per root second)."""
    return 2.0 * (sigma / walk) ** 2


def process_from(p: NavigationParameters) -> Array:
    """The process noise of `covariance.predict`."""
    out: Array = np.zeros(cov.PROCESS_SIZE)
    out[cov.NOISE_ATT] = p.gyro_noise_rad_s_sqrt_hz**2
    out[cov.NOISE_VEL] = p.accel_noise_m_s2_sqrt_hz**2
    out[cov.TURN_SCALE] = p.gyro_scale_error**2
    out[cov.TURN_TILT] = p.gyro_scale_error**2 * p.gyro_scale_tilt_rad
    out[cov.TURN_CROSS] = p.gyro_cross_axis_error**2
    out[cov.GYRO_BIAS_VAR] = p.gyro_bias_rad_s**2
    out[cov.GYRO_BIAS_TAU] = _correlation_s(p.gyro_bias_rad_s, p.gyro_bias_walk_rad_s_sqrt_s)
    out[cov.ACCEL_BIAS_VAR] = p.accel_bias_m_s2**2
    out[cov.ACCEL_BIAS_TAU] = _correlation_s(p.accel_bias_m_s2, p.accel_bias_walk_m_s2_sqrt_s)
    out[cov.GPS_VAR_HORIZONTAL] = p.gps_position_walk_m[0] ** 2
    out[cov.GPS_VAR_VERTICAL] = p.gps_position_walk_m[1] ** 2
    out[cov.GPS_TAU] = p.gps_position_tau_s
    out[cov.BARO_WALK] = p.barometer_offset_walk_m_per_sqrt_s**2
    out[cov.MAG_BIAS_VAR] = p.magnetometer_bias_gauss**2
    out[cov.MAG_BIAS_TAU] = p.magnetometer_bias_tau_s
    out[cov.MAG_BIAS_TURN] = p.magnetometer_bias_turn_rad
    out[cov.WIND_WALK] = p.wind_walk_m_s_sqrt_s**2
    return out
