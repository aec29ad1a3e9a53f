"""Quaternions with times, interpolated: attitude of a vehicle, and of its gimbal."""

from bisect import bisect_left

from flightsim.foundation.vectors import Quaternion, between

__all__ = ["Orientations"]


class Orientations:
    """Orientations of the last seconds, by time.

    Args:
        history_us: time for which they are kept.
        reach_us: largest time difference to the nearest orientation that may be used.
    """

    def __init__(self, history_us: int, reach_us: int) -> None:
        self._history_us = history_us
        self._reach_us = reach_us
        self._times: list[int] = []
        self._quaternions: list[Quaternion] = []

    def add(self, time_us: int, q: Quaternion) -> None:
        """Store an orientation that is newer than those before."""
        self._times.append(time_us)
        self._quaternions.append(q)
        drop = bisect_left(self._times, time_us - self._history_us)
        if drop > 16:  # removed in groups, because each removal moves the rest of the list
            del self._times[:drop], self._quaternions[:drop]

    def clear(self) -> None:
        """Remove all orientations."""
        self._times.clear()
        self._quaternions.clear()

    def covers(self, time_us: int) -> bool:
        """Whether there is an orientation at or after this time."""
        return bool(self._times) and self._times[-1] >= time_us

    def at(self, time_us: int) -> Quaternion | None:
        """Interpolate between the two neighbours of a time, or use the nearest if it is close; None when none
        is close.
        """
        after = bisect_left(self._times, time_us)
        if 0 < after < len(self._times):
            before_us, after_us = self._times[after - 1], self._times[after]
            if after_us - before_us <= 2 * self._reach_us:
                share = (time_us - before_us) / (after_us - before_us)
                return between(self._quaternions[after - 1], self._quaternions[after], share)
        near = [i for i in (after - 1, after) if 0 <= i < len(self._times)]
        near.sort(key=lambda i: abs(self._times[i] - time_us))
        if not near or abs(self._times[near[0]] - time_us) > self._reach_us:
            return None
        return self._quaternions[near[0]]
