"""The estimator from messages: passes over a tag, lossy links, and inputs that are hostile or missing."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, dialect
from autopilot_bridge.mavlink.camera_scan import CameraScan, camera_scan_message
from autopilot_bridge.mavlink.search_likelihood import read_search_likelihood
from estimators.interface import Outcome
from estimators.runner import Runner
from estimators.vision_search import VisionSearchEstimator, VisionSearchParameters
from estimators.vision_search.models import layout_of
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
FRAME = LocalFrame(HOME)
TAG = (12.0, -20.0)
FOCAL_PX = 914.0
CALIBRATED = {
    "mount_sigma_rad": math.radians(0.29), "yaw_bias_sigma_rad": 0.0, "latency_sigma_s": 0.0,
    "ground_sigma_m": 0.0,
}  # fmt: skip
FIELDS = {"south_m": -100.0, "west_m": -100.0, "north_m": 100.0, "east_m": 100.0, **CALIBRATED}


def parameters(**changes):
    return VisionSearchParameters(**{**FIELDS, **changes})


class Flight:
    """One vehicle's messages to estimators; it flies level over a tag."""

    def __init__(self, *runners, system=1, boot_s=1.0):
        self.runners = runners
        self.system = system
        self.time_s = boot_s
        self.number = 0
        self.clock_s = 0.0
        self._encoders = {k: FrameEncoder(system, k) for k in (1, 100, 191)}
        self.say(dialect.MAVLink_home_position_message(
            round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7), round(HOME.alt_m * 1e3),
            0.0, 0.0, 0.0, [1.0, 0.0, 0.0, 0.0], 0.0, 0.0, 0.0))  # fmt: skip

    def say(self, message, component=1, runners=None):
        (frame,) = FrameParser().feed(self._encoders[component].encode(message))
        return [runner.feed(frame) for runner in (self.runners if runners is None else runners)]

    def pose(self, north_m, east_m, yaw_rad=0.0, height_m=60.0, attitude=True):
        lat, lon, _ = FRAME.geodetic_from_ned(north_m, east_m, 0.0)
        boot_ms = round(self.time_s * 1e3)
        if attitude:
            self.say(dialect.MAVLink_attitude_message(boot_ms, 0.0, 0.0, yaw_rad, 0.0, 0.0, 0.0))
        self.say(dialect.MAVLink_global_position_int_message(
            boot_ms, round(lat * 1e7), round(lon * 1e7), 0, round(height_m * 1e3), 0, 0, 0, 0))  # fmt: skip

    def detection(self, angle_x, angle_y, tag=0):
        self.say(dialect.MAVLink_landing_target_message(
            round((self.time_s + self.clock_s) * 1e6), tag, 12, angle_x, angle_y, 60.0, 0.03, 0.03, 0.0, 0.0,
            0.0, [1.0, 0.0, 0.0, 0.0], 2, 0), 100)  # fmt: skip

    def end(self, detections=0):
        scan = CameraScan(
            number=self.number,
            time_us=round((self.time_s + self.clock_s) * 1e6),
            detections=detections,
            width_px=1280,
            height_px=720,
            focal_px=FOCAL_PX,
            distortion=(0.0,) * 5,
            mount_rad=(0.0, -0.5 * math.pi, 0.0),
            position_frd_m=(0.0, 0.0, 0.0),
        )
        return self.say(camera_scan_message(scan), 100)[0]

    def look(self, north_m, east_m, yaw_rad=0.0, tags=((0, TAG),), **pose):
        """A frame from 60 m; the tag is detected when it is in view."""
        self.time_s += 0.25
        self.number += 1
        self.pose(north_m, east_m, yaw_rad, **pose)
        seen = 0
        for tag, (tag_n, tag_e) in tags:
            n, e = tag_n - north_m, tag_e - east_m
            across = (e * math.cos(yaw_rad) - n * math.sin(yaw_rad)) / 60.0
            ahead = (n * math.cos(yaw_rad) + e * math.sin(yaw_rad)) / 60.0
            if abs(across) < 0.6 and abs(ahead) < 0.33:
                self.detection(math.atan(across), math.atan(-ahead), tag)
                seen += 1
        return self.end(seen)

    def sweep(self, **more):
        for k in range(4):
            for j in range(20):
                yield self.look(-75.0 + 10.0 * j, -75.0 + 50.0 * k, **more)


def team(count, **changes):
    return [
        Runner(VisionSearchEstimator(parameters(own_vehicle=k + 1, centre_vehicle=1, **changes)))
        for k in range(count)
    ]


