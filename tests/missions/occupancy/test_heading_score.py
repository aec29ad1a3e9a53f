"""Settled heading errors."""

import math

import numpy as np
import pytest

from missions.occupancy.heading_score import SETTLING_S, TURN_RATE_RAD_S, heading_score, settled_errors
from missions.occupancy.pilot import HeadingCommand


def command(time_s: float, heading_deg: float) -> HeadingCommand:
    return HeadingCommand(
        time_us=round(time_s * 1e6), heading_rad=math.radians(heading_deg), goal_ne_m=(0.0, 0.0)
    )


TIME = np.arange(0.0, 100.0, 0.1)


def test_turns_do_not_count_and_what_follows_does():
    commands = [command(0.0, 0.0), command(40.0, 90.0)]
    yaw = np.where(TIME < 40.0, 0.02, math.radians(90.0) - 0.03)
    times, errors = settled_errors(commands, TIME, yaw, end_s=100.0)
    first_s = SETTLING_S + math.pi / TURN_RATE_RAD_S
    second_s = 40.0 + SETTLING_S + math.radians(90.0) / TURN_RATE_RAD_S
    assert times[0] == pytest.approx(first_s, abs=0.11)
    assert not np.any((times >= 40.0) & (times < second_s - 0.05))
    assert errors[times < 40.0] == pytest.approx(0.02)
    assert errors[times > 40.0] == pytest.approx(-0.03)


def test_a_small_change_counts_at_once_with_its_whole_error():
    commands = [command(0.0, 0.0), command(40.0, 4.0)]
    times, errors = settled_errors(commands, TIME, np.zeros(len(TIME)), end_s=100.0)
    assert errors[np.searchsorted(times, 40.05)] == pytest.approx(-math.radians(4.0))


def test_a_small_change_does_not_cut_a_turn_short():
    commands = [command(0.0, 0.0), command(40.0, 120.0), command(42.0, 121.0)]
    times, _ = settled_errors(commands, TIME, np.zeros(len(TIME)), end_s=100.0)
    assert not np.any((times > 40.0) & (times < 40.0 + SETTLING_S + 8.0 - 0.1))


def test_errors_are_wrapped():
    score = heading_score([command(0.0, 359.0)], TIME, np.full(len(TIME), math.radians(1.0)), end_s=100.0)
    assert score.rms_rad == pytest.approx(math.radians(2.0))
    assert score.p95_rad == pytest.approx(math.radians(2.0))


def test_what_never_settled_has_no_figure():
    commands = [command(2.0 * k, 90.0 * (k % 2)) for k in range(50)]
    score = heading_score(commands, TIME, np.zeros(len(TIME)), end_s=100.0)
    assert math.isnan(score.p95_rad)
    assert score.commands == 50
    assert heading_score([], TIME, TIME, end_s=1.0).settled_s == 0.0
