"""GPS in the filter: after its quality checks, gone over to when it has been refused for long, rejoined by a
wing that found its way without it.

Quality checks of the receiver's fix: PX4's EKF2_REQ_* checks, with a time they must hold.

Two additional checks. Over two seconds the change of position must agree approximately with the velocity;
otherwise a receiver with wrong but plausible values would be used once the filter has no other source. And a
receiver whose values repeat exactly no longer measures: with its constant velocity the filter would make the
vehicle fly faster and faster without detecting it.

A velocity, or its vertical part, may be NaN: not known.
"""

import math
from typing import Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.navigation import fusion as f
from autopilot_bridge.navigation.aiding_parts import AidingParts
from autopilot_bridge.navigation.heading_aiding import HeadingAiding
from autopilot_bridge.navigation.height_aiding import HeightAiding
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.solution import UNKNOWN_VELOCITY_M_S
from autopilot_bridge.navigation.states import X_POS
from flightsim import interface as interface
from flightsim.foundation.geodesy import FrameAt, GeodeticPosition, LocalFrame
from flightsim.foundation.vectors import wrap_180

_M_PER_DEG: Final = 111_200.0
_WINDOW_US: Final = 2_000_000
_ALLOWED_M: Final = 1.5
_ALLOWED_SIGMAS: Final = 4.0
_FROZEN_SAMPLES: Final = 5  # equal ones in a row: a second of a usual receiver
_MEASURED: Final = slice(interface.GPS_LAT_DEG, interface.GPS_VEL_NED_M_S.stop)


class GpsQuality:
    """Judges each sample, and remembers since when they have been good.

    Attributes:
        good: the newest sample passes.
        good_since_us: time of the first sample of the present good series; -1 when the newest one failed.
    """

    def __init__(self, parameters: NavigationParameters) -> None:
        self._parameters = parameters
        self._last = self._anchor = self._previous = [0.0] * interface.GPS_SIZE
        self._travelled = [0.0] * 3
        self.restart()

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New thresholds for the samples to come."""
        self._parameters = parameters

    def restart(self) -> None:
        """Forget the past."""
        self.good = False
        self.good_since_us = -1
        self._newest_us = -1
        self._last_us = -1
        self._anchor_us = -1
        self._distrusted = False
        self._equal = 0

    def judge(self, sample: NDArray[np.float64], measured_us: int, time_us: int) -> bool:
        """Take a sample received at `time_us`; True when it is good and the checks have held long enough."""
        p, values = self._parameters, sample.tolist()
        if self._newest_us >= 0 and time_us - self._newest_us > 2_000_000:
            self.good_since_us = -1  # silence ends a series
        self._newest_us = time_us
        north, east, down = values[interface.GPS_VEL_NED_M_S]
        self.good = (
            values[interface.GPS_FIX_TYPE] >= 3.0
            and values[interface.GPS_SATELLITES] >= p.gps_required_satellites
            and 0.0 <= values[interface.GPS_EPH_M] <= p.gps_required_eph_m
            and 0.0 <= values[interface.GPS_EPV_M] <= p.gps_required_epv_m
            and 0.0 <= values[interface.GPS_SPEED_ACCURACY_M_S] <= p.gps_required_speed_accuracy_m_s
            and 0.0 <= values[interface.GPS_HDOP] <= p.gps_required_hdop
            and abs(values[interface.GPS_LAT_DEG]) <= 90.0
            and abs(values[interface.GPS_LON_DEG]) <= 180.0
            and abs(values[interface.GPS_ALT_M]) <= 1.0e5
            and math.hypot(*_known((north, east, down))) <= 1.0e3
        )
        if self._repeats_itself(values) and not p.gps_may_repeat:
            self.good = False
        if self.good and not self._moves_as_it_says(values, measured_us):
            self.good = False
            self._distrusted = True
        if not self.good:
            self.good_since_us = -1
            self._anchor_us = -1
            return False
        if self.good_since_us < 0:
            self.good_since_us = time_us
        proven_us = time_us - self.good_since_us
        if self._distrusted:
            self._distrusted = proven_us < _WINDOW_US
        return not self._distrusted and proven_us >= round(p.gps_check_time_s * 1e6)

    def _repeats_itself(self, values: list[float]) -> bool:
        """Position and velocity have been the same, digit by digit, for too long."""
        if values[_MEASURED] == self._previous[_MEASURED]:
            self._equal += 1
        else:
            self._equal = 0
            self._previous = values
        return self._equal >= _FROZEN_SAMPLES

    def _moves_as_it_says(self, values: list[float], measured_us: int) -> bool:
        """Compare position with the velocity's integral since an anchor up to two seconds ago."""
        anchor, travelled = self._anchor, self._travelled
        elapsed_us = measured_us - self._last_us
        if self._anchor_us < 0 or not 0 < elapsed_us <= _WINDOW_US:
            self._set_anchor(values, measured_us)
            return True
        half_s = 0.5e-6 * elapsed_us
        for i, (now, before) in enumerate(
            zip(values[interface.GPS_VEL_NED_M_S], self._last[interface.GPS_VEL_NED_M_S], strict=True)
        ):
            travelled[i] += half_s * (now + before)
        north_m = (values[interface.GPS_LAT_DEG] - anchor[interface.GPS_LAT_DEG]) * _M_PER_DEG
        dlon = wrap_180(values[interface.GPS_LON_DEG] - anchor[interface.GPS_LON_DEG])
        east_m = dlon * _M_PER_DEG * math.cos(math.radians(values[interface.GPS_LAT_DEG]))
        down_m = anchor[interface.GPS_ALT_M] - values[interface.GPS_ALT_M]
        north, east, down = travelled
        allowed_m = (
            _ALLOWED_SIGMAS * math.hypot(values[interface.GPS_EPH_M], values[interface.GPS_EPV_M])
            + _ALLOWED_M
        )
        apart_m = _known((north_m - north, east_m - east, down_m - down))
        coherent = math.hypot(*apart_m) <= allowed_m
        if measured_us - self._anchor_us >= _WINDOW_US:
            self._set_anchor(values, measured_us)
        else:
            self._last = values
            self._last_us = measured_us
        return coherent

    def _set_anchor(self, values: list[float], measured_us: int) -> None:
        self._anchor = self._last = values
        self._anchor_us = self._last_us = measured_us
        self._travelled = [0.0] * 3

    def silent(self, time_us: int) -> None:
        """No sample lately: the receiver is not good."""
        if time_us - self._newest_us > 2_000_000:
            self.good = False


