"""Quaternions with their times, interpolated: attitude of a vehicle, and of its gimbal."""

from bisect import bisect_left

from autopilot_bridge.rotation import Quaternion, between

__all__ = ["Orientations"]


class Orientations:
    """Orientations by time, for a few seconds back.

    Args:
        history_us: how long they are kept.
        reach_us: how far from the nearest one is still good enough.
    """

    __slots__ = ("_history_us", "_quaternions", "_reach_us", "_times")

    def __init__(self, history_us: int, reach_us: int) -> None:
        self._history_us = history_us
        self._reach_us = reach_us
        self._times: list[int] = []
        self._quaternions: list[Quaternion] = []

    def add(self, time_us: int, q: Quaternion) -> None:
        """Keep one, newer than those before."""
        self._times.append(time_us)
        self._quaternions.append(q)
        drop = bisect_left(self._times, time_us - self._history_us)
        if drop > 16:  # in bunches: a list is cheap to cut, not to cut often
            del self._times[:drop], self._quaternions[:drop]

    def clear(self) -> None:
        """Forget all."""
        self._times.clear()
        self._quaternions.clear()

    def covers(self, time_us: int) -> bool:
        """Whether one as new as that is there."""
        return bool(self._times) and self._times[-1] >= time_us

    def at(self, time_us: int) -> Quaternion | None:
        """Between the two next to a time, or the nearest if it is near; None when none is."""
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
