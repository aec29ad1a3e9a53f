"""The navigation filter: an error-state Kalman filter on the vehicle's sensors.

Every physics step runs the strapdown mechanisation; at `covariance_rate_hz` the covariance is predicted and
the measurements that have come in are fused, each against the history at the time it was taken. What is fused
when, and what happens when something is missing or refused, is decided in `Aiding`.
"""

import math
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import mechanisation
from autopilot_bridge.navigation.aiding import HAS_RANGE, Aiding
from autopilot_bridge.navigation.alignment import Alignment
from autopilot_bridge.navigation.external import ExternalCounts, ExternalSample
from autopilot_bridge.navigation.fusion import HAS_BARO, HAS_GPS, HAS_MAG, UNSOUND
from autopilot_bridge.navigation.health import NavigationHealth
from autopilot_bridge.navigation.layout import (
    AIRSPEED_M_S,
    AIRSPEED_TRUE_M_S,
    HEIGHT_ABOVE_GROUND_M,
    NAV_SIZE,
    Q_NED_FROM_FRD,
    WIND_NED_M_S,
)
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.solution import Solution
from autopilot_bridge.navigation.states import GYRO, GYRO_LAST, HISTORY_Q
from flightsim.foundation.geodesy import FrameAt, GeodeticPosition, LocalFrame
from flightsim.foundation.kernels import bound
from flightsim.interface import SensorReadings

FIXED_IN_FLIGHT: Final = (
    "covariance_rate_hz",
    "history_s",
    "alignment_time_s",
    "fixed_wing",
    "gyro_bias_rad_s",
    "accel_bias_m_s2",
    "gps_check_time_s",
    "gps_may_repeat",
    "mag_ned_gauss",
    "magnetic_year",
)
"""Fields of `NavigationParameters` that size buffers, or were used up when the filter started."""


