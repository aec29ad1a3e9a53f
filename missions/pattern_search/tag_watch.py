"""Watches for a tag in the messages of a vehicle's camera while a pattern is flown."""

import asyncio
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.mavlink import Frame, dialect
from autopilot_bridge.mavlink.camera_scan import CAMERA_SCAN_PAYLOAD, CameraScan, read_camera_scan
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT, CAMERA_COMPONENT
from estimators import wire
from estimators.messages import read_as
from estimators.vision import VehicleTrack, ground_place
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.vehicle.notes import CutShort
from missions.vehicle.telemetry import Position
from missions.vehicle.vehicle import Vehicle

__all__ = ["FoundTag", "TagWatch"]

_AT_ALTITUDE: Final = 0.9
_FIDUCIAL: Final = int(dialect.LANDING_TARGET_TYPE_VISION_FIDUCIAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundTag:
    """The tag when it was detected.

    Attributes:
        exposed_us: vehicle time of the picture.
        place: on the ground, by the vehicle's own attitude and position; None: these, or the camera's
            geometry, were not received.
        distance_m: from the camera, by the tag's size.
    """

    exposed_us: int
    place: GeodeticPosition | None
    distance_m: float


class TagWatch:
    """Listens to one vehicle's camera. The search begins at nine tenths of the altitude above home.

    The ground is level, at the height of home. Both are taken from GLOBAL_POSITION_INT: the origin of the
    autopilot's local frame may be metres above or below home.

    Args:
        vehicle: the vehicle.
        tag_id: the tag that is searched for.
        altitude_m: of the search.
        limit_s: duration of the search; None: it has no limit of its own.

    Attributes:
        began_us: vehicle time at which the search began; None: not yet.
        found: the tag; None: not detected.
        frames: number of searched pictures.
        frames_at_altitude: number of those since the search began.
        other_tags: numbers of other tags that were detected.
    """

    def __init__(self, vehicle: Vehicle, *, tag_id: int, altitude_m: float, limit_s: float | None) -> None:
        self._vehicle = vehicle
        self._tag_id = tag_id
        self._altitude_m = altitude_m
        self._limit_us = None if limit_s is None else round(limit_s * 1e6)
        self._track = VehicleTrack()
        self._frame: LocalFrame | None = None
        self._seen: dict[int, tuple[float, float, float]] = {}
        self._ended = asyncio.Event()
        self._stops: list[Callable[[], None]] = []
        self._now_us = 0  # time since boot of the newest position
        self.began_us: int | None = None
        self.found: FoundTag | None = None
        self.frames = self.frames_at_altitude = 0
        self.other_tags: set[int] = set()

    def start(self) -> None:
        """Start to listen. The vehicle has reported its home."""
        self._frame = LocalFrame(self._vehicle.home)
        self._stops.append(self._vehicle.link.listen(Position, self._on_position))
        connection = self._vehicle.link.connection
        for name, take in (
            ("ATTITUDE", self._on_attitude),
            ("LANDING_TARGET", self._on_detection),
            ("TUNNEL", self._on_scan),
        ):
            self._stops.append(connection.listen(name, take))

    def stop(self) -> None:
        """Stop listening."""
        for stop in self._stops:
            stop()
        self._stops = []

    @property
    def deadline_us(self) -> int | None:
        """Vehicle time at which the search ends without success; None: not known."""
        return None if self.began_us is None or self._limit_us is None else self.began_us + self._limit_us

    @property
    def over(self) -> bool:
        """Whether the tag was found, or the time is over."""
        deadline_us = self.deadline_us
        return self.found is not None or (deadline_us is not None and self._now_us >= deadline_us)

    @property
    def ended_by(self) -> CutShort:
        """What has ended the search, when it is over."""
        return CutShort.TIME if self.found is None else CutShort.FOUND

    async def unless_over(self, waiting: Awaitable[None]) -> bool:
        """Wait for something of the flight, or the end of the search; returns whether the search ended."""
        flight = asyncio.ensure_future(waiting)
        end = asyncio.ensure_future(self._ended.wait())
        try:
            await asyncio.wait((flight, end), return_when=asyncio.FIRST_COMPLETED)
            if flight.done():
                await flight
            return self.over
        finally:
            for task in (flight, end):
                task.cancel()
            await asyncio.gather(flight, end, return_exceptions=True)

    def note(self) -> None:
        """Write the result to the notes of the flight."""
        marks = self._vehicle.notes.marks
        began_us = self._now_us if self.began_us is None else self.began_us
        end_us = self._now_us if self.found is None else self.found.exposed_us
        if self.found is None and self.deadline_us is not None:
            end_us = min(end_us, self.deadline_us)
        marks["search_found"] = float(self.found is not None)
        marks["search_s"] = max(0.0, (end_us - began_us) * 1e-6)
        marks["search_frames"] = float(self.frames)
        marks["search_frames_at_altitude"] = float(self.frames_at_altitude)
        if self.found is not None:
            marks["search_exposed_us"] = float(self.found.exposed_us)
            marks["search_distance_m"] = self.found.distance_m
            if self.found.place is not None:
                commanded = self._vehicle.notes.commanded
                frame = LocalFrame(self._vehicle.home if commanded is None else commanded.origin)
                place = self.found.place
                north_m, east_m, _ = frame.ned_from_geodetic(place.lat_deg, place.lon_deg, place.alt_m)
                marks["search_north_m"], marks["search_east_m"] = north_m, east_m

    # inside

    def _own(self, frame: Frame, component: int) -> bool:
        return frame.system_id == self._vehicle.system_id and frame.component_id == component

    def _on_attitude(self, frame: Frame) -> None:
        if self._own(frame, AUTOPILOT_COMPONENT):
            self._track.handle(read_as(frame, wire.ATTITUDE))

    def _on_position(self, position: Position) -> None:
        assert self._frame is not None
        north_m, east_m, _ = self._frame.ned_from_geodetic(position.lat_deg, position.lon_deg, position.alt_m)
        self._track.place(position.time_us, (north_m, east_m, -position.height_m))
        self._now_us = position.time_us
        if self.began_us is None and position.height_m >= _AT_ALTITUDE * self._altitude_m:
            self.began_us = self._now_us
        if self.over:
            self._ended.set()

    def _on_detection(self, frame: Frame) -> None:
        if not self._own(frame, CAMERA_COMPONENT):
            return
        message = read_as(frame, wire.LANDING_TARGET)
        values = (message.angle_x, message.angle_y, message.distance)
        if message.type != _FIDUCIAL or not all(map(math.isfinite, values)):
            return
        if message.target_num != self._tag_id:
            self.other_tags.add(int(message.target_num))
            return
        self._seen = {int(message.time_usec): values}

    def _on_scan(self, frame: Frame) -> None:
        if not self._own(frame, CAMERA_COMPONENT):
            return
        message = read_as(frame, wire.TUNNEL)
        if message.payload_type != CAMERA_SCAN_PAYLOAD:
            return
        scan = read_camera_scan(message.payload_type, message.payload_length, message.payload)
        if scan is None:
            return
        self.frames += 1
        if self.began_us is None:
            return
        self.frames_at_altitude += 1
        seen = self._seen.get(scan.time_us)
        if seen is None or self.over:
            return
        self.found = FoundTag(exposed_us=scan.time_us, place=self._place(scan, seen), distance_m=seen[2])
        self._ended.set()

    def _place(self, scan: CameraScan, seen: tuple[float, float, float]) -> GeodeticPosition | None:
        assert self._frame is not None
        pose = self._track.at(scan.time_us)
        place = None if pose is None else ground_place(pose, scan, seen[0], seen[1])
        if place is None:
            return None
        lat_deg, lon_deg, alt_m = self._frame.geodetic_from_ned(*place, 0.0)
        return GeodeticPosition(lat_deg=lat_deg, lon_deg=lon_deg, alt_m=alt_m)
