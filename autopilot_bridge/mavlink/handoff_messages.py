"""Tracks, designation and decision of a handoff in TUNNEL messages between two aircraft.

MAVLink has no message for tracks of targets relative to an aircraft that may not know its position.
FOLLOW_TARGET and ADSB_VEHICLE have geodetic positions. docs/mavlink/handoff.md documents the payloads. All
numbers are little-endian; vectors are forward and right in the level frame of the sender at the time of the
message.
"""

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from autopilot_bridge.mavlink import dialect

__all__ = [
    "HANDOFF_DECISION_PAYLOAD",
    "TRACK_DESIGNATION_PAYLOAD",
    "TRACK_REPORT_PAYLOAD",
    "HandoffDecision",
    "ReportedTrack",
    "TrackDesignation",
    "TrackReport",
    "decision_message",
    "designation_message",
    "read_decision",
    "read_designation",
    "read_track_report",
    "track_report_messages",
]

TRACK_REPORT_PAYLOAD: Final = 0xF51B
HANDOFF_DECISION_PAYLOAD: Final = 0xF51C
TRACK_DESIGNATION_PAYLOAD: Final = 0xF51D
"""Payload types; from 32768 on they are not registered (MAV_TUNNEL_PAYLOAD_TYPE)."""

_VERSION: Final = 1
_RELEASED: Final = 1
_DECIDED: Final = 1
_PAYLOAD_SIZE: Final = 128
_REPORT: Final = struct.Struct("<BBBBIQfHBB")
_TRACK: Final = struct.Struct("<H8f")
_DECISION: Final = struct.Struct("<BBBBHIQf")
_DESIGNATION: Final = struct.Struct("<BBH")
_TRACKS_PER_MESSAGE: Final = (_PAYLOAD_SIZE - _REPORT.size) // _TRACK.size
_MOST_TRACKS: Final = 255
_FAR_M: Final = 1e5


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedTrack:
    """A track of one aircraft.

    Attributes:
        number: of the track, from 1; 0 is no track.
        place_m: forward and right.
        velocity_m_s: forward and right, in the frame in which the sender reckons its motion: against the air.
        covariance_m2: of the place: forward variance, covariance, right variance.
        velocity_sigma_m_s: standard deviation of the velocity per axis.
    """

    number: int
    place_m: tuple[float, float]
    velocity_m_s: tuple[float, float]
    covariance_m2: tuple[float, float, float]
    velocity_sigma_m_s: float

    def pack(self) -> bytes:
        """The record on the wire."""
        return _TRACK.pack(
            self.number, *self.place_m, *self.velocity_m_s, *self.covariance_m2, self.velocity_sigma_m_s
        )

    @classmethod
    def read(cls, values: Sequence[Any]) -> "ReportedTrack | None":
        """From unpacked numbers; None for values that are not possible."""
        number, x, y, vx, vy, xx, xy, yy, sigma = values
        if not all(map(math.isfinite, values)) or abs(x) > _FAR_M or abs(y) > _FAR_M or not number:
            return None
        if not (xx > 0.0 and yy > 0.0 and xy * xy <= xx * yy and sigma > 0.0):
            return None
        return cls(
            number=number,
            place_m=(x, y),
            velocity_m_s=(vx, vy),
            covariance_m2=(xx, xy, yy),
            velocity_sigma_m_s=sigma,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackReport:
    """One message of a report: some of the tracks of the tracking aircraft.

    Attributes:
        system: system id of the tracking aircraft, 1 to 255: its onboard computer may have another one.
        report: number of the report, from 0.
        time_us: vehicle time of the sender.
        first: number of the first of `tracks` in the report.
        total: tracks of the report; the message that has the last one ends the report.
        target: number of the designated track; 0: it has none.
        identity: probability that it still is the designated target.
        released: the sender has received the decision, and has handed the target over.
        tracks: by number.
    """

    system: int
    report: int
    time_us: int
    first: int
    total: int
    target: int
    identity: float
    released: bool
    tracks: tuple[ReportedTrack, ...]

    @property
    def last(self) -> bool:
        """Whether it ends the report."""
        return self.first + len(self.tracks) == self.total


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffDecision:
    """The decision of the handoff aircraft, or the best track so far.

    Attributes:
        system: system id of the handoff aircraft, 1 to 255.
        number: of the message, from 0.
        time_us: vehicle time of the sender.
        decided: whether it has decided; otherwise `track` is the best one so far.
        target: number of the sender's partner's track that was compared; 0: none.
        probability: stated with the track.
        track: of the sender.
    """

    system: int
    number: int
    time_us: int
    decided: bool
    target: int
    probability: float
    track: ReportedTrack


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackDesignation:
    """An operator designates a track as the target, or confirms that it is.

    Attributes:
        system: system id of the tracking aircraft, 1 to 255.
        track: number of its track, from 1.
    """

    system: int
    track: int


def track_report_messages(
    *,
    system: int,
    report: int,
    time_us: int,
    target: int,
    identity: float,
    released: bool,
    tracks: Sequence[ReportedTrack],
) -> list[dialect.MAVLink_tunnel_message]:
    """The TUNNEL messages of a report, to all systems and components; one when there is no track.

    Args:
        report: number of the report, modulo 2^32.
        system, time_us, target, identity, released: as in `TrackReport`.
        tracks: at most 255; further ones are left out.
    """
    kept = tracks[:_MOST_TRACKS]
    messages = []
    for first in range(0, max(1, len(kept)), _TRACKS_PER_MESSAGE):
        part = kept[first : first + _TRACKS_PER_MESSAGE]
        payload = _REPORT.pack(
            *(_VERSION, len(part), first, len(kept)),
            *(report & 0xFFFFFFFF, time_us, identity, target, _RELEASED if released else 0, system),
        ) + b"".join(track.pack() for track in part)
        messages.append(_tunnel(TRACK_REPORT_PAYLOAD, payload))
    return messages


def read_track_report(payload_type: int, length: int, payload: Sequence[int]) -> TrackReport | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    if payload_type != TRACK_REPORT_PAYLOAD or not _REPORT.size <= length <= len(payload):
        return None
    data = bytes(payload[:length])
    version, count, first, total, report, time_us, identity, target, flags, system = _REPORT.unpack_from(data)
    if version != _VERSION or not system or first + count > total or (total and not count):
        return None
    if length < _REPORT.size + count * _TRACK.size or not 0.0 <= identity <= 1.0:
        return None
    found = []
    for values in _TRACK.iter_unpack(data[_REPORT.size : _REPORT.size + count * _TRACK.size]):
        track = ReportedTrack.read(values)
        if track is None:
            return None
        found.append(track)
    return TrackReport(
        system=system,
        report=report,
        time_us=time_us,
        first=first,
        total=total,
        target=target,
        identity=identity,
        released=bool(flags & _RELEASED),
        tracks=tuple(found),
    )


def decision_message(decision: HandoffDecision) -> dialect.MAVLink_tunnel_message:
    """The TUNNEL message of a decision, to all systems and components."""
    payload = _DECISION.pack(
        *(_VERSION, _DECIDED if decision.decided else 0, decision.system, 0, decision.target),
        *(decision.number & 0xFFFFFFFF, decision.time_us, decision.probability),
    )
    return _tunnel(HANDOFF_DECISION_PAYLOAD, payload + decision.track.pack())


def read_decision(payload_type: int, length: int, payload: Sequence[int]) -> HandoffDecision | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    size = _DECISION.size + _TRACK.size
    if payload_type != HANDOFF_DECISION_PAYLOAD or not size <= length <= len(payload):
        return None
    data = bytes(payload[:length])
    version, flags, system, _, target, number, time_us, probability = _DECISION.unpack_from(data)
    track = ReportedTrack.read(_TRACK.unpack_from(data, _DECISION.size))
    if version != _VERSION or track is None or not system or not 0.0 <= probability <= 1.0:
        return None
    return HandoffDecision(
        system=system,
        number=number,
        time_us=time_us,
        decided=bool(flags & _DECIDED),
        target=target,
        probability=probability,
        track=track,
    )


def designation_message(designation: TrackDesignation) -> dialect.MAVLink_tunnel_message:
    """The TUNNEL message of a designation, to all systems and components."""
    payload = _DESIGNATION.pack(_VERSION, designation.system, designation.track)
    return _tunnel(TRACK_DESIGNATION_PAYLOAD, payload)


def read_designation(payload_type: int, length: int, payload: Sequence[int]) -> TrackDesignation | None:
    """The content of a TUNNEL message; None for other payloads and for malformed ones. It never raises.

    Args:
        payload_type, length, payload: fields of the message.
    """
    if payload_type != TRACK_DESIGNATION_PAYLOAD or not _DESIGNATION.size <= length <= len(payload):
        return None
    version, system, track = _DESIGNATION.unpack_from(bytes(payload[:length]))
    if version != _VERSION or not system or not track:
        return None
    return TrackDesignation(system=system, track=track)


def _tunnel(payload_type: int, payload: bytes) -> dialect.MAVLink_tunnel_message:
    return dialect.MAVLink_tunnel_message(
        0, 0, payload_type, len(payload), list(payload.ljust(_PAYLOAD_SIZE, b"\0"))
    )
