"""The filter against kinematics in closed form."""

import math

import numpy as np
import pytest

from estimators.orbit_target.parameters import RelativeTargetParameters
from estimators.orbit_target.relative_target import RelativeTarget
from estimators.tracking.line_of_sight import LineOfSight

HEIGHT = 100.0
STEP_US = 20_000


def circling(
    filter_, *, seconds, wind=(4.0, -1.0), target=(1.5, 0.5), noise=0.0, late_us=0, seed=0, look=None
):
    """An aircraft at 25 m/s turns at 0.15 rad/s through moving air past a moving target; gives the truth."""
    rng = np.random.default_rng(seed)
    p = np.array((300.0, 120.0))
    filter_.start(
        0,
        offset_ne_m=(p[0] + 15.0, p[1] - 10.0),
        offset_std_m=20.0,
        drift_ne_m_s=(0.0, 0.0),
        drift_std_m_s=4.0,
    )
    drift = np.array(target) - np.array(wind)
    waiting = []
    filter_.move(0, (25.0, 0.0))
    for k in range(1, round(seconds * 1e6 / STEP_US) + 1):
        time_us = k * STEP_US
        before, now = 0.15 * (time_us - STEP_US) * 1e-6, 0.15 * time_us * 1e-6
        # exact: the integral of the air velocity over the step
        way = 25.0 / 0.15 * np.array((math.sin(now) - math.sin(before), math.cos(before) - math.cos(now)))
        p = p + STEP_US * 1e-6 * drift - way
        filter_.move(time_us, (25.0 * math.cos(now), 25.0 * math.sin(now)))
        if k % 5 == 0 and (look is None or look(time_us * 1e-6)):
            line = LineOfSight.along((p[0], p[1], HEIGHT))
            waiting.append(
                (
                    time_us,
                    LineOfSight(
                        bearing_rad=line.bearing_rad + noise * rng.standard_normal(),
                        depression_rad=line.depression_rad + noise * rng.standard_normal(),
                    ),
                )
            )
        while waiting and waiting[0][0] + late_us <= time_us:
            filter_.see(*waiting.pop(0), HEIGHT)
    return time_us, p, drift


@pytest.mark.parametrize("late_us", [0, 100_000, 500_000])
def test_place_and_drift_are_found_however_late_the_images(late_us):
    target = RelativeTarget()
    time_us, p, drift = circling(target, seconds=40.0, late_us=late_us)
    assert target.state(time_us).offset_ne_m == pytest.approx(p, abs=0.4)
    assert target.drift_ne_m_s == pytest.approx(drift, abs=0.15)
    assert target.rejected == 0


def test_errors_are_what_the_filter_says_they_are():
    """Squares of errors over their variance, over seeds: no more than a fair filter's, and not far below."""
    ratios = []
    for seed in range(12):
        parameters = RelativeTargetParameters(
            angle_rad=0.01, drift_acceleration_m_s2_per_root_hz=0.01, offset_rate_m_per_root_s=0.01
        )
        target = RelativeTarget(parameters)
        time_us, p, _ = circling(target, seconds=20.0, noise=0.01, seed=seed)
        state = target.state(time_us)
        ratios.append(math.dist(state.offset_ne_m, p) ** 2 / (2.0 * state.offset_std_m**2))
    assert 0.1 < np.mean(ratios) < 1.6


def test_what_is_somewhere_else_is_not_the_target():
    target = RelativeTarget()
    time_us, p, _ = circling(target, seconds=20.0)
    before = target.state(time_us).offset_ne_m
    beside = LineOfSight(bearing_rad=math.atan2(p[1], p[0]) + 0.3, depression_rad=0.2)
    assert not target.see(time_us, beside, HEIGHT)
    assert target.rejected == 1
    assert target.state(time_us).offset_ne_m == before


def test_unseen_it_goes_on_with_growing_doubt():
    target = RelativeTarget()
    time_us, p, _ = circling(target, seconds=40.0, look=lambda t: t < 30.0)
    state = target.state(time_us)
    assert math.dist(state.offset_ne_m, p) < 10.0
    assert state.offset_std_m > 5.0


def test_images_that_can_not_be_placed_are_left_out():
    target = RelativeTarget()
    line = LineOfSight(bearing_rad=0.0, depression_rad=0.3)
    assert not target.see(0, line, HEIGHT)  # nothing is known yet
    circling(target, seconds=5.0)
    assert not target.see(-10_000_000, line, HEIGHT)
    assert not target.see(5_000_000, line, math.nan)
    assert not target.see(5_000_000, line, -3.0)


def test_parameters_are_checked():
    with pytest.raises(ValueError, match=r"angle_rad 0"):
        RelativeTargetParameters(angle_rad=0.0)