@pytest.mark.parametrize("belief", ["grid", "particles"])
def test_a_sweep_finds_the_tag(belief):
    runner = Runner(VisionSearchEstimator(parameters(belief=belief)))
    outcomes = list(Flight(runner).sweep())
    assert outcomes.count(Outcome.WAITING) == 0
    table = runner.tables["AreaEstimate"]
    assert (table["north_m"][-1], table["east_m"][-1]) == pytest.approx(TAG, abs=0.3)
    assert 0.1 < table["north_sigma_m"][-1] < 1.5
    assert table["detections"][-1] >= 4
    assert table["frames"][-1] >= 75
    assert runner.remarks["frames_used"] == 80
    assert table["probability_of_detection"][0] < table["probability_of_detection"][-1] < 1.0
    assert table["entropy_nats"][-1] < table["entropy_nats"][0] - 5.0
    (message,) = runner.estimator.publish()
    north_m, east_m, _ = FRAME.ned_from_geodetic(message.lat * 1e-7, message.lon * 1e-7, HOME.alt_m)  # type: ignore[attr-defined]
    assert (north_m, east_m) == pytest.approx(TAG, abs=0.3)
    assert runner.estimator.publish() == []
    assert "warning" not in runner.remarks


def exchange(flights, runners, deliver):
    """Two vehicles search; `deliver` passes the likelihoods of each to the other's estimator."""
    lines = ((-75.0, -25.0), (25.0, 75.0))
    for line in range(2):
        for j in range(20):
            for k, flight in enumerate(flights):
                flight.look(-75.0 + 10.0 * j, lines[k][line])
                messages = [m for m in runners[k].estimator.publish() if m.get_type() == "TUNNEL"]
                deliver(k, messages)


def two_flights(runners):
    return [Flight(*runners, system=1), Flight(*runners, system=2)]


def test_a_team_agrees_over_a_lossless_link_and_counts_nothing_twice():
    runners = team(2)
    flights = two_flights(runners)
    delayed = []

    def deliver(k, messages):
        """Each message comes twice, and late."""
        delayed.append((k, messages))
        for sender, late in delayed[-6:-5] + delayed[-3:-2]:
            for message in late:
                flights[sender].say(message, 191, [runners[1 - sender]])

    exchange(flights, runners, deliver)
    for sender, late in delayed[-6:]:
        for message in late:
            flights[sender].say(message, 191, [runners[1 - sender]])
    alone = Runner(VisionSearchEstimator(parameters(centre_vehicle=1)))
    exchange(two_flights([alone]), [alone, alone], lambda k, messages: None)
    together = [runner.estimator.belief.probability() for runner in (*runners, alone)]
    assert np.abs(together[0] - together[1]).max() < 1e-12
    assert np.abs(together[0] - together[2]).max() < 1e-12
    for runner in runners:
        assert runner.estimator.frames == 80
        assert runner.remarks["frames_received"] == 40
        assert runner.remarks["frames_repeated"] >= 30
    assert runners[0].remarks["frames_late"] > 30


def test_lost_likelihoods_are_missing_and_no_more():
    runners = team(2)
    flights = two_flights(runners)
    rng = np.random.default_rng(1)

    def deliver(k, messages):
        for message in messages:
            if rng.random() < 0.5:
                flights[k].say(message, 191, [runners[1 - k]])

    exchange(flights, runners, deliver)
    assert all(15 < runner.remarks["frames_received"] < 25 for runner in runners)
    estimates = [runner.estimator.estimates[0] for runner in runners]
    for estimate in estimates:
        assert (estimate.north_m, estimate.east_m) == pytest.approx(TAG, abs=0.5)


def test_a_late_likelihood_of_a_walking_target_is_less_precise():
    spread = []
    for delay in (0, 40):
        runners = team(2, walk_m_sqrt_s=0.5)
        first, second = two_flights(runners)
        first.look(TAG[0], TAG[1])
        (message,) = [m for m in runners[0].estimator.publish() if m.get_type() == "TUNNEL"]
        second.look(-80.0, 80.0)
        for _ in range(delay):
            first.time_s += 0.25
            second.look(-80.0, 80.0)
        first.say(message, 191, [runners[1]])
        for _ in range(40 - delay):
            second.look(-80.0, 80.0)
        spread.append(runners[1].estimator.belief.moments()[1])
    assert spread[1] == pytest.approx(spread[0], rel=0.05)


def test_a_likelihood_keeps_its_numbers_and_malformed_ones_are_ignored():
    (runner,) = team(1)
    flight = Flight(runner)
    flight.look(*TAG, yaw_rad=0.3)
    (message, _) = runner.estimator.publish()
    content = (message.payload_type, message.payload_length, message.payload)
    found = read_search_likelihood(*content)
    assert found.number == 1 and found.time_us == 1_250_000
    assert found.height_m == 60.0 and found.focal_px == FOCAL_PX
    assert found.detections == ((0.0, 0.0),)
    assert math.hypot(*found.q_ned_from_mount) == pytest.approx(1.0)
    rng = np.random.default_rng(2)
    refused = 0
    for _ in range(3000):
        broken = list(message.payload)
        for at in rng.integers(0, 128, 3):
            broken[at] = int(rng.integers(0, 256))
        refused += read_search_likelihood(content[0], 128, broken) is None
        flight.say(dialect.MAVLink_tunnel_message(0, 0, content[0], 128, broken), 191)
    assert refused > 200
    assert np.all(np.isfinite(runner.estimator.belief.moments()[0]))
    assert read_search_likelihood(content[0], 125, message.payload) is None
    assert read_search_likelihood(0, 128, message.payload) is None


