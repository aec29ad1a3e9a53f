"""The height: from barometer and GPS together, each gone over to when it has been refused for long."""

import math
from typing import Final

from autopilot_bridge.navigation import fusion as f
from autopilot_bridge.navigation.aiding_parts import AidingParts
from autopilot_bridge.navigation.parameters import NavigationParameters
from autopilot_bridge.navigation.states import X_BARO_OFFSET, X_POS, X_VEL
from autopilot_bridge.navigation.terrain import TerrainEstimator
from flightsim.foundation.atmosphere import pressure_altitude_m
from flightsim.interface import BARO_PRESSURE_PA

_GAP_US: Final = 2_000_000  # silence after which a sensor's refusal is counted from the beginning
_GPS_FRESH_US: Final = 1_000_000

_BAND_M: Final = 4.0
_COHERENCE_M: Final = 30.0  # height difference over which the error is assumed to add up evenly


class PressureScale:
    """Turns pressure altitudes into growth of the barometer offset's variance.

    On a day warmer or colder than the standard one, a metre of pressure altitude is some per cent more or
    less of height (15 K: five per cent). The error is the same on the way up and down, so it is computed from
    the height differences between turning points; differences within a band are turbulence and are ignored.
    """

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """As at boot."""
        self._reference_m = math.nan

    def variance_m2(self, altitude_m: float, scale_error: float) -> float:
        """What to add for the newest pressure altitude; `scale_error` is the 1-sigma of the scale."""
        reference = self._reference_m
        if math.isnan(reference):
            self._reference_m = altitude_m
            return 0.0
        nearest = min(altitude_m + _BAND_M, max(altitude_m - _BAND_M, reference))
        self._reference_m = nearest
        return scale_error * scale_error * _COHERENCE_M * abs(nearest - reference)


class HeightAiding:
    """Prepares barometer updates of a `Solution`, and has its height jump where that is due."""

    def __init__(
        self, parameters: NavigationParameters, parts: AidingParts, *, terrain: TerrainEstimator
    ) -> None:
        self._parameters = parameters
        self._reading = parts.readings.barometer
        self._solution, self._health, self._clocks = parts.solution, parts.health, parts.clocks
        self._contradictions = parts.contradictions
        self._terrain = terrain
        self._pressure_scale = PressureScale()
        self.restart()

    def restart(self) -> None:
        """As at boot."""
        self._baro_known = False
        self._gps_known = False
        self._pressure_scale.restart()

    def set_parameters(self, parameters: NavigationParameters) -> None:
        """New tuning for the samples to come."""
        self._parameters = parameters

    def prepare_barometer(self, time_us: int) -> int:
        """Write the newest pressure altitude into `obs`; its row of the history, -1: not to be used."""
        reading, solution = self._reading, self._solution
        height = pressure_altitude_m(float(reading.values[BARO_PRESSURE_PA]))
        lag_us = round(self._parameters.barometer_lag_s * 1e6)
        row = solution.row_at(reading.time_us - lag_us, time_us)
        if row < 0 or not math.isfinite(height):
            return -1
        solution.obs[f.BARO_HEIGHT] = height
        solution.obs[f.BARO_DELAY_S] = max(0, time_us - reading.time_us + lag_us) * 1e-6
        if not self._baro_known:
            self._baro_known = True
            solution.set_baro_offset(height + float(solution.past_position(row)[2]))
        return row

    def note_barometer(self, time_us: int, *, accepted: bool) -> None:
        """The pressure altitude was fused or refused."""
        if not accepted:
            self._refused(time_us)
            return
        self._clocks.baro_us = self._clocks.height_us = time_us
        height = float(self._solution.obs[f.BARO_HEIGHT])
        grown = self._pressure_scale.variance_m2(height, self._parameters.barometer_scale_error)
        if grown > 0.0:
            self._solution.widen_baro_offset(grown)

    def follow_gps(self, row: int, time_us: int) -> None:
        """Before a GPS height is fused: the first one sets the height, and so does one refused for long."""
        clocks = self._clocks
        if not self._gps_known:
            self._reset_to_gps(row, time_us)
        elif (
            clocks.gps_height_refused_us >= 0
            and time_us - clocks.gps_height_refused_us > self._parameters.gps_timeout_s * 1e6
        ):
            self._contradictions.note(time_us)
            self._reset_to_gps(row, time_us)

    def note_gps(self, time_us: int, *, accepted: bool) -> None:
        """The GPS height was fused or refused (before the clock of GPS samples judged goes on)."""
        clocks = self._clocks
        if accepted:
            clocks.gps_height_us = clocks.height_us = time_us
            clocks.gps_height_refused_us = -1
        elif clocks.gps_height_refused_us < 0 or time_us - clocks.gps_judged_us > _GAP_US:
            clocks.gps_height_refused_us = time_us

    def _reset_to_gps(self, row: int, time_us: int) -> None:
        solution, obs = self._solution, self._solution.obs
        down = float(obs[f.GPS_POS + 2] - solution.past_position(row)[2])
        # The height takes over the error of this fix, which is as large as the receiver reports.
        solution.forget_gps_height_error()
        solution.move_vertically(down, with_baro=self._baro_known)
        solution.change_vertical_velocity(float(obs[f.GPS_VEL + 2] - solution.past_velocity(row)[2]))
        self._clocks.gps_height_us = time_us
        self._clocks.gps_height_refused_us = -1
        self._gps_known = True
        self._has_jumped(down)

    def _refused(self, time_us: int) -> None:
        """Refused for too long: with GPS heights learn the offset again; without them the height jumps."""
        clocks, solution = self._clocks, self._solution
        since_us = max(clocks.baro_us, clocks.aligned_us)
        if time_us - since_us <= self._parameters.height_timeout_s * 1e6:
            return
        offset = solution.obs[f.BARO_HEIGHT] + solution.core[X_POS + 2]
        if time_us - clocks.gps_height_us <= _GPS_FRESH_US and clocks.gps_height_us >= 0:
            solution.set_baro_offset(float(offset))
        else:
            down = float(solution.core[X_BARO_OFFSET] - offset)
            solution.move_vertically(down, with_baro=False)
            solution.change_vertical_velocity(-float(solution.core[X_VEL + 2]))
            self._contradictions.note(time_us)
            self._has_jumped(down)
        clocks.baro_us = time_us

    def _has_jumped(self, down_m: float) -> None:
        self._terrain.shift(down_m)
        self._health.height_resets += 1
        self._health.height_reset_down_m = down_m
