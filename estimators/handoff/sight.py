"""What one aircraft sees that moves on the ground: its own messages, from sensors to tracks."""

import math
from collections import Counter
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.moving_points import MOVING_POINTS_PAYLOAD, read_moving_points
from estimators import wire
from estimators.handoff.aircraft_tracks import AircraftTracks
from estimators.handoff.dead_reckoning import ReckonedPath
from estimators.handoff.scans import GimbalHistory, PointScan, ScanAssembler, image_point, level_places
from estimators.interface import Outcome
from estimators.messages import Message, is_a
from estimators.relative_pose.aircraft import AircraftState
from estimators.tracking.line_of_sight import gimbal_attitude
from estimators.tracking.recursive_ransac import RecursiveRansac
from flightsim.foundation.vectors import ImagePoint

_PATH_S: Final = 5.0  # time in which scans and reports may be late
_GROUND_SHARE: Final = 0.05  # of a new height on the ground


def armed_of(heartbeat: wire.HEARTBEAT) -> bool:
    """Whether a heartbeat reports that the vehicle is armed."""
    return bool(heartbeat.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)


class GroundHeight:
    """Height of one aircraft over the place of its start, from its pressure altitude.

    Args:
        ground_m: pressure altitude of the ground; None: that before the aircraft is armed.
    """

    def __init__(self, ground_m: float | None) -> None:
        self.ground_m = math.nan if ground_m is None else ground_m
        self._given = ground_m is not None

    def armed(self, armed: bool, altitude_m: float) -> None:
        """A heartbeat, with the newest pressure altitude; NaN: not known."""
        if self._given or armed or not math.isfinite(altitude_m):
            return
        known = math.isfinite(self.ground_m)
        self.ground_m += _GROUND_SHARE * (altitude_m - self.ground_m) if known else 0.0
        if not known:
            self.ground_m = altitude_m


class AircraftSight:
    """The tracks of one aircraft, from its messages.

    The aircraft's inertial and pressure messages are taken by `state`, which this class does not feed.

    Args:
        state: of the aircraft; its `on_motion` is set.
        tracker: of the moving objects.
        keep_s: time for which places of the tracks are kept.
        tilt_sigma_rad: errors of roll and pitch that change from frame to frame.
        ground_m: pressure altitude of the ground; None: that before the aircraft is armed.

    Attributes:
        state: as given.
        path: motion of the aircraft.
        tracks: what moves on the ground.
        height: over the ground.
        offset_us: from the aircraft's own time, which its camera and its gimbal send, to the time of the
            inertial messages, which is that of the team.
        counts: scans by what became of them; "malformed" messages.
        seen: image points of the tracks in the newest scan, by number.
    """

    def __init__(
        self,
        state: AircraftState,
        tracker: RecursiveRansac,
        keep_s: float,
        *,
        tilt_sigma_rad: float,
        ground_m: float | None = None,
    ) -> None:
        self.state = state
        self.path = ReckonedPath(_PATH_S)
        self.tracks = AircraftTracks(tracker, keep_s, self.path.newest)
        self.height = GroundHeight(ground_m)
        self.offset_us = 0
        self._tilt_sigma_rad = tilt_sigma_rad
        self._gimbal = GimbalHistory()
        self._scans = ScanAssembler()
        self.counts: Counter[str] = self._scans.counts
        self.seen: dict[int, ImagePoint] = {}
        state.on_motion = self.path.advance

    @property
    def height_m(self) -> float:
        """Height over the ground; NaN: not known."""
        return self.state.height_m - self.height.ground_m

    def take(self, time_us: int, message: Message) -> Outcome:
        """Process a message of the aircraft's camera, gimbal or autopilot.

        Returns:
            UPDATED: the tracks are those of a new scan.
        """
        if is_a(message, wire.TUNNEL):
            return self._tunnel(message)
        if is_a(message, wire.GIMBAL_DEVICE_ATTITUDE_STATUS):
            found = gimbal_attitude(message)
            if found is None:
                return Outcome.IMPLAUSIBLE
            return Outcome.USED if self._gimbal.add(found) else Outcome.LATE
        if is_a(message, wire.HEARTBEAT) and message.src_component == AUTOPILOT_COMPONENT:
            self.height.armed(armed_of(message), self.state.height_m)
            return Outcome.USED
        return Outcome.IGNORED

    def _tunnel(self, message: wire.TUNNEL) -> Outcome:
        if message.payload_type != MOVING_POINTS_PAYLOAD:
            return Outcome.IGNORED
        points = read_moving_points(message.payload_type, message.payload_length, message.payload)
        if points is None:
            self.counts["malformed"] += 1
            return Outcome.IMPLAUSIBLE
        outcomes = [self._scan(scan) for scan in self._scans.add(points)]
        return outcomes[-1] if outcomes else Outcome.USED

    def _scan(self, scan: PointScan) -> Outcome:
        time_us = scan.time_us + self.offset_us
        gimbal, taken = self._gimbal.at(scan.time_us), self.path.at(time_us)
        if gimbal is None or taken is None:
            self.counts["unplaced"] += 1
            return Outcome.WAITING
        # the heading has turned since the exposure
        heading_rad = self.state.heading_rad + taken.heading_rad - self.path.newest.heading_rad
        found = level_places(scan, gimbal, heading_rad, self.height_m, self._tilt_sigma_rad)
        if found is None:
            self.counts["unplaced"] += 1
            return Outcome.WAITING
        self.tracks.scan(time_us, *found, taken=taken)
        points = {
            number: image_point(place, gimbal, heading_rad, self.height_m)
            for number, place in self.tracks.level(taken).items()
        }
        self.seen = {number: point for number, point in points.items() if point is not None}
        return Outcome.UPDATED
