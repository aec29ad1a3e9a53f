"""GPS in the filter: after its quality checks, gone over to when it has been refused for long, rejoined by a
wing that found its way without it."""

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import fusion as f
from autopilot_bridge.navigation.aiding_parts import AidingParts
from autopilot_bridge.navigation.gps_quality import GpsQuality
from autopilot_bridge.navigation.heading_aiding import HeadingAiding
from autopilot_bridge.navigation.height_aiding import HeightAiding
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.solution import UNKNOWN_VELOCITY_M_S
from autopilot_bridge.navigation.states import X_POS
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.interface import (
    GPS_ALT_M,
    GPS_EPH_M,
    GPS_EPV_M,
    GPS_LAT_DEG,
    GPS_LON_DEG,
    GPS_SPEED_ACCURACY_M_S,
    GPS_VEL_NED_M_S,
)

Array = NDArray[np.float64]

_UNKNOWN_VARIANCE_M2_S2 = 1e4


class GpsAiding:
    """Prepares GPS updates of a `Solution`.

    Attributes:
        frame: NED frame at the origin; None before it is set, by the first good fix or from outside.
        quality: judge of the receiver.
    """

    def __init__(
        self,
        parameters: NavigationParameters,
        parts: AidingParts,
        *,
        heading: HeadingAiding,
        height: HeightAiding,
    ) -> None:
        self._parameters = parameters
        self._reading = parts.readings.gps
        self._solution, self._health, self._clocks = parts.solution, parts.health, parts.clocks
        self._contradictions, self._standby = parts.contradictions, parts.standby
        self._heading = heading
        self._height = height
        self.quality = GpsQuality(parameters)
        self.frame: LocalFrame | None = None
        self._before_rejoining: Array | None = None

    def restart(self) -> None:
        """As at boot, but for the frame."""
        self.quality.restart()
        self._before_rejoining = None

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New tuning for the samples to come."""
        self._parameters = parameters
        self.quality.set_parameters(parameters)

    def set_origin(self, origin: GeodeticPosition) -> None:
        """Fix the NED frame; gravity, Earth's rotation and the magnetic field follow from it."""
        self.frame = LocalFrame(origin)
        self._solution.set_latitude(origin.lat_deg, origin.alt_m)
        self._heading.set_place(origin)

    def prepare(self, time_us: int) -> int:
        """Write the newest fix into `obs`, and go over to it where that is due; its row of the history, -1:
        it is not to be used."""
        reading, solution = self._reading, self._solution
        values, p = reading.values, self._parameters
        usable = self.quality.judge(values, reading.time_us, time_us)
        row = solution.row_at(reading.time_us, time_us)
        if not (usable and p.use_gps) or row < 0:
            return -1
        north, east, _ = values[GPS_VEL_NED_M_S]
        if not self._health.yaw_aligned and not (
            p.fixed_wing and self._heading.align_with_course(north, east)
        ):
            return -1
        self._write(values, max(0, time_us - reading.time_us) * 1e-6, row)
        clocks = self._clocks
        timeout_us = p.gps_timeout_s * 1e6
        rejoins = False
        if self._standby.held or clocks.gps_position_us < 0:
            self._reset(row, time_us)
        elif p.fixed_wing and time_us - clocks.gps_judged_us > timeout_us:
            rejoins = True  # the covariance has grown with the error: the gate can judge it
            clocks.gps_position_us = clocks.gps_velocity_us = time_us
        elif time_us - min(clocks.gps_position_us, clocks.gps_velocity_us) > timeout_us:
            self._contradictions.note(time_us)
            self._reset(row, time_us)
        self._height.follow_gps(row, time_us)
        self._before_rejoining = solution.core[X_POS : X_POS + 2].copy() if rejoins else None
        return row

    def note(self, time_us: int, row: int, accepted: int, *, at_rest: bool) -> None:
        """Record the accepted parts (bits of `fusion`) of the prepared fix."""
        clocks, health, obs = self._clocks, self._health, self._solution.obs
        velocity, position = bool(accepted & f.ACCEPTED_GPS_VEL), bool(accepted & f.ACCEPTED_GPS_POS)
        if velocity:
            clocks.gps_velocity_us = time_us
        if position:
            clocks.gps_position_us = time_us
        self._height.note_gps(time_us, accepted=bool(accepted & f.ACCEPTED_GPS_HEIGHT))
        clocks.gps_judged_us = time_us
        if velocity or position:
            clocks.gps_us = clocks.horizontal_aid_us = time_us
        health.gps_glitch = not (velocity and position)
        health.velocity_test_ratio = float(obs[f.RATIO_VEL])
        health.position_horizontal_test_ratio = float(obs[f.RATIO_POS])
        if self._parameters.fixed_wing and self._heading.check_with_course(
            time_us, accepted=velocity, at_rest=at_rest
        ):
            self._reset(row, time_us)
        if self._before_rejoining is not None:
            self._rejoined(self._solution.core[X_POS : X_POS + 2] - self._before_rejoining)
            self._before_rejoining = None

    def _write(self, values: Array, delay_s: float, row: int) -> None:
        p, solution, obs = self._parameters, self._solution, self._solution.obs
        lat, lon, alt = float(values[GPS_LAT_DEG]), float(values[GPS_LON_DEG]), float(values[GPS_ALT_M])
        if self.frame is None:
            down = float(solution.past_position(row)[2])
            self.set_origin(GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt + down))
        assert self.frame is not None
        obs[f.GPS_POS : f.GPS_POS + 3] = self.frame.ned_from_geodetic(lat, lon, alt)
        obs[f.GPS_VEL : f.GPS_VEL + 3] = values[GPS_VEL_NED_M_S]
        obs[f.GPS_DELAY_S] = delay_s
        horizontal, vertical = p.gps_position_noise_m
        obs[f.GPS_POS_VAR] = obs[f.GPS_POS_VAR + 1] = horizontal * horizontal
        obs[f.GPS_POS_VAR + 2] = vertical * vertical
        horizontal, vertical = p.gps_velocity_noise_m_s
        scale = max(1.0, float(values[GPS_SPEED_ACCURACY_M_S]) / horizontal) ** 2
        for i, noise in enumerate((horizontal, horizontal, vertical)):
            obs[f.GPS_VEL_VAR + i] = scale * noise * noise
            if obs[f.GPS_VEL + i] != obs[f.GPS_VEL + i]:  # not measured: it adds no information
                obs[f.GPS_VEL + i] = solution.past_velocity(row)[i]
                obs[f.GPS_VEL_VAR + i] = _UNKNOWN_VARIANCE_M2_S2
        solution.set_gps_accuracy(float(values[GPS_EPH_M]), float(values[GPS_EPV_M]))

    def _reset(self, row: int, time_us: int) -> None:
        """Horizontal position and velocity jump to the GPS; the update that follows gives them their
        variances."""
        solution, obs, health, clocks = self._solution, self._solution.obs, self._health, self._clocks
        step = obs[f.GPS_POS : f.GPS_POS + 3] - solution.past_position(row)
        change = obs[f.GPS_VEL : f.GPS_VEL + 3] - solution.past_velocity(row)
        solution.move_horizontally(float(step[0]), float(step[1]))
        solution.change_velocity(float(change[0]), float(change[1]), sigma_m_s=UNKNOWN_VELOCITY_M_S)
        self._standby.release()
        clocks.horizontal_aid_us = clocks.gps_position_us = clocks.gps_velocity_us = time_us
        health.position_resets += 1
        health.position_reset_ne_m = (float(step[0]), float(step[1]))

    def _rejoined(self, jump: Array) -> None:
        """The first fix after dead reckoning has moved the position by what had built up."""
        health = self._health
        health.position_resets += 1
        health.position_reset_ne_m = (float(jump[0]), float(jump[1]))
