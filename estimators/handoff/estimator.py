"""The estimator `handoff`: which track of the handoff aircraft is the tracker's target, without GPS
(Tolman et al. 2021; docs/handoff.md).

It runs on both aircraft, and each uses the sensors of its own. On the tracker it tracks what moves, follows
the designated track, reports its motion and all tracks, and receives the decision. On the handoff aircraft it
estimates the relative pose, tracks what moves, compares its tracks with the reported ones, and decides.
"""

import math
from collections import Counter, deque
from collections.abc import Mapping, Sequence
from typing import ClassVar, Final

from autopilot_bridge.mavlink import MAVLinkMessage
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.handoff_messages import (
    HANDOFF_DECISION_PAYLOAD,
    TRACK_DESIGNATION_PAYLOAD,
    TRACK_REPORT_PAYLOAD,
    HandoffDecision,
    TrackReport,
    decision_message,
    read_decision,
    read_designation,
    read_track_report,
    track_report_messages,
)
from autopilot_bridge.mavlink.moving_points import MOVING_POINTS_PAYLOAD
from autopilot_bridge.mavlink.vehicle_motion import (
    VEHICLE_MOTION_PAYLOAD,
    VehicleMotion,
    motion_message,
    read_motion_payload,
)
from estimators import wire
from estimators.handoff.dead_reckoning import DeadReckoning, ReckonedPath
from estimators.handoff.designation import Designation
from estimators.handoff.estimate import HandoffEstimate
from estimators.handoff.evidence import EvidenceComparison
from estimators.handoff.models import evidence_of, ransac_of, windows_of
from estimators.handoff.operator_place import OperatorPlace
from estimators.handoff.process import HandoffProcess, TrackerReport
from estimators.handoff.reports import ReportAssembler, reported_track, reported_tracks
from estimators.handoff.settings import HandoffSettings
from estimators.handoff.sight import AircraftSight
from estimators.interface import Estimator, Need, Outcome
from estimators.messages import Message, is_a
from estimators.relative_pose.aircraft import AircraftState
from estimators.relative_pose.estimator import RelativePoseEstimator
from estimators.relative_pose.reported_aircraft import ReportedAircraft
from estimators.tracking.recursive_ransac import RecursiveRansac
from estimators.vehicle_time import UNIX_TIME_US

_AGAIN: Final = 0.5  # probability that the nearest track is of a target that was lost
_LOST_S: Final = 5.0  # after which the nearest track is taken
_PATH_S: Final = 5.0
_PENDING_US: Final = 2_000_000
_RECEIVED: Final = (
    TRACK_REPORT_PAYLOAD,
    HANDOFF_DECISION_PAYLOAD,
    TRACK_DESIGNATION_PAYLOAD,
    VEHICLE_MOTION_PAYLOAD,
)


