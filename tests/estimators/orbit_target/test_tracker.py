"""The tracker: what it knows, loses and finds again; late, missing and wrong inputs."""

import math

import pytest

from estimators.interface import Outcome
from estimators.orbit_target.attitude import AutopilotAttitude
from estimators.orbit_target.parameters import TrackerParameters
from estimators.orbit_target.tracker import TargetStatus, TargetTracker
from estimators.tracking.line_of_sight import Detection, GimbalAttitude
from tests.missions.orbit.coordinated_turn import PointMass


class Rig:
    """An aircraft in a steady bank around a still target, in 4 m/s of wind, with the tracker on it."""

    def __init__(self, **world):
        self.aircraft = PointMass(position=(-150.0, 0.0), heading=math.radians(-90.0), gust=0.0, **world)
        self.attitude = AutopilotAttitude()
        self.tracker = TargetTracker(self.attitude)
        self.tracker.start(
            0, offset_ne_m=(160.0, 5.0), offset_std_m=20.0, drift_ne_m_s=(-4.0, 0.0), drift_std_m_s=1.0
        )

    def run(self, seconds):
        end_us = self.aircraft.time_us + round(seconds * 1e6)
        a, tracker = self.aircraft, self.tracker
        while a.time_us < end_us:
            now, gimbal, airspeed, height, detections = a.step(math.radians(23.0))
            self.attitude.add(*now)
            tracker.gimbal(gimbal)
            tracker.height(height)
            for found in detections:
                tracker.detect(found)
            tracker.step(a.time_us, airspeed)
            a.pointed = tracker.pointing(a.time_us, 0.1)
        return tracker

    @property
    def error_m(self):
        true = self.aircraft.target - self.aircraft.p
        return math.dist(self.tracker.state(self.aircraft.time_us).offset_ne_m, true)


def test_expected_seen_lost_and_seen_again():
    rig = Rig()
    assert rig.tracker.status is TargetStatus.EXPECTED
    assert math.isinf(rig.tracker.unseen_s(0))
    assert rig.run(5.0).status is TargetStatus.SEEN
    assert rig.error_m < 8.0
    rig.aircraft.blind = True
    assert rig.run(2.0).status is TargetStatus.SEEN
    assert rig.run(4.0).status is TargetStatus.LOST
    assert rig.tracker.losses == 1
    assert rig.tracker.unseen_s(rig.aircraft.time_us) == pytest.approx(6.0, abs=0.3)
    assert rig.error_m < 20.0  # it goes on by what it knows
    rig.aircraft.blind = False
    assert rig.run(3.0).status is TargetStatus.SEEN
    assert rig.error_m < 8.0
    rig.tracker.count_anew()  # what was lost on the way is not the orbit's
    assert rig.run(1.0).losses == 0
    assert 0 < rig.tracker.target.accepted <= 30


def test_one_detection_at_the_limit_of_the_camera_is_no_acquisition_and_silence_after_it_no_loss():
    rig = Rig()
    detect, left = rig.tracker.detect, [0]

    def limited(found):
        if left[0] > 0:
            left[0] -= 1
            detect(found)

    rig.tracker.detect = limited
    for count in (1, 2):
        left[0] = count
        assert rig.run(6.0).status is TargetStatus.EXPECTED
        assert left[0] == 0
    assert rig.tracker.target.accepted == 3  # the last two came more than 3 s after the first
    assert rig.tracker.losses == 0
    left[0] = 3
    assert rig.run(2.0).status is TargetStatus.SEEN
    assert rig.run(4.0).status is TargetStatus.LOST
    assert rig.tracker.losses == 1


def test_a_target_is_seen_while_its_expected_place_is_still_renewed():
    """As with GPS: the given place is taken anew every step, and images come later than that."""
    rig = Rig()
    accepted = 0
    for _ in range(100):
        rig.run(0.04)
        accepted += rig.tracker.status is TargetStatus.SEEN
        n, e = rig.aircraft.target - rig.aircraft.p
        rig.tracker.start(
            rig.aircraft.time_us,
            offset_ne_m=(float(n) + 8.0, float(e)),
            offset_std_m=20.0,
            drift_ne_m_s=(0.0, 0.0),
            drift_std_m_s=2.0,
        )
    assert accepted > 20


def test_numbers_that_are_none_leave_the_estimate_as_it_was():
    rig = Rig()
    rig.run(3.0)
    for nothing in (math.nan, math.inf):
        assert rig.attitude.add(rig.aircraft.time_us + 1000, 0.0, nothing, 0.0) is Outcome.NOT_FINITE
        rig.tracker.step(rig.aircraft.time_us + 2000, nothing)
        rig.tracker.step(rig.aircraft.time_us + 2000, 25.0, nothing)
    rig.run(1.0)
    assert rig.error_m < 8.0


def test_nothing_is_made_of_images_without_attitude_height_or_gimbal():
    attitude = AutopilotAttitude()
    tracker = TargetTracker(attitude)
    image = Detection(time_us=1_000_000, target=0, image_x=0.0, image_y=0.0)
    look = GimbalAttitude(time_us=990_000, q=(1.0, 0.0, 0.0, 0.0), from_north=True)
    tracker.detect(image)
    tracker.step(1_050_000, 25.0)  # no attitude at all
    tracker.start(
        1_000_000, offset_ne_m=(200.0, 0.0), offset_std_m=20.0, drift_ne_m_s=(0.0, 0.0), drift_std_m_s=1.0
    )
    attitude.add(1_000_000, 0.0, 0.0, 0.0)
    tracker.step(1_060_000, 25.0)  # no height
    tracker.height(100.0)
    tracker.detect(image)
    tracker.step(1_070_000, 25.0)  # no gimbal
    assert tracker.status is TargetStatus.EXPECTED
    tracker.gimbal(look)
    tracker.detect(Detection(time_us=9_000_000, target=0, image_x=0.0, image_y=0.0))  # from the future
    tracker.step(1_080_000, 25.0)
    assert tracker.status is TargetStatus.EXPECTED


def test_a_gimbal_that_fell_silent_is_not_accepted():
    rig = Rig()
    rig.run(3.0)
    used = rig.tracker.target.accepted
    rig.tracker.gimbal = lambda attitude: None  # type: ignore[return-value]
    rig.run(2.0)
    assert rig.tracker.target.accepted <= used + 4


def test_attitude_is_interpolated_and_gets_old():
    attitude = AutopilotAttitude()

    def sample(time_us, yaw):
        return attitude.add(time_us, 0.0, 0.0, yaw)

    assert attitude.at(0) is None
    assert sample(1_000_000, 0.1) is Outcome.USED
    assert sample(1_000_000, 0.1) is Outcome.REPEATED
    assert sample(1_100_000, 0.3) is Outcome.USED
    w, _, _, z = attitude.at(1_050_000)
    assert 2.0 * math.atan2(z, w) == pytest.approx(0.2, abs=1e-4)
    assert attitude.at(900_000) is None
    assert attitude.at(1_500_000) is not None
    assert attitude.at(1_700_000) is None


def test_parameters_are_checked():
    with pytest.raises(ValueError, match="acquired_after 0"):
        TrackerParameters(acquired_after=0)
    with pytest.raises(ValueError, match="lost_after_s 0"):
        TrackerParameters(lost_after_s=0.0)
