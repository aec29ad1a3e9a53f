"""Another aircraft by its reports: the way is the same whatever the link loses, delays or repeats."""

import math

import numpy as np
import pytest

from autopilot_bridge.mavlink.vehicle_motion import VehicleMotion
from estimators.handoff.dead_reckoning import DeadReckoning, ReckonedPath
from estimators.interface import Outcome
from estimators.relative_pose.reported_aircraft import ReportedAircraft

SPEED, TURN = 21.0, 0.14
AHEAD_US = 3_000_000  # the sender's clock is behind


def report(number, **changes):
    """Of a steady turn, ten in a second."""
    t = 0.1 * number
    values = {
        "system": 2,
        "number": number,
        "time_us": round(1e6 * t),
        "sums": (SPEED * t, 0.0, -0.5 * t, TURN * t),
        "rates": (SPEED, 0.0, -0.5, TURN),
        "heading_rad": 0.3 + TURN * t,
        "height_m": 100.0 + 0.5 * t,
    }
    return VehicleMotion(**{**values, **changes})


def flown(seconds, *, loss=0.0, delay_s=0.0, repeats=0.0, seed=1):
    """The aircraft after a flight, and the path that a receiver reckons at 50 Hz, in its own time."""
    rng = np.random.default_rng(seed)
    aircraft, path = ReportedAircraft(), DeadReckoning()
    arrivals = []
    for number in range(round(10 * seconds)):
        for _ in range(1 + (rng.random() < repeats)):
            if rng.random() >= loss:
                arrivals.append((0.1 * number + rng.exponential(delay_s), number))
    arrivals.sort()
    before = None
    for k in range(round(50 * seconds)):
        now = 0.02 * k
        while arrivals and arrivals[0][0] <= now:
            aircraft.take(round(1e6 * arrivals[0][0]) + AHEAD_US, report(arrivals.pop(0)[1]))
        if aircraft.moved:
            motion = aircraft.motion(round(1e6 * now) + AHEAD_US)
            if before is not None:
                path.advance(now - before, motion)
            else:
                begin = now
            before = now
    return aircraft, path, begin, before


def expected(begin, end):
    """Place after a steady turn, as seen at its begin."""
    radius, angle = SPEED / TURN, TURN * (end - begin)
    return radius * math.sin(angle), radius * (1.0 - math.cos(angle)), angle


@pytest.mark.parametrize(
    ("link", "within_m", "within_rad"),
    [
        ({}, 0.05, 1e-3),
        ({"loss": 0.5}, 0.05, 1e-3),
        ({"loss": 0.3, "delay_s": 0.05, "repeats": 0.2}, 2.0, 0.01),
        ({"loss": 0.3, "delay_s": 0.3}, 6.0, 0.04),
    ],
)
def test_the_way_is_that_of_the_aircraft(link, within_m, within_rad):
    aircraft, path, begin, end = flown(30.0, **link)
    x, y, angle = expected(begin, end)
    assert math.dist((path.x_m, path.y_m), (x, y)) < within_m
    assert path.heading_rad == pytest.approx(angle, abs=within_rad)
    assert aircraft.heading_rad == pytest.approx(0.3 + TURN * end, abs=within_rad)
    assert aircraft.height_m == pytest.approx(100.0 + 0.5 * end, abs=0.2)
    assert abs(aircraft.offset_us - AHEAD_US) < 25_000  # the least delay counts as offset
    assert bool(aircraft.counts["repeated"]) == ("repeats" in link)
    assert not aircraft.counts["restarts"]


def test_the_path_between_reports_is_kept_for_what_comes_later():
    aircraft, path = ReportedAircraft(), ReckonedPath(5.0)
    aircraft.on_motion = path.advance
    for number in (0, 1, 2, 5, 6):  # two are lost
        assert aircraft.take(100_000 * number, report(number)) is Outcome.USED
    for time_s in (0.2, 0.35, 0.6):
        found = path.at(round(1e6 * time_s))
        x, y, angle = expected(0.0, time_s)
        assert math.dist((found.x_m, found.y_m), (x, y)) < 0.05
        assert found.heading_rad == pytest.approx(angle, abs=1e-9)
    assert path.at(700_000) is None


def test_late_and_repeated_reports_change_nothing_and_a_restart_begins_anew():
    aircraft = ReportedAircraft()
    for number in (400, 401, 403):
        assert aircraft.take(100_000 * number, report(number)) is Outcome.USED
    for number in (402, 403, 380):
        assert aircraft.take(41_000_000, report(number)) is Outcome.LATE
    assert aircraft.newest_us == 40_300_000
    assert aircraft.take(41_000_000, report(1)) is Outcome.TIME_JUMP
    assert not aircraft.moved and math.isnan(aircraft.heading_rad)
    assert aircraft.take(41_100_000, report(2)) is Outcome.USED
    # sums that begin anew while the clock goes on
    assert aircraft.take(41_200_000, report(500, time_us=300_000)) is Outcome.TIME_JUMP
    assert aircraft.counts == {"used": 4, "late": 2, "repeated": 1, "restarts": 2}


def test_a_steady_turn_goes_on_for_some_time_without_reports():
    aircraft = ReportedAircraft()
    for number in range(20):
        aircraft.take(100_000 * number, report(number))
    aircraft.motion(1_900_000)
    motion = aircraft.motion(2_700_000)
    assert (motion.forward_m_s, motion.yaw_rate_rad_s) == pytest.approx((SPEED, TURN))
    assert aircraft.height_m == pytest.approx(101.35)
