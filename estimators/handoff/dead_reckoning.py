"""Tracks of an aircraft that does not know its position: past places of targets as seen from now.

Source: Tolman et al. 2021, equation 41 and the one after it. The place of a target at time n in the level
frame of time n is taken to the level frame of the present time k by the aircraft's own motion. Instead of
moving all past places at each step, they are kept in the frame in which the aircraft reckons its own motion
from its start; the present position and heading in it make a window for any time.
"""

import math
from bisect import bisect_left
from collections import deque
from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.relative_pose.belief import LevelMotion

Array = NDArray[np.float64]


EYE: Final = 0
"""Number of the aircraft itself beside its tracks, which are numbered from 1."""


class DeadReckoning:
    """Position and heading from velocity and yaw rate, in a frame with the aircraft's first axes.

    With velocities against the air it is a frame of the air: targets drift in it against the wind, by the
    same velocity for all aircraft.

    Attributes:
        x_m, y_m: position along and to the right of the first heading.
        heading_rad: heading relative to the first one, not wrapped.
    """

    def __init__(self) -> None:
        self.x_m = self.y_m = self.heading_rad = 0.0

    def advance(self, dt_s: float, motion: LevelMotion) -> None:
        """Move by a time."""
        if not dt_s > 0.0:
            return
        middle = self.heading_rad + 0.5 * motion.yaw_rate_rad_s * dt_s
        c, s = math.cos(middle) * dt_s, math.sin(middle) * dt_s
        self.x_m += c * motion.forward_m_s - s * motion.right_m_s
        self.y_m += s * motion.forward_m_s + c * motion.right_m_s
        self.heading_rad += motion.yaw_rate_rad_s * dt_s

    def placed(self, level: Array) -> Array:
        """Places (n, 2) of the present level frame (forward, right), in the frame of the reckoning."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        found: Array = level @ np.array([[c, s], [-s, c]]) + (self.x_m, self.y_m)
        return found

    def level(self, places: Array) -> Array:
        """Places (..., 2) of the frame of the reckoning, in the present level frame."""
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        found: Array = (places - (self.x_m, self.y_m)) @ np.array([[c, -s], [s, c]])
        return found


class ReckonedPath:
    """A dead reckoning with its past, for measurements that come later than they were taken.

    Args:
        keep_s: time for which it is kept.

    Attributes:
        newest: the present state.
        time_us: its time; None: there is none yet.
    """

    def __init__(self, keep_s: float) -> None:
        self._keep_us = round(1e6 * keep_s)
        self.newest = DeadReckoning()
        self.time_us: int | None = None
        self._past: deque[tuple[int, float, float, float]] = deque()

    def advance(self, time_us: int, dt_s: float, motion: LevelMotion) -> None:
        """Move by a time that ends at `time_us`."""
        self.newest.advance(dt_s, motion)
        self.time_us = time_us
        state = self.newest
        self._past.append((time_us, state.x_m, state.y_m, state.heading_rad))
        while self._past[0][0] < time_us - self._keep_us:
            self._past.popleft()

    def at(self, time_us: int) -> DeadReckoning | None:
        """The state at a time, linear between samples; None: it is not kept, or is still to come."""
        past = self._past
        if not past or not past[0][0] <= time_us <= past[-1][0]:
            return None
        after = bisect_left(past, (time_us,))
        after_us, *later = past[after]
        before_us, *earlier = past[max(0, after - 1)]
        share = 1.0 if after_us == before_us else (time_us - before_us) / (after_us - before_us)
        found = DeadReckoning()
        found.x_m, found.y_m, found.heading_rad = (
            a + share * (b - a) for a, b in zip(earlier, later, strict=True)
        )
        return found


class TrackHistory:
    """Places of an aircraft and of its numbered tracks in the frame of its dead reckoning, for some time.

    Args:
        keep_s: time for which places are kept.
    """

    def __init__(self, keep_s: float) -> None:
        if not keep_s > 0.0:
            raise ValueError(f"keep_s = {keep_s:g} is not accepted: a number above 0 is")
        self._keep_us = round(1e6 * keep_s)
        self._places: dict[int, deque[tuple[int, float, float]]] = {}
        self._newest_us = 0

    def add(self, time_us: int, eye: DeadReckoning, places: Iterable[tuple[int, float, float]]) -> None:
        """Add the aircraft's place and the tracks of one time as (number, x, y). Places older than the newest
        are ignored; a track that has had no place for the time of the window is forgotten.
        """
        if time_us < self._newest_us:
            return
        self._newest_us = time_us
        for number, x_m, y_m in ((EYE, eye.x_m, eye.y_m), *places):
            kept = self._places.setdefault(number, deque())
            if not kept or kept[-1][0] < time_us:
                kept.append((time_us, x_m, y_m))
        oldest_us = time_us - self._keep_us
        for number in list(self._places):
            kept = self._places[number]
            while kept and kept[0][0] < oldest_us:
                kept.popleft()
            if not kept:
                del self._places[number]

    @property
    def numbers(self) -> Sequence[int]:
        """Numbers of the tracks with at least one place, and `EYE`."""
        return sorted(self._places)

    def window(self, number: int, times_us: NDArray[np.int64]) -> Array | None:
        """Places of a track, or of the aircraft (`EYE`), at several times, (n, 2), linear between its own
        times; None when it does not reach over all of them.
        """
        kept = self._places.get(number)
        if kept is None or kept[0][0] > times_us[0] or kept[-1][0] < times_us[-1]:
            return None
        table = np.array(kept)
        if len(table) >= len(times_us) and np.array_equal(table[-len(times_us) :, 0], times_us):
            return table[-len(times_us) :, 1:]
        return np.column_stack([np.interp(times_us, table[:, 0], table[:, k]) for k in (1, 2)])
