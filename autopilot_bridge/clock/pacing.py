"""Keeping simulated time in step with the wall clock."""

import time
from collections.abc import Callable
from typing import Final

wall_time_s: Final = time.monotonic
"""The wall clock, in seconds. For pacing, silent peers and reports of time spent; never for a flight."""


def unix_time_us() -> int:
    """The calendar: microseconds of the Unix epoch, to stamp the log of a flight on real hardware with."""
    return time.time_ns() // 1000


MAX_LAG_S: Final = 0.25
"""Wall seconds of lag that are caught up; a longer stop (SIGSTOP, suspended laptop) is not caught up."""


class Pacer:
    """Computes how long to wait before simulated time may advance.

    Args:
        speedup: simulated seconds per wall second, above 0.
        monotonic: wall clock in seconds.
        max_lag_s: lag that is caught up by running faster; a longer lag is not caught up.

    Attributes:
        slipped_s: total wall time lost because the simulation could not keep pace, s.
    """

    def __init__(
        self, speedup: float = 1.0, monotonic: Callable[[], float] = wall_time_s, max_lag_s: float = MAX_LAG_S
    ) -> None:
        if not 0.0 < speedup < float("inf"):
            raise ValueError(
                f"speed factor {speedup} is not accepted; give a number above 0, such as 1 or 20"
            )
        self._speedup = speedup
        self._monotonic = monotonic
        self.max_lag_s = max_lag_s
        self._anchor_s: float | None = None
        self._anchor_us = 0
        self.slipped_s = 0.0

    @property
    def speedup(self) -> float:
        """Simulated seconds per wall second."""
        return self._speedup

    def ahead_s(self, time_us: int) -> float:
        """Wall seconds until `time_us` is due; negative when it is overdue. The first call sets the start."""
        now_s = self._monotonic()
        if self._anchor_s is None:
            self._anchor_s, self._anchor_us = now_s, time_us
            return 0.0
        ahead_s = self._anchor_s + (time_us - self._anchor_us) * 1e-6 / self._speedup - now_s
        if ahead_s < -self.max_lag_s:
            self.slipped_s -= ahead_s
            self._anchor_s, self._anchor_us = now_s, time_us
            return 0.0
        return ahead_s


class RealTimeClock:
    """Holds a synchronous simulation loop to wall time.

    Args:
        speed: simulated seconds per wall second.
        monotonic: wall clock in seconds.
        wait: waits for so many wall seconds; a function that also serves sockets may be used here.
        max_lag_s: lag that is caught up (see `Pacer`).
    """

    def __init__(
        self,
        speed: float = 1.0,
        *,
        monotonic: Callable[[], float] = wall_time_s,
        wait: Callable[[float], object] = time.sleep,
        max_lag_s: float = MAX_LAG_S,
    ) -> None:
        self._pacer = Pacer(speed, monotonic, max_lag_s)
        self._wait = wait
        self.lag_s = 0.0
        self.max_lag_seen_s = 0.0

    @property
    def slipped_s(self) -> float:
        """Total wall time lost, s; 0 when the simulation kept pace."""
        return self._pacer.slipped_s

    def wait_until(self, time_us: int) -> None:
        """Return when simulated time `time_us` is due on the wall clock, at once when it is overdue.

        Afterwards `lag_s` is the number of wall seconds by which the simulation was late (0 when early).
        """
        slipped_s = self._pacer.slipped_s
        ahead_s = self._pacer.ahead_s(time_us)
        self.lag_s = max(0.0, -ahead_s, self._pacer.slipped_s - slipped_s)
        self.max_lag_seen_s = max(self.max_lag_seen_s, self.lag_s)
        if ahead_s > 0.0:
            self._wait(ahead_s)