class HandoffEstimator(Estimator[HandoffSettings]):
    """The part of one aircraft in a handoff.

    Attributes:
        sight: what the own aircraft sees.
        partner_motion: motion of the tracker, on the handoff aircraft.
        pose: relative pose, on the handoff aircraft.
        process: comparison and decision, on the handoff aircraft.
        designation: the target's track, on the tracker.
        decision: the newest decision: made, or received.
        released: the tracker has received the decision.
        counts: messages between the aircraft by what became of them.
    """

    NAME: ClassVar[str] = "handoff"
    PARAMETERS = HandoffSettings
    TEAM: ClassVar[bool] = True

    def __init__(self, parameters: HandoffSettings | None = None) -> None:
        super().__init__(parameters)
        self.partner_motion = ReportedAircraft()
        self.pose = RelativePoseEstimator(self.parameters, self.partner_motion)
        self._tracks = self.parameters.role == "tracker"
        self._state = AircraftState() if self._tracks else self.pose.own
        self.reset()

    @property
    def needs(self) -> tuple[Need, ...]:
        """The messages of the own aircraft, and those of the other one's onboard computer."""
        needs = [
            *self.pose.needs,
            Need(
                messages=("GIMBAL_DEVICE_ATTITUDE_STATUS",),
                rate_hz=5.0,
                wanted_rate_hz=25.0,
                purpose="attitude of the camera",
            ),
        ]
        if self._tracks and self.parameters.target_north_m is not None:
            needs += self._place.needs
        return tuple(needs)

    def reset(self) -> None:
        """Discard everything except the parameters."""
        self._ground: float | None = self.parameters.ground_altitude_m
        self._now_us: int | None = None
        self.pose.reset()
        self._state.reset()
        self._restart()

    def _restart(self) -> None:
        """Discard everything except the parameters and the height of the ground."""
        p = self.parameters
        self.own = p.other if self._tracks else p.vehicle
        self.partner = p.vehicle if self._tracks else p.other
        self._place = OperatorPlace(p.target_north_m, p.target_east_m)
        keep_s = 1.5 * windows_of(p).span_s + 1.0
        self.sight = AircraftSight(
            self._state,
            RecursiveRansac(ransac_of(p)),
            keep_s,
            tilt_sigma_rad=p.tilt_step_rad,
            ground_m=self._ground,
        )
        self.designation = Designation()
        self._partner_path = ReckonedPath(_PATH_S)  # by the partner's clock
        self.partner_motion.on_motion = self._partner_path.advance
        self._partner_now = DeadReckoning()
        self.process = HandoffProcess(
            self.pose.pose,
            self.sight.tracks,
            EvidenceComparison(evidence_of(p)),
            windows_of(p),
            self._partner_now,
        )
        self._assembler = ReportAssembler()
        self._pending: deque[TrackReport] = deque(maxlen=50)
        self.counts: Counter[str] = self._assembler.counts
        self.decision: HandoffDecision | None = None
        self.released = False
        self._sent_us: int | None = None
        self._motion_sent_us: int | None = None
        self._number = self._motion_number = 0
        self._outbox: list[MAVLinkMessage] = []
        self._estimates: tuple[HandoffEstimate, ...] = ()

    def handle(self, time_us: int, message: Message) -> Outcome:
        if is_a(message, wire.TUNNEL) and message.payload_type in _RECEIVED:
            return self._from_elsewhere(message)
        if message.src_system != self.own:
            return Outcome.IGNORED
        if message.src_component == AUTOPILOT_COMPONENT and (
            is_a(message, wire.HIGHRES_IMU) or is_a(message, wire.RAW_IMU)
        ):
            self._now_us = time_us
            if message.time_usec < UNIX_TIME_US:
                self.sight.offset_us = time_us - message.time_usec
        if is_a(message, wire.TUNNEL):
            return self._tunnel(time_us, message)
        outcome = self.sight.take(time_us, message)
        self._ground = None if math.isnan(self.sight.height.ground_m) else self.sight.height.ground_m
        if self._tracks:
            self._place.take(time_us, message)
            fused = self._state.take(time_us, message)
        else:
            fused = self.pose.handle(time_us, message)
        if fused is Outcome.TIME_JUMP:
            self._restart()
            return fused
        if self._tracks:
            if fused is Outcome.USED:
                self._report_motion()
        else:
            self._receive_pending(time_us)
            if fused is Outcome.UPDATED:
                return self._compare(time_us)
        return fused if fused is not Outcome.IGNORED else outcome

    # messages between the aircraft

    def _tunnel(self, time_us: int, message: wire.TUNNEL) -> Outcome:
        if message.payload_type == MOVING_POINTS_PAYLOAD:
            outcome = self.sight.take(time_us, message)
            return self._report(time_us) if outcome is Outcome.UPDATED and self._tracks else outcome
        fused = Outcome.IGNORED if self._tracks else self.pose.handle(time_us, message)
        if fused is Outcome.TIME_JUMP:
            self._restart()
        return self._compare(time_us) if fused is Outcome.UPDATED else fused

    def _from_elsewhere(self, message: wire.TUNNEL) -> Outcome:
        """Motion, a report or a decision, which the onboard computer of the other aircraft sends, or a
        designation by the operator.
        """
        kind = message.payload_type
        wire = (kind, message.payload_length, message.payload)
        if kind == TRACK_REPORT_PAYLOAD and not self._tracks:
            part = read_track_report(*wire)
            if part is None:
                return self._malformed()
            if part.system != self.partner:
                return Outcome.IGNORED
            report = self._assembler.add(part)
            if report is not None:
                self._pending.append(report)
            return Outcome.USED
        if kind == VEHICLE_MOTION_PAYLOAD and not self._tracks:
            motion = read_motion_payload(*wire)
            if motion is None:
                return self._malformed()
            return self._on_motion(motion) if motion.system == self.partner else Outcome.IGNORED
        if kind == HANDOFF_DECISION_PAYLOAD and self._tracks:
            decision = read_decision(*wire)
            if decision is None:
                return self._malformed()
            return self._on_decision(decision) if decision.system == self.partner else Outcome.IGNORED
        if kind == TRACK_DESIGNATION_PAYLOAD and self._tracks:
            designated = read_designation(*wire)
            if designated is None:
                return self._malformed()
            return (
                self._on_designation(designated.track) if designated.system == self.own else Outcome.IGNORED
            )
        return Outcome.IGNORED

    def _malformed(self) -> Outcome:
        self.counts["malformed"] += 1
        return Outcome.IMPLAUSIBLE

    def _on_motion(self, motion: VehicleMotion) -> Outcome:
        """The motion of the tracker. Its arrival has the time of the newest own sample."""
        if self._now_us is None:
            return Outcome.WAITING
        outcome = self.partner_motion.take(self._now_us, motion)
        if outcome is Outcome.TIME_JUMP:  # it has started again: nothing of before is of its new reckoning
            self.pose.reset()
            self._restart()
        return outcome

    def _on_decision(self, decision: HandoffDecision) -> Outcome:
        """The tracker receives a decision: it releases the target when it is about its designated track."""
        known = self.decision
        if known is not None and 0 <= known.time_us - decision.time_us < 1_000_000:
            self.counts["repeated" if known.time_us == decision.time_us else "late"] += 1
            return Outcome.LATE
        self.decision = decision
        self.counts["decisions"] += 1
        if decision.decided and decision.target and decision.target == self.designation.number:
            self.released = True
        elif decision.decided:
            self.counts["decisions_of_another_track"] += 1
        return Outcome.USED

    def _on_designation(self, number: int) -> Outcome:
        tracks = self.sight.tracks
        place = tracks.places.get(number)
        if place is None:
            self.counts["designations_of_no_track"] += 1
            return Outcome.LATE
        self.counts["designations"] += 1
        self.designation.designate(tracks.time_us, number, place)
        return Outcome.USED

    def _receive_pending(self, time_us: int) -> None:
        """Process the reports whose motion is known."""
        while self._pending:
            report = self._pending[0]
            taken_us = report.time_us + self.partner_motion.offset_us
            taken = self._partner_path.at(report.time_us)
            newest_us = self._partner_path.time_us
            to_come = newest_us is None or report.time_us > newest_us
            if taken is None and to_come and time_us - taken_us < _PENDING_US:
                return  # the sender's motion up to then is still to come
            self._pending.popleft()
            if taken is None:
                self.counts["unplaced"] += 1
                continue
            self.released = self.released or report.released
            self.process.receive(
                taken_us,
                TrackerReport(
                    tracks={track.number: track.place_m for track in report.tracks},
                    number=report.target or None,
                    identity=report.identity,
                ),
                taken,
            )

    # what the aircraft do

    def _report(self, time_us: int) -> Outcome:
        """The tracker has new tracks: designate, and report."""
        p, tracks, designation = self.parameters, self.sight.tracks, self.designation
        taken_us = tracks.time_us
        taken = self.sight.path.at(taken_us)
        if taken is None:
            return Outcome.WAITING
        designation.update(taken_us, tracks.places, tracks.looks, tracks.doubtful)
        if not designation.count or designation.lost_s > _LOST_S:  # by its place
            level = tracks.level(taken)
            expected = self._place.level(time_us)
            if level and expected is not None:
                number = min(level, key=lambda k: math.dist(level[k], expected))
                if math.dist(level[number], expected) <= p.designate_m:
                    sure = _AGAIN if designation.count else 1.0
                    designation.designate(taken_us, number, tracks.places[number], sure)
        if self._due(time_us, p.report_s):
            self._outbox += track_report_messages(
                system=self.own,
                report=self._number,
                time_us=taken_us - self.sight.offset_us,
                target=designation.number or 0,
                identity=designation.probability,
                released=self.released,
                tracks=reported_tracks(tracks, taken),
            )
            self._number += 1
        place = self.target()
        self._estimates = (
            HandoffEstimate(
                time_us=time_us,
                subject=self.own,
                target_m=place or (math.nan, math.nan),
                track=designation.number or 0,
                probability=0.0 if designation.number is None else designation.probability,
                identity=designation.probability,
                decided=self.decision is not None and self.decision.decided,
                released=self.released,
                tracks=len(tracks.places),
                pose_sigma_m=math.nan,
                converged=False,
            ),
        )
        return Outcome.UPDATED

    def _report_motion(self) -> None:
        """Report the tracker's motion up to its newest inertial sample, when it is due. A pressure may be
        older than that: PX4's SCALED_PRESSURE is by some 0.15 s.
        """
        time_us, sent_us = self._state.newest_us, self._motion_sent_us
        if time_us is None or not self._state.moved:
            return
        if sent_us is not None and 0 <= time_us - sent_us < round(1e6 * self.parameters.motion_s):
            return
        self._motion_sent_us = time_us
        self._outbox.append(
            motion_message(
                self._state.report(
                    system=self.own, number=self._motion_number, time_us=time_us - self.sight.offset_us
                )
            )
        )
        self._motion_number += 1

    def _due(self, time_us: int, every_s: float) -> bool:
        if self._sent_us is not None and 0 <= time_us - self._sent_us < round(1e6 * every_s):
            return False
        self._sent_us = time_us
        return True

    def _compare(self, time_us: int) -> Outcome:
        """The handoff aircraft has moved the pose: compare, and send the decision."""
        process, p = self.process, self.parameters
        now, known = self._partner_now, self._partner_path.newest
        now.x_m, now.y_m, now.heading_rad = known.x_m, known.y_m, known.heading_rad
        now.advance(*self.partner_motion.since_report(time_us))
        process.compare(time_us, self.sight.height_m)
        scores = process.comparison.scores
        number = process.comparison.decided
        if number is None:
            number = max(scores, key=lambda key: scores[key], default=None)
        report = process.report
        if number is not None and not self.released and self._due(time_us, p.decision_s):
            self._decide(time_us, number, scores.get(number, 0.0))
        best, place = process.pose.best, process.target()
        self._estimates = (
            HandoffEstimate(
                time_us=time_us,
                subject=self.own,
                target_m=place or (math.nan, math.nan),
                track=number or 0,
                probability=scores.get(number, 0.0) if number is not None else 0.0,
                identity=1.0 if report is None else report.identity,
                decided=process.comparison.decided is not None,
                released=self.released,
                tracks=len(self.sight.tracks.places),
                pose_sigma_m=math.nan if best is None else best.horizontal_sigma_m,
                converged=process.pose.converged,
            ),
        )
        return Outcome.UPDATED

    def _decide(self, time_us: int, number: int, probability: float) -> None:
        tracks, report = self.sight.tracks, self.process.report
        found = next((track for track in tracks.tracker.tracks if track.number == number), None)
        if found is None or report is None or report.number is None:
            return
        decision = HandoffDecision(
            system=self.own,
            number=self._number,
            time_us=time_us - self.sight.offset_us,
            decided=self.process.comparison.decided is not None,
            target=report.number,
            probability=probability,
            track=reported_track(found, self.sight.path.newest),
        )
        self._number += 1
        if self.decision is None or not self.decision.decided:
            self.decision = decision
        self._outbox.append(decision_message(decision))

    def target(self) -> tuple[float, float] | None:
        """Forward and right of the target, or of where it is expected, in the present level frame; None: not
        known.
        """
        if not self._tracks:
            return self.process.target()
        number = self.designation.number
        return None if number is None else self.sight.tracks.level().get(number)

    @property
    def estimates(self) -> Sequence[HandoffEstimate]:
        """The newest estimate."""
        return self._estimates

    def publish(self) -> Sequence[MAVLinkMessage]:
        """Motion and track reports, or decisions, since the last call."""
        outbox, self._outbox = self._outbox, []
        return outbox

    def remarks(self) -> Mapping[str, float | str]:
        """Scans and messages by what became of them, and the decision."""
        found: dict[str, float | str] = {
            **{f"scans_{name}": float(count) for name, count in sorted(self.sight.counts.items())},
            **{f"messages_{name}": float(count) for name, count in sorted(self.counts.items())},
            **{f"motion_{name}": float(count) for name, count in sorted(self.partner_motion.counts.items())},
            "released": float(self.released),
        }
        if self._tracks:
            return {**found, "identity": self.designation.probability}
        decision = self.decision
        if decision is not None and decision.decided:
            found |= {"probability": decision.probability, "track": float(decision.track.number)}
        else:
            found["note"] = "no track was decided for"
        return {**found, "resets": float(self.process.pose.resets)}
