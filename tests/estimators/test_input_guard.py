"""What is kept from estimators, and what makes them start anew."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimators.input_guard import NEW_BOOT_US, InputGuard
from estimators.interface import Outcome

VALUES = (1.0, -2.0, 3)


def test_newer_samples_are_used():
    guard = InputGuard(2_000_000)
    assert [guard.check(t, "imu", VALUES) for t in (0, 20_000, 40_000)] == [None] * 3


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_non_finite_values_are_kept_out_and_leave_no_trace(bad):
    guard = InputGuard()
    assert guard.check(50, "imu", (1.0, bad, -bad)) is Outcome.NOT_FINITE
    assert guard.check(40, "imu", VALUES) is None  # the time of the bad one doesn't count


def test_the_same_sample_once_more_is_distinguished_from_another_with_the_same_time():
    guard = InputGuard()
    guard.check(100, "airspeed", VALUES)
    assert guard.check(100, "airspeed", VALUES) is Outcome.REPEATED
    assert guard.check(100, "airspeed", (1.0, -2.0, 4)) is None


def test_order_counts_within_a_stream_only():
    guard = InputGuard()
    guard.check(100_000, "imu", VALUES)
    assert guard.check(90_000, "airspeed", VALUES) is None
    assert guard.check(90_000, "imu", VALUES) is Outcome.LATE
    assert guard.check(110_000, "imu", VALUES) is None


def test_time_that_goes_back_far_starts_all_streams_anew():
    guard = InputGuard()
    guard.check(50_000_000, "imu", VALUES)
    guard.check(50_000_000, "airspeed", VALUES)
    assert guard.check(50_000_000 - NEW_BOOT_US, "imu", VALUES) is Outcome.LATE
    assert guard.check(1_000, "imu", VALUES) is Outcome.TIME_JUMP
    assert guard.check(1_000, "airspeed", VALUES) is None
    assert guard.check(2_000, "imu", VALUES) is None


def test_a_gap_of_a_leading_stream_is_a_jump_and_of_another_is_not():
    guard = InputGuard(1_000_000)
    guard.check(0, "imu", VALUES)
    guard.check(0, "airspeed", VALUES, leads=False)
    assert guard.check(1_000_000, "imu", VALUES) is None
    assert guard.check(5_000_000, "airspeed", VALUES, leads=False) is None
    assert guard.check(5_000_000, "imu", VALUES) is Outcome.TIME_JUMP
    assert guard.check(5_020_000, "imu", VALUES) is None


def test_reset_forgets():
    guard = InputGuard(1_000_000)
    guard.check(9_000_000, "imu", VALUES)
    guard.reset()
    assert guard.check(0, "imu", VALUES) is None


@given(st.lists(st.integers(0, 10_000_000), min_size=1))
def test_what_is_used_never_goes_back_but_after_a_jump(times_us):
    guard = InputGuard(3_000_000)
    newest = None
    for time_us in times_us:
        outcome = guard.check(time_us, "imu", VALUES)
        if outcome is None:
            assert newest is None or 0 < time_us - newest <= 3_000_000
        elif outcome is Outcome.TIME_JUMP:
            assert time_us - newest > 3_000_000 or newest - time_us > NEW_BOOT_US
        else:
            assert 0 <= newest - time_us <= NEW_BOOT_US
            continue
        newest = time_us


@pytest.mark.parametrize("gap", [0, -1])
def test_a_gap_that_nothing_fits_in_is_refused(gap):
    with pytest.raises(ValueError, match=r"max_gap_us .* is not above 0"):
        InputGuard(gap)
