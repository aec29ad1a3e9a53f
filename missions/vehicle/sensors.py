"""Sensors that a mission lives on: each is proven before the takeoff and watched in flight.

A vehicle without its camera flies a whole search and finds nothing; the result looks like a search. So a
mission names its sensors (`Mission.sensors`), with the message that each sends as long as it works, whether
it detects something or not. A component's heartbeat is no such message where there is a better one: it goes
on when the lens, the detector or the probe has failed.
"""

import asyncio
import math
from collections import deque
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from dataclasses import dataclass, replace
from typing import Final, NamedTuple, TypeVar

from autopilot_bridge.mavlink import Frame, MAVLinkMessage, decode_as, dialect
from autopilot_bridge.mavlink.camera_scan import CAMERA_SCAN_PAYLOAD, read_camera_scan
from autopilot_bridge.mavlink.components import (
    AUTOPILOT_COMPONENT,
    CAMERA_COMPONENT,
    GIMBAL_COMPONENT,
    MOVING_POINT_COMPONENT,
    RANGE_RADIO_COMPONENT,
    SURVEY_MAGNETOMETER_COMPONENT,
    TARGET_SENSOR_COMPONENT,
)
from autopilot_bridge.mavlink.moving_points import MOVING_POINTS_PAYLOAD, read_moving_points
from autopilot_bridge.mavlink.target_scan import TARGET_SCAN_PAYLOAD, ScanEnd, read_scan_payload
from estimators import survey_magnetometer
from estimators.tracking.line_of_sight import gimbal_attitude
from missions.errors import MissionError, VehicleTimeout
from missions.vehicle.link import VehicleLink

__all__ = [
    "CAMERA",
    "GIMBAL",
    "MOVING_POINTS",
    "RANGE_RADIO",
    "SURVEY_MAGNETOMETER",
    "TAG_CAMERA",
    "TARGET_SENSOR",
    "Sensor",
    "SensorWatch",
    "Sign",
]

MessageT = TypeVar("MessageT", bound=MAVLinkMessage)

_RECEIVED_S: Final = 5.0  # for the first message of a component
_PROOFS: Final = 2  # readings that prove a sensor, at its lowest rate
_LATE_S: Final = 2.0
_KEPT: Final = 16
_SILENT_US: Final = 3_000_000  # between two heartbeats of the autopilot: the link was interrupted


@dataclass(frozen=True, slots=True, kw_only=True)
class Sign:
    """What one message says about its sensor.

    Attributes:
        stamp_us: its time stamp, which must change from one reading to the next; None: it has none.
        plausible: whether its values can be right.
    """

    stamp_us: int | None = None
    plausible: bool = True


