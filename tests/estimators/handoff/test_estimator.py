"""The estimator `handoff` on the messages of two aircraft over walking targets; inputs that are hostile."""

import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from autopilot_bridge.mavlink.handoff_messages import (
    HANDOFF_DECISION_PAYLOAD,
    TRACK_REPORT_PAYLOAD,
    HandoffDecision,
    ReportedTrack,
    TrackDesignation,
    decision_message,
    designation_message,
    track_report_messages,
)
from autopilot_bridge.mavlink.moving_points import MovingPoints, moving_points_messages
from autopilot_bridge.mavlink.vehicle_motion import (
    VEHICLE_MOTION_PAYLOAD,
    motion_message,
    read_motion_payload,
)
from estimators import wire
from estimators.handoff import HandoffEstimator, HandoffSettings
from estimators.handoff.designation import Designation
from estimators.handoff.scans import ScanAssembler
from estimators.interface import Outcome
from estimators.messages import read_as
from estimators.runner import Runner
from tests.estimators.handoff.scenes import APART, HANDOFF, TRACKER, Scene


@pytest.fixture(scope="module")
def decided():
    scene = Scene()
    assert scene.fly_until_decided(60.0)
    scene.fly(3.0)
    return scene


def test_the_decided_track_is_the_trackers_target_and_the_tracker_is_released(decided):
    target, off_m = decided.target_of(HANDOFF)
    assert target == decided.target_of(TRACKER)[0] and off_m < 6.0
    handoff, tracker = decided.estimator(HANDOFF), decided.estimator(TRACKER)
    assert handoff.decision.decided and handoff.decision.probability >= 0.99
    assert handoff.decision.target == tracker.designation.number
    assert tracker.released and handoff.released  # the answer has come back
    (estimate,) = handoff.estimates
    assert estimate.decided and estimate.converged and len(estimate.row()) == len(estimate.COLUMNS)


def test_the_same_frames_give_the_same_numbers_to_the_bit(decided):
    for system, role in ((HANDOFF, "handoff"), (TRACKER, "tracker")):
        settings = decided.estimator(system).parameters
        assert settings.role == role
        runner = Runner(HandoffEstimator(settings))
        rows, sent = [], []
        for to, frame in decided.frames:
            if to == system and runner.feed(frame) is Outcome.UPDATED:
                rows += [estimate.row() for estimate in runner.estimator.estimates]
                sent += runner.publish()
        np.testing.assert_array_equal(np.array(rows), np.array(decided.rows_of[system]))
        assert sent


def test_scans_are_placed_when_the_aircraft_have_not_booted_together():
    """Camera and gimbal send the time of their own aircraft."""
    scene = Scene()
    for system, boot_unix_s in ((HANDOFF, 1_790_000_000), (TRACKER, 1_790_000_100)):
        unix_us = 1_000_000 * boot_unix_s + 500_000
        scene.say(dialect.MAVLink_system_time_message(unix_us, 500), system)
    scene.fly(4.0)
    for system in (HANDOFF, TRACKER):
        sight = scene.estimator(system).sight
        assert sight.tracks.places and sight.counts["unplaced"] <= 2, (system, sight.counts)


