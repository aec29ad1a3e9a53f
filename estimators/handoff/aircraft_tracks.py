"""The tracks of one aircraft: measurements of its camera in the frame of its dead reckoning, and R-RANSAC."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.dead_reckoning import DeadReckoning, TrackHistory
from estimators.relative_pose.belief import LevelMotion
from estimators.tracking.recursive_ransac import RecursiveRansac

Array = NDArray[np.float64]

_LOOK_M: Final = 3.0  # a measurement this close to a track, and to no other, shows what its target looks like


class AircraftTracks:
    """Moving objects on the ground as one aircraft sees them.

    Args:
        tracker: of the objects.
        keep_s: time for which places are kept.
        reckoning: motion that is advanced elsewhere; None: `move` advances it.

    Attributes:
        reckoning: motion of the aircraft since the start.
        history: past places of the tracks, in the frame of `reckoning`.
        time_us: time of the newest frame.
        looks: what the targets of tracks that were seen in it look like, by number (`appearance`).
    """

    def __init__(
        self, tracker: RecursiveRansac, keep_s: float, reckoning: DeadReckoning | None = None
    ) -> None:
        self.tracker = tracker
        self.reckoning = reckoning or DeadReckoning()
        self.history = TrackHistory(keep_s)
        self.time_us = 0
        self.looks: dict[int, Array] = {}
        self._places: dict[int, tuple[float, float]] = {}

    def move(self, dt_s: float, motion: LevelMotion) -> None:
        """Move the aircraft by a time."""
        self.reckoning.advance(dt_s, motion)

    def scan(
        self,
        time_us: int,
        level: Array,
        covariances: Array,
        taken: DeadReckoning | None = None,
        looks: Array | None = None,
    ) -> None:
        """Process the measurements of one frame.

        Args:
            time_us: its time.
            level: (n, 2) forward and right in the level frame of that time.
            covariances: (n, 2, 2) theirs.
            taken: the motion at that time; None: the present one.
            looks: (n, d) what is measured looks like; None: not known.
        """
        if time_us <= self.time_us:
            return
        self.time_us = time_us
        reckoning = self.reckoning if taken is None else taken
        c, s = math.cos(reckoning.heading_rad), math.sin(reckoning.heading_rad)
        turn = np.array([[c, -s], [s, c]])
        placed = reckoning.placed(level)
        self.tracker.scan(time_us, placed, turn @ covariances @ turn.T)
        self._places = {
            track.number: (float(track.state[0]), float(track.state[1])) for track in self.tracker.tracks
        }
        self.looks = {} if looks is None else self._looks_of(placed, looks)
        self.history.add(time_us, reckoning, [(number, *place) for number, place in self._places.items()])

    def _looks_of(self, placed: Array, looks: Array) -> dict[int, Array]:
        """The looks by track: of the measurements that are close to one track only."""
        if not (len(placed) and self._places):
            return {}
        numbers = list(self._places)
        off = placed[:, None] - np.array(list(self._places.values()))  # (measurements, tracks, 2)
        close = np.hypot(off[..., 0], off[..., 1]) < _LOOK_M
        alone = close & (close.sum(axis=0) == 1) & (close.sum(axis=1) == 1)[:, None]
        return {numbers[k]: looks[i] for i, k in zip(*np.nonzero(alone), strict=True)}

    @property
    def places(self) -> Mapping[int, tuple[float, float]]:
        """Tracks after the newest frame, in the frame of the reckoning, by number."""
        return self._places

    @property
    def doubtful(self) -> frozenset[int]:
        """Tracks with a smaller share of measurements than a hypothesis needs to become a track."""
        least = self.tracker.parameters.good_ratio
        return frozenset(track.number for track in self.tracker.tracks if track.inlier_ratio < least)

    def level(self, taken: DeadReckoning | None = None) -> Mapping[int, tuple[float, float]]:
        """The same in the level frame of a motion, None: the present one; forward and right."""
        if not self._places:
            return {}
        moved = (taken or self.reckoning).level(np.array(list(self._places.values()))).tolist()
        return {number: (row[0], row[1]) for number, row in zip(self._places, moved, strict=True)}

    def velocity(self, number: int | None) -> tuple[float, float]:
        """Velocity of a track against the frame of the reckoning, forward and right of the present level
        frame; 0: there is no such track.
        """
        track = next((track for track in self.tracker.tracks if track.number == number), None)
        if track is None:
            return 0.0, 0.0
        c, s = math.cos(self.reckoning.heading_rad), math.sin(self.reckoning.heading_rad)
        x, y = track.state[2:4].tolist()
        return c * x + s * y, -s * x + c * y
