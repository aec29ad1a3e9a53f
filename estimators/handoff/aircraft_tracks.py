"""The tracks of one aircraft: measurements of its camera in the frame of its dead reckoning, and R-RANSAC."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from estimators.handoff.dead_reckoning import DeadReckoning, TrackHistory
from estimators.relative_pose.belief import LevelMotion
from estimators.tracking.recursive_ransac import RecursiveRansac

Array = NDArray[np.float64]


class AircraftTracks:
    """Moving objects on the ground as one aircraft sees them.

    Args:
        tracker: of the objects.
        keep_s: time for which places are kept.

    Attributes:
        reckoning: motion of the aircraft since the start.
        history: past places of the tracks, in the frame of `reckoning`.
    """

    def __init__(self, tracker: RecursiveRansac, keep_s: float) -> None:
        self.tracker = tracker
        self.reckoning = DeadReckoning()
        self.history = TrackHistory(keep_s)
        self._places: dict[int, tuple[float, float]] = {}

    def move(self, dt_s: float, motion: LevelMotion) -> None:
        """Move the aircraft by a time."""
        self.reckoning.advance(dt_s, motion)

    def scan(self, time_us: int, level: Array, covariances: Array) -> None:
        """Process the measurements of one frame.

        Args:
            time_us: its time; the motion must have been advanced to it.
            level: (n, 2) forward and right in the present level frame.
            covariances: (n, 2, 2) theirs.
        """
        c, s = math.cos(self.reckoning.heading_rad), math.sin(self.reckoning.heading_rad)
        turn = np.array([[c, -s], [s, c]])
        self.tracker.scan(time_us, self.reckoning.placed(level), turn @ covariances @ turn.T)
        self._places = {
            track.number: (float(track.state[0]), float(track.state[1])) for track in self.tracker.tracks
        }
        self.history.add(time_us, [(number, *place) for number, place in self._places.items()])

    @property
    def places(self) -> Mapping[int, tuple[float, float]]:
        """Tracks after the newest frame, in the frame of the reckoning, by number."""
        return self._places

    def level(self) -> Mapping[int, tuple[float, float]]:
        """The same in the present level frame: forward and right."""
        if not self._places:
            return {}
        moved = self.reckoning.level(np.array(list(self._places.values()))).tolist()
        return {number: (row[0], row[1]) for number, row in zip(self._places, moved, strict=True)}
