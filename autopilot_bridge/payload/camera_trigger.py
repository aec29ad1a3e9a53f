"""When a camera takes photos automatically: a series at an interval, or by distance flown."""

import math
from typing import Final

MIN_INTERVAL_S: Final = 0.1
FOREVER: Final = -1
_MAX_S: Final = 86_400.0 * 30


class PhotoTrigger:
    """A series in time (IMAGE_START_CAPTURE) and a trigger by distance or time (DO_SET_CAM_TRIGG_*).

    Attributes:
        interval_us: interval of the running series; 0: single photo.
        left: photos of the series still to be taken; `FOREVER`: until stopped.
        distance_m: distance between photos; 0: off.
        enabled: the trigger by distance or cycle runs (DO_TRIGGER_CONTROL).
    """

    def __init__(self) -> None:
        self.interval_us = 0
        self.left = 0
        self.distance_m = 0.0
        self.enabled = True
        self.paused = False
        self._cycle_us = 0
        self._next_us = 0
        self._next_cycle_us = 0
        self._way_m = 0.0
        self._last_us = -1

    @property
    def series(self) -> bool:
        """A series is in progress."""
        return self.left != 0

    @property
    def running(self) -> bool:
        """Photos will be taken without another command."""
        return self.series or (
            self.enabled and not self.paused and (self.distance_m > 0 or self._cycle_us > 0)
        )

    def start(self, interval_s: float, count: int, time_us: int) -> bool:
        """Begin a series of `count` photos (0: unlimited) at once; False: invalid values."""
        if count < 0 or not MIN_INTERVAL_S <= interval_s <= _MAX_S:
            return False
        self.interval_us = round(interval_s * 1e6)
        self.left = count or FOREVER
        self._next_us = time_us
        return True

    def stop(self) -> None:
        """End the series."""
        self.left = 0
        self.interval_us = 0

    def set_distance(self, distance_m: float) -> bool:
        """Take a photo at every such distance; 0: stop."""
        if not 0.0 <= distance_m <= 1e6:
            return False
        self.distance_m, self._cycle_us = distance_m, 0
        self._way_m = 0.0
        self._last_us = -1
        self.enabled, self.paused = True, False
        return True

    def set_cycle(self, cycle_s: float, time_us: int) -> bool:
        """Take a photo at every such interval; 0: stop."""
        if cycle_s != 0.0 and not MIN_INTERVAL_S <= cycle_s <= _MAX_S:
            return False
        self._cycle_us, self.distance_m = round(cycle_s * 1e6), 0.0
        self._next_cycle_us = time_us
        self.enabled, self.paused = True, False
        return True

    def travelled(self, velocity_ned_m_s: tuple[float, float, float], time_us: int) -> bool:
        """The vehicle has reported its velocity; True: the distance for a photo has been flown.

        The distance is the ground speed multiplied by the time between two messages.
        """
        if self.distance_m <= 0.0:
            return False
        if self._last_us >= 0:
            elapsed_s = min(1.0, 1e-6 * (time_us - self._last_us))
            self._way_m += math.hypot(velocity_ned_m_s[0], velocity_ned_m_s[1]) * elapsed_s
        self._last_us = time_us
        if self._way_m < self.distance_m or not self.enabled or self.paused:
            return False
        self._way_m %= self.distance_m
        return True

    def due(self, time_us: int) -> bool:
        """Whether a photo of the series, or of the cycle, is to be taken now."""
        if self.left and time_us >= self._next_us:
            self._next_us += self.interval_us
            if self.left > 0:
                self.left -= 1
            return True
        if self._cycle_us and self.enabled and not self.paused and time_us >= self._next_cycle_us:
            self._next_cycle_us += self._cycle_us
            return True
        return False
