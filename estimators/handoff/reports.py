"""Track reports between two aircraft: from tracks to messages, and from messages to reports."""

import math
from collections import Counter

import numpy as np

from autopilot_bridge.mavlink.handoff_messages import ReportedTrack, TrackReport
from estimators.handoff.aircraft_tracks import AircraftTracks
from estimators.handoff.dead_reckoning import DeadReckoning
from estimators.tracking.recursive_ransac import RansacTrack


def reported_track(track: RansacTrack, reckoning: DeadReckoning) -> ReportedTrack:
    """A track of the frame of a dead reckoning as it is reported: in the level frame of that motion."""
    c, s = math.cos(reckoning.heading_rad), math.sin(reckoning.heading_rad)
    turn = np.array([[c, s], [-s, c]])
    ((forward, right),) = reckoning.level(track.state[None, :2]).tolist()
    along, across = (turn @ track.state[2:4]).tolist()
    covariance = turn @ track.covariance[:2, :2] @ turn.T
    return ReportedTrack(
        number=track.number & 0xFFFF,
        place_m=(forward, right),
        velocity_m_s=(along, across),
        covariance_m2=(float(covariance[0, 0]), float(covariance[0, 1]), float(covariance[1, 1])),
        velocity_sigma_m_s=math.sqrt(0.5 * float(track.covariance[2, 2] + track.covariance[3, 3])),
    )


def reported_tracks(tracks: AircraftTracks, taken: DeadReckoning) -> list[ReportedTrack]:
    """All tracks of an aircraft, whose newest frame was taken at that motion."""
    return [reported_track(track, taken) for track in tracks.tracker.tracks]


class ReportAssembler:
    """Puts the messages of one aircraft's reports together. A report that lacks a message is dropped.

    Attributes:
        counts: reports "complete" and "incomplete", messages "late" and "repeated".
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._open: TrackReport | None = None
        self._parts: dict[int, tuple[ReportedTrack, ...]] = {}
        self._done_us = -1

    def add(self, message: TrackReport) -> TrackReport | None:
        """Add a message; the whole report when it is complete."""
        if message.time_us <= self._done_us:
            if message.time_us < self._done_us - 1_000_000:  # the sender has rebooted
                self._open, self._done_us = None, message.time_us - 1
            else:
                self.counts["repeated" if message.time_us == self._done_us else "late"] += 1
                return None
        known = self._open
        if known is not None and message.time_us < known.time_us:
            self.counts["late"] += 1
            return None
        if known is None or message.time_us > known.time_us:
            if known is not None:
                self.counts["incomplete"] += 1
            self._open, self._parts = message, {}
        self._parts[message.first] = message.tracks
        tracks = tuple(track for first in sorted(self._parts) for track in self._parts[first])
        if len(tracks) < message.total:
            return None
        self.counts["complete"] += 1
        self._open, self._done_us = None, message.time_us
        return TrackReport(
            system=message.system,
            report=message.report,
            time_us=message.time_us,
            first=0,
            total=message.total,
            target=message.target,
            identity=message.identity,
            released=message.released,
            tracks=tracks,
        )
