"""The heading: from the magnetometer, and corrected when the field or the flight shows that it was wrong."""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import fusion as f
from autopilot_bridge.navigation.aiding_parts import AidingParts
from autopilot_bridge.navigation.alignment import magnetic_heading_rad
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.states import R
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.magnetics import magnetic_field_ned_gauss

_REFUSED_US: Final = 800_000
_CONFIRMED_US: Final = 10_000_000
_LEAST_ANGLE_RAD: Final = math.radians(15.0)  # less is drift in the wind, and is found by filtering


class HeadingCheck:
    """Watches GPS velocities from the launch until the heading is confirmed.

    Attributes:
        magnetometer_wrong: found so in this flight.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Before a launch."""
        self.magnetometer_wrong = False
        self._confirmed = False
        self._since_us = -1
        self._refused_since_us = -1

    def judge(self, time_us: int, *, accepted: bool, course_rad: float, yaw_rad: float) -> float:
        """A GPS velocity in fast flight was fused or refused; the angle to turn the heading by, or 0."""
        if self._confirmed:
            return 0.0
        if accepted:
            self._refused_since_us = -1
            if self._since_us < 0:
                self._since_us = time_us
            self._confirmed = time_us - self._since_us >= _CONFIRMED_US
            return 0.0
        self._since_us = -1
        if self._refused_since_us < 0:
            self._refused_since_us = time_us
        angle = math.remainder(course_rad - yaw_rad, 2.0 * math.pi)
        if time_us - self._refused_since_us < _REFUSED_US or abs(angle) < _LEAST_ANGLE_RAD:
            return 0.0
        self._refused_since_us = -1
        self.magnetometer_wrong = True
        return angle


Array = NDArray[np.float64]


class HeadingAiding:
    """Prepares magnetometer updates of a `Solution`, and turns its yaw."""

    def __init__(self, parameters: NavigationParameters, parts: AidingParts) -> None:
        self._parameters = parameters
        self._reading = parts.readings.magnetometer
        self._solution, self._health, self._clocks = parts.solution, parts.health, parts.clocks
        self._check = HeadingCheck()
        self._field_ned_gauss: Array | None = None
        if parameters.mag_ned_gauss is not None:
            self._field_ned_gauss = np.array(parameters.mag_ned_gauss)

    def restart(self) -> None:
        """As at boot, but for the field of the place."""
        self._check.restart()
        if self._field_ned_gauss is not None:
            self._solution.obs[f.MAG_NED : f.MAG_NED + 3] = self._field_ned_gauss

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New tuning for the samples to come."""
        self._parameters = parameters

    def set_place(self, origin: GeodeticPosition) -> None:
        """The field is that of this place, unless it was given."""
        p, obs = self._parameters, self._solution.obs
        if p.mag_ned_gauss is not None:
            return
        field = magnetic_field_ned_gauss(origin.lat_deg, origin.lon_deg, origin.alt_m, p.magnetic_year)
        self._field_ned_gauss = field
        before = math.atan2(obs[f.MAG_NED + 1], obs[f.MAG_NED])
        obs[f.MAG_NED : f.MAG_NED + 3] = field
        if self._health.yaw_aligned:
            self._turn(math.atan2(field[1], field[0]) - before)

    def yaw_from_field(self, mag_frd_gauss: Array, roll_rad: float, pitch_rad: float) -> float:
        """Yaw from the field; without a known field the one measured, with its horizontal part to the
        north."""
        heading, horizontal, down = magnetic_heading_rad(mag_frd_gauss, roll_rad, pitch_rad)
        field = self._field_ned_gauss
        if field is None:
            self._solution.obs[f.MAG_NED : f.MAG_NED + 3] = horizontal, 0.0, down
            return heading
        return heading + math.atan2(field[1], field[0])

    def align_with_course(self, north_m_s: float, east_m_s: float) -> bool:
        """Without a magnetometer, set the heading of a wing to its course; True if it was set."""
        if math.hypot(north_m_s, east_m_s) < self._parameters.airspeed_threshold_m_s:
            return False
        self._turn(math.atan2(east_m_s, north_m_s) - self._yaw_rad())
        self._health.yaw_aligned = True
        return True

    def check_with_course(self, time_us: int, *, accepted: bool, at_rest: bool) -> bool:
        """A wing's heading that was wrong on the ground shows in the first seconds of a flight, by GPS
        velocities that are refused; True when it has been turned."""
        obs = self._solution.obs
        north, east = float(obs[f.GPS_VEL]), float(obs[f.GPS_VEL + 1])
        if at_rest:
            self._check.restart()
        elif math.hypot(north, east) > self._parameters.airspeed_threshold_m_s:
            course = math.atan2(east, north)
            angle = self._check.judge(time_us, accepted=accepted, course_rad=course, yaw_rad=self._yaw_rad())
            if angle:
                self._turn(angle)
                return True
        return False

    def prepare(self, time_us: int) -> int:
        """Write the newest magnetometer sample into `obs`; its row of the history, -1: not to be used."""
        reading, solution, health = self._reading, self._solution, self._health
        row = solution.row_at(reading.time_us, time_us)
        norm = math.hypot(*reading.values.tolist())
        if row < 0 or not 0.05 < norm < 2.0 or self._check.magnetometer_wrong:
            return -1
        if not health.yaw_aligned:
            rotation = solution.core[R : R + 9]
            roll, pitch = math.atan2(rotation[7], rotation[8]), math.asin(max(-1.0, min(1.0, -rotation[6])))
            heading = self.yaw_from_field(reading.values, roll, pitch)
            health.yaw_aligned = True
            self._turn(heading - self._yaw_rad())
        solution.obs[f.MAG : f.MAG + 3] = reading.values
        return row

    def note(self, time_us: int, *, accepted: bool) -> None:
        """The sample was fused or refused. If samples arrive but are refused for a long time, the
        magnetometer's bias may have changed, and is learnt again.
        """
        clocks = self._clocks
        if accepted:
            clocks.mag_us = clocks.mag_refused_us = time_us
            return
        since_us = max(clocks.mag_refused_us, clocks.aligned_us)
        if time_us - since_us > self._parameters.magnetometer_timeout_s * 1e6:
            self._solution.forget_mag_bias()
            clocks.mag_refused_us = time_us

    def _yaw_rad(self) -> float:
        rotation = self._solution.core[R : R + 9]
        return math.atan2(rotation[3], rotation[0])

    def _turn(self, angle_rad: float) -> None:
        self._solution.turn_yaw(angle_rad, yaw_sigma_rad=self._parameters.alignment_yaw_rad)
        self._health.yaw_resets += 1
        self._health.yaw_reset_rad = angle_rad