def _known(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    """Zero for what is not known."""
    x, y, z = vector
    return (0.0 if x != x else x, 0.0 if y != y else y, 0.0 if z != z else z)


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
        frame_at: FrameAt,
    ) -> None:
        self._parameters = parameters
        self._reading = parts.readings.gps
        self._solution, self._health, self._clocks = parts.solution, parts.health, parts.clocks
        self._contradictions, self._standby = parts.contradictions, parts.standby
        self._heading = heading
        self._height = height
        self._frame_at = frame_at
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
        self.frame = self._frame_at(origin)
        self._solution.set_frame(self.frame)
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
        north, east, _ = values[interface.GPS_VEL_NED_M_S]
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
        lat, lon, alt = (
            float(values[interface.GPS_LAT_DEG]),
            float(values[interface.GPS_LON_DEG]),
            float(values[interface.GPS_ALT_M]),
        )
        if self.frame is None:
            down = float(solution.past_position(row)[2])
            self.set_origin(GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt + down))
        assert self.frame is not None
        obs[f.GPS_POS : f.GPS_POS + 3] = self.frame.ned_from_geodetic(lat, lon, alt)
        obs[f.GPS_VEL : f.GPS_VEL + 3] = values[interface.GPS_VEL_NED_M_S]
        obs[f.GPS_DELAY_S] = delay_s
        horizontal, vertical = p.gps_position_noise_m
        obs[f.GPS_POS_VAR] = obs[f.GPS_POS_VAR + 1] = horizontal * horizontal
        obs[f.GPS_POS_VAR + 2] = vertical * vertical
        horizontal, vertical = p.gps_velocity_noise_m_s
        scale = max(1.0, float(values[interface.GPS_SPEED_ACCURACY_M_S]) / horizontal) ** 2
        for i, noise in enumerate((horizontal, horizontal, vertical)):
            obs[f.GPS_VEL_VAR + i] = scale * noise * noise
            if obs[f.GPS_VEL + i] != obs[f.GPS_VEL + i]:  # not measured: it adds no information
                obs[f.GPS_VEL + i] = solution.past_velocity(row)[i]
                obs[f.GPS_VEL_VAR + i] = _UNKNOWN_VARIANCE_M2_S2
        solution.set_gps_accuracy(float(values[interface.GPS_EPH_M]), float(values[interface.GPS_EPV_M]))

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
