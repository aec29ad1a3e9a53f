"""Vehicles without a model of motion: mean force in a frame that does not turn, and pauses."""

import math

import numpy as np
import pytest

from estimators.attitude import layout as at
from estimators.attitude import still
from tests.estimators.attitude.made import STEP_S, Filter, G, down_of

LEVEL = (0.0, 0.0, -G)
GAIN = 0.5


@pytest.mark.parametrize("ratio", [0.25, 1.0, 4.0])
def test_acceleration_is_attenuated_as_by_a_butterworth_filter(ratio):
    """A level vehicle that accelerates to and fro: amplitude of its pitch error."""
    found = Filter(at.STILL, still_gain_1_s=GAIN, still_bias_gain_1_s2=0.0)
    angular_frequency, tilt = ratio * GAIN, 0.01
    period = round(2.0 * math.pi / angular_frequency / STEP_S)
    pitches = []
    for k in range(round(40.0 / STEP_S) + period):
        found.feed((0.0, 0.0, 0.0), (G * tilt * math.sin(angular_frequency * k * STEP_S), 0.0, -G))
        pitches.append(found.pitch)
    amplitude = max(np.abs(pitches[-period:]))
    assert amplitude == pytest.approx(tilt / math.sqrt(1.0 + ratio**4), rel=0.05)


def test_acceleration_of_a_turning_vehicle_averages_in_a_frame_that_does_not_turn():
    """Constant in the body, as of a boat that circles in 4 s; a mean in the body has a roll error of 0.1."""
    found = Filter(at.STILL)
    for _ in range(round(60.0 / STEP_S)):
        found.feed((0.0, 0.0, 0.5 * math.pi), (0.0, 0.1 * G, -G))
    assert abs(found.roll) < 0.015
    assert abs(found.pitch) < 0.015


@pytest.mark.parametrize("form", [at.WING, at.ROTOR, at.STILL])
def test_change_to_the_mean_force_begins_at_the_estimated_attitude(form):
    """While disarmed, and in the other forms, no mean of the force is kept."""
    found = Filter(form, roll=0.2, pitch=-0.1)
    found.disarmed = form == at.STILL
    found.feed((0.0, 0.0, 0.0), LEVEL)
    assert math.isnan(found.x[at.MEAN_FORCE])
    found.x[at.DOWN : at.DOWN + 3] = down_of(0.2, -0.1)
    found.form, found.disarmed = at.STILL, False
    found.feed((0.0, 0.0, 0.0), LEVEL)
    assert found.roll == pytest.approx(0.2, abs=1e-3)
    assert found.pitch == pytest.approx(-0.1, abs=1e-3)


def test_a_pause_shows_the_bias_of_every_axis():
    found = Filter(at.STILL, still_bias_gain_1_s2=0.0)
    bias = (0.01, -0.02, 0.03)
    for _ in range(round(10.0 / STEP_S)):
        found.feed(bias, LEVEL)
    assert found.bias == pytest.approx(bias, abs=2e-3)


@pytest.mark.parametrize(
    ("rate", "force"),
    [((0.0, 0.0, 0.05), LEVEL), ((0.0, 0.0, 0.02), (1.5, 0.0, -G))],
    ids=["slow turn", "shaken"],
)
def test_motion_is_no_pause(rate, force):
    found = Filter(at.STILL, still_bias_gain_1_s2=0.0)
    for k in range(round(10.0 / STEP_S)):
        sign = (-1.0) ** k
        found.feed(rate, (sign * force[0], force[1], force[2]))
    assert not found.bias.any()


@pytest.mark.parametrize(("step_s", "share"), [(0.002, 0.0), (0.005, 0.0), (0.02, 0.375), (1.0, 0.4975)])
def test_rate_is_a_mean_over_the_time_before_its_sample(step_s, share):
    assert still.share_before(Filter(at.STILL).p, step_s) == pytest.approx(share)