def test_frames_are_thinned_and_those_near_the_ground_are_not_used():
    runner = Runner(VisionSearchEstimator(parameters(frame_period_s=1.0)))
    flight = Flight(runner)
    flight.look(0.0, 0.0, height_m=1.0)
    assert runner.estimator.frames == 0  # type: ignore[attr-defined]
    for _ in range(16):
        flight.look(-80.0, 80.0)
    assert runner.estimator.frames == 4  # type: ignore[attr-defined]
    assert runner.remarks["frames_too_low"] == 1


def test_a_frame_without_attitude_near_its_time_is_not_used():
    runner = Runner(VisionSearchEstimator(parameters()))
    flight = Flight(runner)
    assert flight.look(0.0, 0.0) is Outcome.UPDATED
    assert flight.look(0.0, 0.0, attitude=False) is Outcome.WAITING
    assert runner.remarks["frames_without_pose"] == 1


@pytest.mark.parametrize("apart_s", [0.3, -0.3])
def test_clocks_that_are_apart_are_reported(apart_s):
    runner = Runner(VisionSearchEstimator(parameters()))
    flight = Flight(runner)
    flight.clock_s = apart_s
    for _ in flight.sweep():
        pass
    assert "clocks of camera and autopilot of vehicle 1 are 0.30 s apart" in runner.remarks["warning"]  # type: ignore[operator]
    assert runner.remarks["exposure_to_attitude_s"] == pytest.approx(-apart_s)


def test_a_tag_of_another_id_is_counted_only():
    runner = Runner(VisionSearchEstimator(parameters()))
    for _ in Flight(runner).sweep(tags=((7, TAG),)):
        pass
    assert runner.estimator.detections == 0  # type: ignore[attr-defined]
    assert runner.remarks["detections_of_other_tags"] >= 4  # type: ignore[operator]
    assert runner.estimator.belief.shares(layout_of(parameters(cell_m=50.0)))[2, 1] < 0.01  # type: ignore[attr-defined]


def test_two_tags_of_the_id_leave_both_places():
    """One target is expected: a second tag in the same frames is the other hypothesis."""
    other = (12.0, 10.0)
    runner = Runner(VisionSearchEstimator(parameters()))
    flight = Flight(runner)
    for k in range(6):
        flight.look(12.0, -8.0 + k, tags=((0, TAG), (0, other)))
    shares = runner.estimator.belief.shares(layout_of(parameters(cell_m=10.0)))  # type: ignore[attr-defined]
    places = [((np.array(p) + 100.0) / 10.0).astype(int) for p in (TAG, other)]
    assert all(0.2 < shares[row - 1 : row + 2, column - 1 : column + 1].sum() < 0.8 for row, column in places)


def test_a_reset_discards_the_belief():
    runner = Runner(VisionSearchEstimator(parameters()))
    for _ in Flight(runner).sweep():
        pass
    runner.estimator.reset()
    assert runner.estimator.frames == 0  # type: ignore[attr-defined]
    assert runner.estimator.belief.probability_of_detection == 0.0  # type: ignore[attr-defined]
    assert runner.estimator.origin is None


@pytest.mark.parametrize(
    ("changes", "reported"),
    [
        ({"belief": "kalman"}, "belief 'kalman' is not one of grid, particles"),
        ({"tag_id": 300}, "tag_id 300 is not in 0..254"),
        ({"north_m": -200.0}, "north_m must be above south_m"),
        ({"cell_m": 0.01}, "more than 16000000"),
        ({"false_rate": 0.0}, "false_rate 0 is not possible; ask for more than 0, less than 1"),
        ({"frame_period_s": -1.0}, "frame_period_s -1"),
        ({"cell_m": math.nan}, "cell_m nan is not possible"),
        ({"own_vehicle": 256}, "own_vehicle 256"),
    ],
)
def test_impossible_parameters_are_named(changes, reported):
    with pytest.raises(ValueError, match=reported):
        parameters(**changes)


def test_a_frame_whose_detections_were_lost_is_not_one_without_the_target():
    runner = Runner(VisionSearchEstimator(parameters()))
    flight = Flight(runner)
    flight.look(*TAG)
    before = runner.estimator.belief.probability_of_detection  # type: ignore[attr-defined]
    flight.time_s += 0.25
    flight.number += 1
    flight.pose(*TAG)
    assert flight.end(detections=1) is Outcome.IGNORED
    assert runner.remarks["frames_incomplete"] == 1
    assert runner.estimator.belief.probability_of_detection == before  # type: ignore[attr-defined]
    flight.time_s += 0.25
    flight.number += 1
    flight.pose(*TAG)
    flight.detection(0.1, 0.1, tag=7)  # another tag, and that is all
    assert flight.end(detections=1) is not Outcome.IGNORED
    assert runner.remarks["frames_used"] == 2