class Source(NamedTuple):
    """The messages of a sensor.

    Attributes:
        message: their name.
        read: what a frame of that message says; None: it is no reading of this sensor.
    """

    message: str
    read: Callable[[Frame], Sign | None]

    @classmethod
    def of(cls, kind: type[MessageT], read: Callable[[MessageT], Sign | None]) -> "Source":
        """By a function of the decoded message."""
        return cls(kind.msgname, lambda frame: read(decode_as(frame, kind)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensor:
    """A sensor, and how it shows in messages that it works.

    Attributes:
        name: for texts.
        component: id of the MAVLink component that sends the messages.
        what: the readings, for texts: "pictures that were searched".
        least_hz: lowest rate of readings at which it is of use.
        silent_s: vehicle time without a usable reading after which it has stopped.
        source: its messages.
    """

    name: str
    component: int
    source: Source
    what: str
    least_hz: float
    silent_s: float = 5.0

    def silent_after(self, seconds: float) -> "Sensor":
        """The same sensor with another `silent_s`."""
        return replace(self, silent_s=seconds)

    def __str__(self) -> str:
        return f"{self.name} ({self.component})"


def _heartbeat(_message: MAVLinkMessage) -> Sign:
    return Sign()


def _searched_picture(m: dialect.MAVLink_tunnel_message) -> Sign | None:
    if m.payload_type != CAMERA_SCAN_PAYLOAD:
        return None
    scan = read_camera_scan(m.payload_type, m.payload_length, m.payload)
    return Sign(plausible=False) if scan is None else Sign(stamp_us=scan.time_us)


def _target_scan(m: dialect.MAVLink_tunnel_message) -> Sign | None:
    if m.payload_type != TARGET_SCAN_PAYLOAD:
        return None
    scan = read_scan_payload(m.payload_type, m.payload_length, m.payload)
    if scan is None:
        return Sign(plausible=False)
    return Sign(stamp_us=scan.time_us) if isinstance(scan, ScanEnd) else None


def _moving_points(m: dialect.MAVLink_tunnel_message) -> Sign | None:
    if m.payload_type != MOVING_POINTS_PAYLOAD:
        return None
    points = read_moving_points(m.payload_type, m.payload_length, m.payload)
    return Sign(plausible=False) if points is None else Sign(stamp_us=points.time_us)


def _gimbal_attitude(m: dialect.MAVLink_gimbal_device_attitude_status_message) -> Sign:
    attitude = gimbal_attitude(m)
    return Sign(plausible=False) if attitude is None else Sign(stamp_us=attitude.time_us)


def _total_field(m: dialect.MAVLink_named_value_float_message) -> Sign | None:
    if str(m.name).rstrip("\0") != survey_magnetometer.TOTAL_FIELD_NAME:
        return None
    plausible = math.isfinite(m.value) and 0.0 < m.value < survey_magnetometer.STRONGEST_NT
    return Sign(stamp_us=int(m.time_boot_ms) * 1000, plausible=plausible)


TAG_CAMERA: Final = Sensor(
    name="camera",
    component=CAMERA_COMPONENT,
    source=Source.of(dialect.MAVLink_tunnel_message, _searched_picture),
    what="searched pictures (docs/mavlink/camera_scan.md)",
    least_hz=0.5,
)
"""A camera that searches its pictures for tags, and reports each of them."""
CAMERA: Final = Sensor(
    name="camera",
    component=CAMERA_COMPONENT,
    source=Source.of(dialect.MAVLink_heartbeat_message, _heartbeat),
    what="heartbeats",
    least_hz=0.5,
)
"""A camera that reports what it detects, and nothing of empty pictures."""
GIMBAL: Final = Sensor(
    name="gimbal",
    component=GIMBAL_COMPONENT,
    source=Source.of(dialect.MAVLink_gimbal_device_attitude_status_message, _gimbal_attitude),
    what="attitudes (GIMBAL_DEVICE_ATTITUDE_STATUS)",
    least_hz=1.0,
)
SURVEY_MAGNETOMETER: Final = Sensor(
    name="survey magnetometer",
    component=SURVEY_MAGNETOMETER_COMPONENT,
    source=Source.of(dialect.MAVLink_named_value_float_message, _total_field),
    what=f"readings of a field (NAMED_VALUE_FLOAT {survey_magnetometer.TOTAL_FIELD_NAME})",
    least_hz=1.0,
)
TARGET_SENSOR: Final = Sensor(
    name="target sensor",
    component=TARGET_SENSOR_COMPONENT,
    source=Source.of(dialect.MAVLink_tunnel_message, _target_scan),
    what="complete scans (docs/mavlink/target_scan.md)",
    least_hz=0.1,
    silent_s=30.0,
)
MOVING_POINTS: Final = Sensor(
    name="moving-point camera",
    component=MOVING_POINT_COMPONENT,
    source=Source.of(dialect.MAVLink_tunnel_message, _moving_points),
    what="scans (docs/mavlink/moving_points.md)",
    least_hz=1.0,
)
RANGE_RADIO: Final = Sensor(
    name="range radio",
    component=RANGE_RADIO_COMPONENT,
    source=Source.of(dialect.MAVLink_heartbeat_message, _heartbeat),
    what="heartbeats",
    least_hz=0.5,
)
"""It measures ranges only while another vehicle is in reach."""


class _Track:
    """The usable readings of one sensor.

    Attributes:
        times_us: vehicle times at which the newest arrived.
        unusable: why the newest message was not usable; "": it was.
    """

    def __init__(self, sensor: Sensor, now_us: int) -> None:
        self.sensor = sensor
        self.times_us: deque[int] = deque(maxlen=_KEPT)
        self.since_us = now_us  # of the silence
        self.unusable = ""
        self._stamp_us: int | None = None

    def take(self, frame: Frame, now_us: int) -> None:
        sign = self.sensor.source.read(frame)
        if sign is None:
            return
        if not sign.plausible:
            self.unusable = "its values are not plausible"
        elif sign.stamp_us is not None and sign.stamp_us == self._stamp_us:
            self.unusable = f"its time stands still at {sign.stamp_us * 1e-6:.3f} s"
        else:
            self.unusable = ""
            self.since_us = now_us
            self.times_us.append(now_us)
        self._stamp_us = sign.stamp_us

    def proven(self, now_us: int) -> bool:
        """Whether its readings come at its lowest rate or faster."""
        least_us = now_us - _PROOFS / self.sensor.least_hz * 1e6
        return sum(time_us >= least_us for time_us in self.times_us) >= _PROOFS


class SensorWatch:
    """The sensors that the present mission of one vehicle lives on.

    Args:
        link: messages of the vehicle.

    Attributes:
        stopped: which sensor has stopped, since when and why; "": all work, or are no longer needed.
    """

    def __init__(self, link: VehicleLink) -> None:
        self._link = link
        self._tracks: list[_Track] = []
        self._stops: list[Callable[[], None]] = []
        self._heartbeat_us = 0
        self._scopes: list[asyncio.Timeout] = []
        self.stopped = ""

    def watch(self, *sensors: Sensor) -> None:
        """Note the readings of these sensors from now on. The vehicle is identified."""
        link, connection = self._link, self._link.connection
        for sensor in sensors:
            track = _Track(sensor, link.clock.time_us)
            self._tracks.append(track)

            def take(frame: Frame, track: _Track = track) -> None:
                if (frame.system_id, frame.component_id) == (link.system_id, track.sensor.component):
                    track.take(frame, link.clock.time_us)

            self._stops.append(connection.listen(sensor.source.message, take, in_order=False))

    async def prove(self) -> None:
        """Wait until all sensors have sent usable readings at their lowest rates or faster, and keep watching
        them from then on.

        Raises:
            VehicleTimeout: one has not; the message names it and what it sends.
        """
        if not self._tracks:
            return
        await self._require_components()
        for track in self._tracks:
            await self._prove(track)
        for track in self._tracks:
            track.since_us = self._link.clock.time_us
        self._heartbeat_us = self._link.clock.time_us
        self._stops.append(self._link.connection.listen("HEARTBEAT", self._on_heartbeat, in_order=False))

    def release(self) -> None:
        """Stop watching: the mission has measured what it needs, and only flies home."""
        for stop in self._stops:
            stop()
        self._stops, self._tracks = [], []

    @asynccontextmanager
    async def guard(self) -> AsyncIterator[None]:
        """Context that raises MissionError when a sensor stops in it."""
        scope = asyncio.timeout(None)
        try:
            async with scope:
                self._scopes.append(scope)
                try:
                    yield
                finally:
                    self._scopes.remove(scope)
        except TimeoutError:
            if not scope.expired():
                raise
            raise MissionError(f"{self.stopped}; {self._link.last_received()}") from None

    # inside

    async def _require_components(self) -> None:
        link = self._link

        def missing() -> list[Sensor]:
            received = [
                t.sensor for t in self._tracks if link.connection.newest(link.system_id, t.sensor.component)
            ]
            return [t.sensor for t in self._tracks if t.sensor not in received]

        try:
            await link.wait_until(
                lambda: not missing(),
                what="sensors of the mission",
                on=("HEARTBEAT", *(t.sensor.source.message for t in self._tracks)),
                timeout_s=_RECEIVED_S,
            )
        except VehicleTimeout:
            names = ", no ".join(map(str, missing()))
            raise VehicleTimeout(
                f"vehicle {link.system_id} has no {names}: no message of it was received within "
                f"{_RECEIVED_S:g} s, and the mission can't be flown without"
            ) from None

    async def _prove(self, track: _Track) -> None:
        link, sensor = self._link, track.sensor
        limit_s = _PROOFS / sensor.least_hz + _LATE_S
        try:
            await link.wait_until(
                lambda: track.proven(link.clock.time_us),
                what=sensor.what,
                on=(sensor.source.message,),
                timeout_s=limit_s,
            )
        except VehicleTimeout:
            why = track.unusable or f"at least {sensor.least_hz:g} a second are needed"
            raise VehicleTimeout(
                f"the {sensor} of vehicle {link.system_id} is received, but sends no usable {sensor.what} "
                f"within {limit_s:g} s ({why}); the mission can't be flown without"
            ) from None

    def _on_heartbeat(self, frame: Frame) -> None:
        """Look for sensors that have stopped, in the rhythm of the autopilot's heartbeats: while none comes
        the link is interrupted, and says nothing about the sensors.
        """
        link = self._link
        if (frame.system_id, frame.component_id) != (link.system_id, AUTOPILOT_COMPONENT):
            return
        now_us, before_us = link.clock.time_us, self._heartbeat_us
        self._heartbeat_us = now_us
        interrupted = now_us - before_us > _SILENT_US
        for track in self._tracks:
            if interrupted:
                track.since_us = now_us
            silent_s = (now_us - track.since_us) * 1e-6
            if silent_s > track.sensor.silent_s and not self.stopped:
                why = f" ({track.unusable})" if track.unusable else ""
                self.stopped = (
                    f"the {track.sensor} of vehicle {link.system_id} has stopped: no usable "
                    f"{track.sensor.what} for {silent_s:.0f} s{why}"
                )
                for scope in self._scopes:
                    if not scope.expired():
                        scope.reschedule(asyncio.get_running_loop().time())