class NavigationFilter:
    """Estimates attitude, velocity, position and sensor errors from `SensorReadings`.

    Attributes:
        state: float64[NAV_SIZE], layout in `navigation/layout.py`, written by every `step`. Before alignment
            the attitude is level and everything else zero; see `health.uninitialised`.
        health: what is valid, what is used.
        vehicle_at_rest: set by the land detector: the vehicle stands still on the ground.
    """

    def __init__(
        self,
        parameters: NavigationParameters,
        *,
        readings: SensorReadings,
        physics_rate_hz: int,
        frame_at: FrameAt = LocalFrame,
    ) -> None:
        """A filter that reads `readings` and has not aligned yet.

        Args:
            parameters: tuning.
            readings: written in place by the sensors before each `step`.
            physics_rate_hz: calls of `step` per second.
            frame_at: the kind of its NED frame.

        Raises:
            ValueError: `covariance_rate_hz` does not divide the physics rate.
        """
        if physics_rate_hz <= 0 or physics_rate_hz % parameters.covariance_rate_hz:
            raise ValueError(
                f"covariance_rate_hz {parameters.covariance_rate_hz} is not accepted: "
                f"it must divide the physics rate of {physics_rate_hz} Hz"
            )
        if 1_000_000 % physics_rate_hz:
            raise ValueError(
                f"physics_rate_hz {physics_rate_hz} is not accepted: its period must be whole microseconds"
            )
        self._parameters = parameters
        self._readings = readings
        self._imu = readings.imu
        self._dt_s = 1.0 / physics_rate_hz
        self._divisor = physics_rate_hz // parameters.covariance_rate_hz
        self._limits = (parameters.gyro_range_rad_s, parameters.accel_range_m_s2, parameters.imu_timeout_s)
        self.state: NDArray[np.float64] = np.zeros(NAV_SIZE)
        self.health = NavigationHealth()
        self.vehicle_at_rest = False
        self._alignment = Alignment(duration_s=parameters.alignment_time_s, dt_s=self._dt_s)
        self._solution = Solution(parameters, physics_rate_hz=physics_rate_hz)
        solution, imu = self._solution, readings.imu
        self._mechanise = bound(
            mechanisation.step,
            solution.core,
            self.state,
            solution.history,
            imu.values,
            self._dt_s,
            *map(float, self._limits),
            then=(imu.fresh, solution.row),
        )
        self._slow_readings = (
            (readings.magnetometer, HAS_MAG),
            (readings.barometer, HAS_BARO),
            (readings.rangefinder, HAS_RANGE),
            (readings.gps, HAS_GPS),
        )
        self._taken_us = [-1] * len(self._slow_readings)
        self._aiding = Aiding(
            parameters, readings=readings, solution=self._solution, health=self.health, frame_at=frame_at
        )
        self.reset()

    @property
    def origin(self) -> GeodeticPosition | None:
        """Origin of the NED frame; None before the first good GPS fix. It survives `reset`."""
        frame = self._aiding.frame
        return None if frame is None else frame.origin

    @property
    def frame(self) -> LocalFrame | None:
        """The NED frame at `origin`."""
        return self._aiding.frame

    @property
    def covariance(self) -> NDArray[np.float64]:
        """Read-only view of the error state's covariance (`navigation/states.py`): (22, 22), with wind (24,
        24)."""
        view = self._solution.p.view()
        view.flags.writeable = False
        return view

    @property
    def parameters(self) -> NavigationParameters:
        """The tuning in use."""
        return self._parameters

    def take_external(self, sample: ExternalSample) -> None:
        """Pose and velocity measured by an external system; fused at the next update if they pass the checks.

        They may hold anything: what can't be used is counted (`external_counts`).
        """
        if self._aligned:
            self._aiding.take_external(sample)

    def past_pose(
        self, measured_us: int, time_us: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """(position NED m, q_ned_from_frd) at a past time, as seen now; None when it's too long ago.

        Args:
            measured_us: that time.
            time_us: the present.
        """
        solution = self._solution
        row = solution.row_at(measured_us, time_us) if self._aligned else -1
        if row < 0:
            return None
        return solution.past_position(row), solution.history[row, HISTORY_Q : HISTORY_Q + 4].copy()

    @property
    def external_counts(self) -> ExternalCounts | None:
        """What became of external odometry; None while none has come."""
        external = self._aiding.external
        return None if external is None else external.counts

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """Take new tuning from the next update on; the estimate and its covariance stay.

        `FIXED_IN_FLIGHT` fields keep their values: the firmwares take those at the next boot.
        """
        kept = {name: getattr(self._parameters, name) for name in FIXED_IN_FLIGHT}
        p = replace(parameters, **kept)
        if p == self._parameters:
            return
        self._parameters = p
        self._limits = (p.gyro_range_rad_s, p.accel_range_m_s2, p.imu_timeout_s)
        self._solution.set_parameters(p)
        self._aiding.set_parameters(p)

    def set_origin(self, origin: GeodeticPosition) -> None:
        """Set the origin from outside (SET_GPS_GLOBAL_ORIGIN).

        Raises:
            ValueError: there is an origin already; positions refer to it.
        """
        if self._aiding.frame is not None:
            raise ValueError(f"origin {origin} is not accepted: the filter has one already, {self.origin}")
        self._aiding.set_origin(origin)

    def reset(self) -> None:
        """Forget the estimate and align again. The origin and the reset counters stay."""
        self._aligned = False
        self._take_pending()  # and forget them
        self._countdown = self._divisor
        self._alignment.restart()
        self._solution.clear()
        self._aiding.restart()
        self.health.clear()
        self.state[:] = 0.0
        self.state[Q_NED_FROM_FRD] = 1.0, 0.0, 0.0, 0.0
        self.state[HEIGHT_ABOVE_GROUND_M] = math.nan
        self.state[WIND_NED_M_S] = math.nan
        self.state[AIRSPEED_M_S] = self.state[AIRSPEED_TRUE_M_S] = math.nan

    def step(self, time_us: int) -> None:
        """One physics step at vehicle time `time_us`: take fresh readings, write `state`."""
        if not self._aligned:
            self._align(time_us)
            return
        solution = self._solution
        row = solution.row + 1
        if row == solution.rows:
            row = 0
        solution.row = row
        self._mechanise(self._imu.fresh, row)
        self._countdown -= 1
        if self._countdown == 0:
            self._countdown = self._divisor
            pending = self._take_pending()
            solution.steps += self._divisor
            self._aiding.at_rest = self.vehicle_at_rest
            if self._aiding.update(time_us, pending) & UNSOUND:
                self.health.filter_resets += 1
                self.reset()
            elif self._aiding.air is not None:
                self._aiding.air.write(self.state, self._divisor * self._dt_s)

    def _take_pending(self) -> int:
        """Bits of the readings that have been delivered since the last call."""
        pending = 0
        for index, (reading, bit) in enumerate(self._slow_readings):
            if reading.time_us != self._taken_us[index]:
                self._taken_us[index] = reading.time_us
                pending |= bit
        return pending

    def _align(self, time_us: int) -> None:
        alignment = self._alignment
        alignment.step(self._readings)
        if not alignment.ready:
            return
        mechanisation.take_sample(self._solution.core, self._readings.imu.values, *self._limits[:2])
        core = self._solution.core
        core[GYRO_LAST : GYRO_LAST + 3] = core[GYRO : GYRO + 3]
        self._aiding.align(time_us, alignment.accel_frd_m_s2, alignment.mag_frd_gauss)
        mechanisation.write_navigation(core, self.state)
        self._take_pending()  # what came before is no news
        self._aligned = True
        self.health.uninitialised = False