def test_an_old_pressure_makes_no_report_of_the_motion():
    """PX4's SCALED_PRESSURE is by 0.14 s older than its newest inertial sample."""
    times_us: list[int] = []

    class Pressed(Scene):
        def look(self, time_us, system, aircraft):
            old = dialect.MAVLink_scaled_pressure_message(max(0, time_us // 1000 - 140), 1000.0, 3.5, 2000)
            self.say(old, system)
            super().look(time_us, system, aircraft)

    def link(now_us, to, frame):
        message = read_as(frame, wire.TUNNEL)
        if message.payload_type == VEHICLE_MOTION_PAYLOAD:
            fields = message.payload_type, message.payload_length, message.payload
            motion = read_motion_payload(*fields)
            assert motion is not None
            times_us.append(motion.time_us)
        return []

    Pressed(link=link).fly(4.0)
    steps_us = np.diff(times_us)
    assert len(times_us) > 20 and steps_us.min() >= 99_000, steps_us


def encoded(message, system, component=191):
    (frame,) = FrameParser().feed(FrameEncoder(system, component).encode(message))
    return frame


def test_malformed_messages_are_dropped_and_counted(decided):
    tunnel = dialect.MAVLink_tunnel_message(0, 0, TRACK_REPORT_PAYLOAD, 20, [255] * 128)
    handoff, tracker = decided.runners[HANDOFF], decided.runners[TRACKER]
    before = handoff.estimator.counts["malformed"]
    assert handoff.feed(encoded(tunnel, TRACKER)) is Outcome.IMPLAUSIBLE
    assert handoff.estimator.counts["malformed"] == before + 1
    tunnel.payload_type = HANDOFF_DECISION_PAYLOAD
    assert tracker.feed(encoded(tunnel, HANDOFF)) is Outcome.IMPLAUSIBLE
    assert tracker.estimator.counts["malformed"] == 1
    tunnel.payload_type = VEHICLE_MOTION_PAYLOAD
    assert handoff.feed(encoded(tunnel, TRACKER)) is Outcome.IMPLAUSIBLE


def test_of_the_tracker_only_what_its_onboard_computer_sends_is_used(decided):
    handoff = decided.runners[HANDOFF]
    before = handoff.estimator.partner_motion.newest_us
    imu = dialect.MAVLink_highres_imu_message(90_000_000, *[0.0] * 13, 0b1111111111111, 0)  # type: ignore[call-arg]
    assert handoff.feed(encoded(imu, TRACKER, 1)) is Outcome.IGNORED
    other = replace(
        handoff.estimator.pose.own.report(system=4, number=1, time_us=90_000_000), sums=(9e3, 9e3, 0.0, 1.0)
    )
    assert handoff.feed(encoded(motion_message(other), TRACKER)) is Outcome.IGNORED
    assert handoff.estimator.partner_motion.newest_us == before


def tracker_with(number):
    estimator = HandoffEstimator(HandoffSettings(role="tracker"))
    estimator.designation.designate(0, number, (0.0, 0.0))
    return Runner(estimator)


def decision(**changes):
    track = ReportedTrack(
        number=1,
        place_m=(1.0, 2.0),
        velocity_m_s=(0.0, 1.0),
        covariance_m2=(1.0, 0.0, 1.0),
        velocity_sigma_m_s=0.5,
    )
    values = {
        "system": HANDOFF,
        "number": 0,
        "time_us": 5_000_000,
        "decided": True,
        "target": 7,
        "probability": 0.995,
    }
    return decision_message(HandoffDecision(**{**values, **changes}, track=track))


def test_the_tracker_is_released_by_the_decision_about_its_track_and_by_nothing_else():
    runner = tracker_with(7)
    runner.feed(encoded(decision(decided=False), HANDOFF))
    assert not runner.estimator.released
    runner.feed(encoded(decision(target=6, time_us=6_000_000), HANDOFF))
    assert not runner.estimator.released and runner.estimator.counts["decisions_of_another_track"] == 1
    runner.feed(encoded(decision(time_us=7_000_000, system=4), 4))
    assert not runner.estimator.released
    runner.feed(encoded(decision(time_us=5_500_000), HANDOFF))  # late
    assert not runner.estimator.released
    runner.feed(encoded(decision(time_us=7_000_000), HANDOFF))
    assert runner.estimator.released


def test_an_operator_designates_a_track_of_this_aircraft_and_no_other(decided):
    runner = decided.runners[TRACKER]
    tracker, designation = runner.estimator, runner.estimator.designation
    other = next(number for number in tracker.sight.tracks.places if number != designation.number)
    before, count = designation.number, designation.count
    for system, track in ((HANDOFF, other), (TRACKER, 60_000)):
        runner.feed(encoded(designation_message(TrackDesignation(system=system, track=track)), 255, 190))
        assert (designation.number, designation.count) == (before, count)
    assert tracker.counts["designations_of_no_track"] == 1
    for number in (other, before):
        runner.feed(encoded(designation_message(TrackDesignation(system=TRACKER, track=number)), 255, 190))
        assert designation.number == number and designation.probability == 1.0
    assert designation.count == count + 2 and tracker.counts["designations"] == 2


def part(time_us, first, points, total, scan=0):
    return MovingPoints(
        scan=scan, time_us=time_us, first=first, total=total, sigma=0.002, points=tuple(points)
    )


def test_scans_are_put_together_from_messages_in_any_order():
    scans = ScanAssembler()
    assert scans.add(part(100, 1, [(0.2, 0.0)], 2)) == []
    (scan,) = scans.add(part(100, 0, [(0.1, 0.0)], 2))
    assert scan.points == {0: (0.1, 0.0), 1: (0.2, 0.0)}
    assert scans.add(part(100, 0, [(0.1, 0.0)], 2)) == [] and scans.add(part(50, 0, [], 0)) == []
    assert scans.add(part(200, 0, [(0.3, 0.0)], 2, scan=1)) == []
    first, second = scans.add(part(300, 0, [], 0, scan=4))  # the other point was lost
    assert (len(first.points), first.total, second.total) == (1, 2, 0)
    assert scans.counts == Counter(complete=2, repeated=1, late=1, incomplete=1, missed=2)


def test_an_identity_becomes_doubtful_when_tracks_meet_and_is_restored_by_the_operator():
    designation = Designation()
    designation.designate(0, 1, (0.0, 0.0))
    designation.update(100, {1: (0.0, 0.0), 2: (30.0, 0.0)})
    assert designation.probability == pytest.approx(1.0)
    designation.update(200, {1: (0.0, 0.0), 2: (0.2, 0.0)})
    met = designation.probability
    assert 0.5 <= met < 0.55
    designation.update(300, {1: (0.0, 0.0), 2: (30.0, 0.0)})
    assert designation.probability == met  # it stays doubtful
    designation.designate(400, 1, (0.0, 0.0))
    assert designation.probability == 1.0
    designation.update(500, {3: (2.0, 0.0)})  # lost, and a new track where it was
    assert designation.number == 3 and 0.99 < designation.probability < 1.0
    designation.update(6_000_000, {4: (90.0, 0.0)})
    assert designation.number is None and designation.expected == pytest.approx((2.0, 0.0), abs=1.0)


def test_a_lost_target_is_found_again_by_its_place_the_less_surely_the_later():
    found = []
    for gap_s in (1, 5, 20):
        designation = Designation()
        designation.designate(0, 1, (0.0, 0.0))
        for k in range(1, 31):  # it walks at 1 m/s
            designation.update(100_000 * k, {1: (0.1 * k, 0.0), 2: (60.0, 0.0)})
        designation.update(3_100_000, {2: (60.0, 0.0)})
        assert designation.number is None
        designation.update(3_000_000 + 1_000_000 * gap_s, {2: (60.0, 0.0), 3: (3.0 + gap_s, 0.0)})
        found.append(designation.probability)
        assert designation.number == 3
    assert found == sorted(found, reverse=True) and found[0] > 0.99 and found[-1] < 0.995


def test_a_track_that_leaves_its_target_leaves_the_identity_to_the_one_that_is_measured():
    designation = Designation()
    designation.designate(0, 1, (0.0, 0.0))
    for k in range(1, 60):
        places = {1: (0.3 * k, 0.0), 2: (1.0, 0.0)} if k > 1 else {1: (0.0, 0.0)}
        designation.update(100_000 * k, places, doubtful=frozenset({1} if k > 20 else ()))
    assert designation.number == 2 and designation.probability == pytest.approx(0.998, abs=1e-4)


def test_tracks_that_end_on_one_target_leave_it_open_whose_the_other_one_is():
    """Both targets walk on, one with the track that is left, the other without, until a new one begins."""
    designation = Designation()
    designation.designate(0, 1, (0.0, 0.0))
    for k in range(1, 20):
        designation.update(100_000 * k, {1: (0.0, 0.0), 2: (30.0 - 1.5 * k, 0.0)})
    assert designation.number == 1 and 0.6 < designation.probability < 0.7  # they may have exchanged
    designation.update(2_000_000, {1: (0.0, 0.0)})
    left = designation.probability
    assert 0.45 < left < 0.55
    for k in range(21, 100):  # the new one begins beside it, and then they part
        designation.update(100_000 * k, {1: (0.0, 0.0), 3: (2.0 + 0.2 * (k - 21), 0.0)})
    assert designation.number == 1 and designation.probability == pytest.approx(left, abs=0.15)
    shares = {number: track.weight for number, track in designation._living.items()}
    assert shares[3] > 0.3 and shares[1] + shares[3] > 0.95


def test_the_target_of_a_track_that_was_drawn_away_is_where_it_was_measured_last():
    """Its next track begins there, while the old one still is on its way."""
    designation = Designation()
    designation.designate(0, 1, (0.0, 0.0))
    for k in range(1, 61):
        away_m = max(0.0, 1.2 * (k - 40))
        places = {1: (away_m, 0.0), 2: (60.0, 0.0)}
        if k > 55:
            places[3] = (1.0, 0.0)
        designation.update(100_000 * k, places, doubtful=frozenset({1} if k > 45 else ()))
    assert designation.number == 1
    designation.update(6_100_000, {2: (60.0, 0.0), 3: (1.0, 0.0)})
    assert designation.number == 3 and 0.95 < designation.probability < 1.0


def test_looks_are_counted_once_whatever_other_tracks_do():
    """Looks of a target in another light, and tracks far away that begin and end."""

    def stated(others):
        designation = Designation()
        designation.designate(0, 1, (0.0, 0.0), 0.9)
        for k in range(1, 600):
            places = {1: (0.0, 0.0), 2: (40.0, 0.0)}
            if others:
                places[3 + k // 5] = (120.0, 0.0)
            looks = {1: np.array([-40.0, 20.0, 36.0]), 2: np.array([-45.0, 12.0, 33.0])}
            designation.update(100_000 * k, places, looks)
            if k == 100:
                designation.designate(100_000 * k, 1, (0.0, 0.0), 0.97)
        return designation.probability

    assert stated(others=True) == pytest.approx(stated(others=False), abs=0.004)


def test_a_target_that_stays_lost_is_less_probably_lost_and_never_surely_another_one():
    designation = Designation()
    designation.designate(0, 1, (0.0, 0.0), 0.9)
    designation.update(100_000, {1: (0.0, 0.0)})  # one tenth: a target without a track
    before = designation.probability
    for k in range(2, 600):
        designation.update(100_000 * k, {1: (0.0, 0.0), 2: (60.0, 0.0)})
    assert before == pytest.approx(0.9, abs=0.01) and 0.98 < designation.probability < 1.0
    for k in range(600, 1200):
        designation.update(100_000 * k, {2: (60.0, 0.0)})
    assert designation.number is None


def test_looks_tell_which_of_two_tracks_that_met_is_the_target():
    rng = np.random.default_rng(3)
    red, grey = np.array([-40.0, 25.0, 36.0]), np.array([-45.0, 0.0, 32.0])

    def met(exchanged):
        designation = Designation()
        designation.designate(0, 1, (0.0, 0.0))
        for k in range(1, 800):
            off_m = 30.0 if k < 300 or k > 320 else 0.5
            looks = (grey, red) if exchanged and k > 320 else (red, grey)
            noisy = {number: look + rng.normal(0.0, 4.0, 3) for number, look in enumerate(looks, start=1)}
            designation.update(100_000 * k, {1: (0.0, 0.0), 2: (off_m, 0.0)}, noisy)
        return designation.number, designation.probability

    assert met(False)[0] == 1 and met(True)[0] == 2
    assert min(met(False)[1], met(True)[1]) > 0.9


def test_an_operator_who_sees_another_one_under_the_mark_refuses_it():
    designation = Designation()
    designation.designate(0, 1, (0.0, 0.0), 0.9)
    designation.update(100_000, {1: (0.0, 0.0), 2: (30.0, 0.0)})
    designation.refuse(1, 0.9)
    before = designation.probability
    assert designation.number is None or before < 0.6
    designation.designate_place(200_000, (50.0, 0.0), 0.99)
    designation.update(300_000, {1: (0.0, 0.0), 2: (30.0, 0.0), 3: (51.0, 0.0)})
    assert designation.number == 3 and designation.probability > 0.95


def test_a_second_track_of_the_same_target_leaves_no_doubt():
    """It begins beside the target's track, takes its place, and is another target only once it was away."""
    designation = Designation()
    designation.designate(0, 1, (0.0, 0.0))
    designation.update(100, {1: (0.0, 0.0), 2: (1.0, 0.0)})
    assert designation.probability > 0.999
    designation.update(200, {2: (1.0, 0.0)})
    assert designation.number == 2 and designation.probability == pytest.approx(0.998, abs=1e-4)
    designation.update(300, {2: (1.0, 0.0), 3: (20.0, 0.0)})
    designation.update(400, {2: (1.0, 0.0), 3: (2.0, 0.0)})
    assert designation.probability < 0.6


# The bad inputs below take seconds each.


@pytest.mark.slow
def test_delays_losses_and_repetitions_change_the_time_and_not_the_decision():
    rng = np.random.default_rng(1)

    def poor(now_us, to, frame):
        copies = [] if rng.random() < 0.3 else [frame] * (1 + (rng.random() < 0.2))
        return [(now_us + round(1e6 * rng.exponential(0.3)), to, copy) for copy in copies]

    scene = Scene(link=poor)
    assert scene.fly_until_decided(90.0)
    scene.fly(8.0)
    assert scene.target_of(HANDOFF)[0] == scene.target_of(TRACKER)[0]
    assert scene.estimator(TRACKER).released and scene.estimator(HANDOFF).released
    assert scene.estimator(HANDOFF).counts["late"] > 0


@pytest.mark.slow
def test_without_any_message_to_it_the_tracker_is_not_released():
    scene = Scene(link=lambda now_us, to, frame: [(now_us, to, frame)] if to == HANDOFF else [])
    assert scene.fly_until_decided(60.0)
    scene.fly(10.0)
    assert not scene.estimator(TRACKER).released and not scene.estimator(HANDOFF).released


@pytest.mark.slow
def test_without_a_range_for_60_s_nothing_is_decided_and_afterwards_the_right_track():
    scene = Scene()
    scene.fly(60.0, ranges=False)
    assert scene.decided is None
    assert scene.fly_until_decided(60.0)
    assert scene.target_of(HANDOFF)[0] == scene.target_of(TRACKER)[0]


@pytest.mark.slow
@pytest.mark.parametrize("meet_s", [15.0, 30.0, 40.0])
def test_targets_that_cross_are_not_confused_with_confidence(meet_s):
    """The designated target and another one walk through the same place."""
    crossing = [(0.9, 0.4), (-0.9, 0.5), (0.2, -1.2), (-1.0, 0.3)]
    places = [place for place, _ in APART]
    meet = np.array(places[0]) + meet_s * np.array(crossing[0])
    places[1] = tuple(meet - meet_s * np.array(crossing[1]))
    scene = Scene(list(zip(places, crossing, strict=True)))
    started = None
    for _ in range(90):
        scene.fly(1.0)
        if started is None and scene.estimator(TRACKER).designation.number is not None:
            started = scene.target_of(TRACKER)[0]
        if scene.decided is not None:
            break
    if scene.decided is not None:
        assert scene.target_of(HANDOFF)[0] == started


@pytest.mark.slow
def test_a_target_that_stops_is_lost_and_not_decided_for():
    scene = Scene()
    while scene.estimator(TRACKER).designation.number is None:
        scene.fly(0.5)
    started, _ = scene.target_of(TRACKER)
    scene.velocities = scene.velocities.copy()
    scene.velocities[started] = 0.0
    scene.fly(40.0)
    designation = scene.estimator(TRACKER).designation
    assert scene.decided is None
    # another target has come near its place meanwhile, and may be it
    assert designation.number is None or designation.probability <= 0.5


@pytest.mark.slow
def test_two_targets_side_by_side_are_not_decided_between():
    side = [*APART, ((-20.0, 11.0), (0.9, 0.4))]
    scene = Scene(side)
    scene.fly(60.0)
    handoff = scene.estimator(HANDOFF)
    if scene.decided is not None:  # the other target was designated
        assert scene.target_of(HANDOFF)[0] == scene.target_of(TRACKER)[0]
    else:
        assert max(handoff.process.comparison.scores.values(), default=0.0) < 0.99


@pytest.mark.slow
def test_messages_of_other_aircraft_change_nothing(decided):
    """Everything again, and between the frames what a fourth aircraft sends."""
    settings = decided.estimator(HANDOFF).parameters
    runner = Runner(HandoffEstimator(settings))
    strange = [
        *moving_points_messages(1, 5_000_000, [(0.1, 0.1)], 0.002),
        *track_report_messages(
            system=4, report=1, time_us=5_000_000, target=1, identity=1.0, released=True, tracks=[]
        ),
        decision(system=4),
        dialect.MAVLink_highres_imu_message(5_000_000, *([math.nan] * 9), 900.0, 9.0, 90.0, 20.0, 0xFFFF, 0),  # type: ignore[call-arg]
    ]
    rows = []
    for count, (to, frame) in enumerate(decided.frames):
        if to == HANDOFF and runner.feed(frame) is Outcome.UPDATED:
            rows += [estimate.row() for estimate in runner.estimator.estimates]
        if count % 10 == 0:
            runner.feed(encoded(strange[count // 10 % len(strange)], 4, 1))
    np.testing.assert_array_equal(np.array(rows), np.array(decided.rows_of[HANDOFF]))
