"""Quality checks of the receiver's fix: PX4's EKF2_REQ_* checks, with a time they must hold.

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

from autopilot_bridge.navigation.parameters import NavigationParameters
from flightsim.foundation.vectors import wrap_180
from flightsim.interface import (
    GPS_ALT_M,
    GPS_EPH_M,
    GPS_EPV_M,
    GPS_FIX_TYPE,
    GPS_HDOP,
    GPS_LAT_DEG,
    GPS_LON_DEG,
    GPS_SATELLITES,
    GPS_SIZE,
    GPS_SPEED_ACCURACY_M_S,
    GPS_VEL_NED_M_S,
)

_M_PER_DEG: Final = 111_200.0
_WINDOW_US: Final = 2_000_000
_ALLOWED_M: Final = 1.5
_ALLOWED_SIGMAS: Final = 4.0
_FROZEN_SAMPLES: Final = 5  # equal ones in a row: a second of a usual receiver
_MEASURED: Final = slice(GPS_LAT_DEG, GPS_VEL_NED_M_S.stop)


class GpsQuality:
    """Judges each sample, and remembers since when they have been good.

    Attributes:
        good: the newest sample passes.
        good_since_us: time of the first sample of the present good series; -1 when the newest one failed.
    """

    def __init__(self, parameters: NavigationParameters) -> None:
        self._parameters = parameters
        self._last = self._anchor = self._previous = [0.0] * GPS_SIZE
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
        north, east, down = values[GPS_VEL_NED_M_S]
        self.good = (
            values[GPS_FIX_TYPE] >= 3.0
            and values[GPS_SATELLITES] >= p.gps_required_satellites
            and 0.0 <= values[GPS_EPH_M] <= p.gps_required_eph_m
            and 0.0 <= values[GPS_EPV_M] <= p.gps_required_epv_m
            and 0.0 <= values[GPS_SPEED_ACCURACY_M_S] <= p.gps_required_speed_accuracy_m_s
            and 0.0 <= values[GPS_HDOP] <= p.gps_required_hdop
            and abs(values[GPS_LAT_DEG]) <= 90.0
            and abs(values[GPS_LON_DEG]) <= 180.0
            and abs(values[GPS_ALT_M]) <= 1.0e5
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
            zip(values[GPS_VEL_NED_M_S], self._last[GPS_VEL_NED_M_S], strict=True)
        ):
            travelled[i] += half_s * (now + before)
        north_m = (values[GPS_LAT_DEG] - anchor[GPS_LAT_DEG]) * _M_PER_DEG
        dlon = wrap_180(values[GPS_LON_DEG] - anchor[GPS_LON_DEG])
        east_m = dlon * _M_PER_DEG * math.cos(math.radians(values[GPS_LAT_DEG]))
        down_m = anchor[GPS_ALT_M] - values[GPS_ALT_M]
        north, east, down = travelled
        allowed_m = _ALLOWED_SIGMAS * math.hypot(values[GPS_EPH_M], values[GPS_EPV_M]) + _ALLOWED_M
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
