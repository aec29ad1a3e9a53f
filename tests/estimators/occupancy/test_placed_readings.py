"""Readings and the places they were taken at."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimators.occupancy.placed_readings import ReadingCheck, ReadingPlacer
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame

HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)
FRAME = LocalFrame(HOME)


def position(time_us: int, north_m: float, east_m: float, height_m: float = 100.0):
    lat, lon, alt = FRAME.geodetic_from_ned(north_m, east_m, -height_m)
    return time_us, lat, lon, alt


@given(st.lists(st.integers(0, 10_000_000), min_size=1, max_size=50, unique=True))
def test_on_a_straight_line_every_reading_gets_its_place(times_us):
    placer = ReadingPlacer(FRAME)
    placer.add_position(*position(0, 0.0, 0.0))
    placed = []
    waiting = sorted(times_us)
    for tick in range(1, 52):
        now_us = 200_000 * tick
        while waiting and waiting[0] <= now_us:
            placer.add_reading(waiting[0], 48_000.0 + waiting[0])
            waiting.pop(0)
        placed += placer.add_position(
            *position(now_us, 25e-6 * now_us, -10e-6 * now_us, 100.0 + 1e-6 * now_us)
        )
    assert [reading.time_us for reading in placed] == sorted(times_us)
    assert placer.dropped == 0
    for reading in placed:
        t = reading.time_us * 1e-6
        assert reading.north_m == pytest.approx(25.0 * t, abs=1e-4)
        assert reading.east_m == pytest.approx(-10.0 * t, abs=1e-4)
        assert reading.height_m == pytest.approx(100.0 + t, abs=1e-4)
        assert reading.total_nt == 48_000.0 + reading.time_us


def test_a_reading_before_the_first_position_is_dropped():
    placer = ReadingPlacer(FRAME)
    placer.add_reading(50_000, 1.0)
    assert placer.add_position(*position(100_000, 0.0, 0.0)) == []
    assert placer.dropped == 1


@given(st.integers(0, 1_700_000), st.sampled_from([20_000, 100_000, 250_000]))
def test_a_reading_that_arrives_after_later_positions_gets_its_place(delay_us, interval_us):
    placer = ReadingPlacer(FRAME)
    placed = []
    readings = list(range(5_000, 6_000_000, 130_000))
    for now_us in range(0, 10_000_000, interval_us):
        while readings and readings[0] + delay_us <= now_us:
            placer.add_reading(readings.pop(0), 48_000.0)
        placed += placer.add_position(*position(now_us, 25e-6 * now_us, 0.0))
    assert placer.dropped == 0
    assert [reading.time_us for reading in placed] == list(range(5_000, 6_000_000, 130_000))
    for reading in placed:
        assert reading.north_m == pytest.approx(25e-6 * reading.time_us, abs=1e-4)


def test_a_reading_more_than_two_seconds_late_is_dropped():
    placer = ReadingPlacer(FRAME)
    for k in range(61):
        placer.add_position(*position(100_000 * k, float(k), 0.0))
    placer.add_reading(3_050_000, 1.0)
    placer.add_reading(4_250_000, 2.0)
    (reading,) = placer.add_position(*position(6_100_000, 61.0, 0.0))
    assert (reading.north_m, reading.total_nt) == (pytest.approx(42.5, abs=1e-6), 2.0)
    assert placer.dropped == 1


def test_nothing_is_interpolated_across_a_gap():
    placer = ReadingPlacer(FRAME)
    placer.add_position(*position(0, 0.0, 0.0))
    placer.add_reading(1_000_000, 1.0)
    assert placer.add_position(*position(5_000_000, 100.0, 0.0)) == []
    assert placer.dropped == 1


def test_late_and_repeated_positions_change_nothing():
    placer = ReadingPlacer(FRAME)
    placer.add_position(*position(1_000_000, 0.0, 0.0))
    placer.add_reading(1_100_000, 1.0)
    assert placer.add_position(*position(900_000, -500.0, 0.0)) == []
    (reading,) = placer.add_position(*position(1_200_000, 20.0, 0.0))
    assert reading.north_m == pytest.approx(10.0, abs=1e-6)


def test_without_positions_readings_do_not_pile_up():
    placer = ReadingPlacer(FRAME)
    for k in range(500):
        placer.add_reading(k * 100_000, 1.0)
    assert placer.dropped == 400


def test_a_magnetometer_that_is_stuck_or_saturated_is_not_used_until_it_changes():
    check = ReadingCheck()
    assert all(check.accepts(48_000.0 + 0.1 * k) for k in range(1, 5))
    assert [check.accepts(48_000.0) for _ in range(40)] == [True] * 30 + [False] * 10
    assert check.accepts(48_000.1)
    assert not any(check.accepts(value) for value in (0.0, -1.0, 3e5))
    assert check.implausible == 13


def test_equal_values_now_and_then_are_accepted():
    """Readings of 0.004 nT in single precision repeat themselves."""
    check = ReadingCheck()
    assert all(check.accepts(48_000.0 + k // 8) for k in range(400))
