"""Tracks, designation and decision of a handoff in TUNNEL messages between two aircraft.

MAVLink has no message for tracks of targets relative to an aircraft that may not know its position.
FOLLOW_TARGET and ADSB_VEHICLE have geodetic positions. docs/mavlink/handoff.md has the payloads' tables.
Vectors are forward and right in the level frame of the sender at the time of the message.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.tunnel import Many, Record, Tunnel, Wire, flag

__all__ = [
    "DECISION",
    "DESIGNATION",
    "HANDOFF_DECISION_PAYLOAD",
    "TRACK",
    "TRACK_DESIGNATION_PAYLOAD",
    "TRACK_REPORT",
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

_MOST_TRACKS: Final = 255
_FAR_M: Final = 1e5
_TRACKER: Final = Wire("B", "system id of the tracker, 1 to 255", least=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportedTrack:
    """A track of one aircraft. Velocities are in the frame in which the sender reckons its motion: against
    the air.
    """

    number: Annotated[int, Wire("H", "of the track, from 1", least=1)]
    place_m: Annotated[tuple[float, float], Wire("2f", "forward and right, m", least=-_FAR_M, most=_FAR_M)]
    velocity_m_s: Annotated[tuple[float, float], Wire("2f", "forward and right, m/s")]
    covariance_m2: Annotated[
        tuple[float, float, float],
        Wire("3f", "of the place: forward variance, covariance, right variance, m2"),
    ]
    velocity_sigma_m_s: Annotated[
        float, Wire("f", "standard deviation of the velocity per axis, m/s", name="velocity sigma", above=0.0)
    ]


def _is_track(track: ReportedTrack) -> bool:
    forward_m2, mixed_m2, right_m2 = track.covariance_m2
    return forward_m2 > 0.0 and right_m2 > 0.0 and mixed_m2 * mixed_m2 <= forward_m2 * right_m2


TRACK: Final = Record(ReportedTrack, _is_track)
_IDENTITY: Final = Wire(
    "f", "probability that the target's track still is the designated target, 0..1", least=0.0, most=1.0
)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackReport:
    """One message of a report: some of the tracks of the tracking aircraft. Its onboard computer, which sends
    it, may have another system id.
    """

    first: Annotated[int, Wire("B", "number of the first one in the report")]
    total: Annotated[int, Wire("B", "tracks of the report; the message with the last of them ends it")]
    report: Annotated[int, Wire("I", "number of the report, from 0", modulo=True)]
    time_us: Annotated[int, Wire("Q", "of the tracks, microseconds since the tracker's boot")]
    identity: Annotated[float, _IDENTITY]
    target: Annotated[int, Wire("H", "number of the target's track; 0: it has none")]
    released: Annotated[bool, flag("released, the decision was received")]
    system: Annotated[int, _TRACKER]
    tracks: Annotated[tuple[ReportedTrack, ...], Many(TRACK, "tracks in this message, up to 3")]

    @property
    def last(self) -> bool:
        """Whether it ends the report."""
        return self.first + len(self.tracks) == self.total


@dataclass(frozen=True, slots=True, kw_only=True)
class HandoffDecision:
    """The decision of the handoff aircraft, or the best track so far."""

    decided: Annotated[bool, flag("decided; otherwise the track is the best one so far")]
    system: Annotated[int, Wire("Bx", "system id of the handoff aircraft, 1 to 255", least=1)]
    target: Annotated[int, Wire("H", "number of the tracker's track that was compared; 0: none")]
    number: Annotated[int, Wire("I", "of the message, from 0", modulo=True)]
    time_us: Annotated[int, Wire("Q", "microseconds since the handoff aircraft's boot")]
    probability: Annotated[float, Wire("f", "stated with the track, 0..1", least=0.0, most=1.0)]
    track: Annotated[ReportedTrack, TRACK]


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackDesignation:
    """An operator designates a track as the target, or confirms that it is."""

    system: Annotated[int, _TRACKER]
    track: Annotated[
        int, Wire("H", "number of the tracker's track that is the target: designated, or confirmed", least=1)
    ]


def _is_report(report: TrackReport) -> bool:
    return report.first + len(report.tracks) <= report.total and (report.tracks != () or report.total == 0)


TRACK_REPORT: Final = Tunnel(TrackReport, TRACK_REPORT_PAYLOAD, possible=_is_report)
DECISION: Final = Tunnel(HandoffDecision, HANDOFF_DECISION_PAYLOAD)
DESIGNATION: Final = Tunnel(TrackDesignation, TRACK_DESIGNATION_PAYLOAD)
read_track_report = TRACK_REPORT.read
decision_message, read_decision = DECISION.message, DECISION.read
designation_message, read_designation = DESIGNATION.message, DESIGNATION.read


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
    sent, room = tuple(tracks[:_MOST_TRACKS]), TRACK_REPORT.room
    return [
        TRACK_REPORT.message(
            TrackReport(
                system=system,
                report=report,
                time_us=time_us,
                first=first,
                total=len(sent),
                target=target,
                identity=identity,
                released=released,
                tracks=sent[first : first + room],
            )
        )
        for first in range(0, max(1, len(sent)), room)
    ]
