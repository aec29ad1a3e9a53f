"""Multirotor: tilt from drag, in made flights whose motion is integrated beside them."""

import math

import numpy as np
import pytest

from estimators.attitude import layout as at
from tests.estimators.attitude.made import STEP_S, Filter, G, down_of


def flight(drag_1_s, seconds, noise, seed=1):
    """(rate, force, roll, pitch): tilts back and forth to 20 degrees, thrust holding the height."""
    rng = np.random.default_rng(seed)
    velocity = np.zeros(3)
    for k in range(round(seconds / STEP_S)):
        t = k * STEP_S
        roll, roll_rate = 0.3 * math.sin(0.5 * t), 0.15 * math.cos(0.5 * t)
        pitch, pitch_rate = 0.25 * math.sin(0.37 * t), 0.0925 * math.cos(0.37 * t)
        down = down_of(roll, pitch)
        rate = np.array([roll_rate, pitch_rate * math.cos(roll), -pitch_rate * math.sin(roll)])
        drag = -drag_1_s * velocity[:2]
        force = np.array([*drag, -(G + drag @ down[:2]) / down[2]])
        velocity = velocity + STEP_S * (force + G * down - np.cross(rate, velocity))
        yield rate + noise * rng.normal(0.0, 0.003, 3), force + noise * rng.normal(0.0, 0.3, 3), roll, pitch


def errors(found, drag_1_s, seconds=180.0, noise=1.0):
    """Root mean squares of roll and pitch error, rad, without the first half minute."""
    squares, n = np.zeros(2), 0
    for k, (rate, force, roll, pitch) in enumerate(flight(drag_1_s, seconds, noise)):
        found.feed(rate, force)
        if k * STEP_S > 30.0:
            squares += (found.roll - roll) ** 2, (found.pitch - pitch) ** 2
            n += 1
    return np.sqrt(squares / n)


@pytest.mark.parametrize("drag_1_s", [0.3, 0.5, 1.0])
@pytest.mark.slow
def test_accelerated_flight(drag_1_s):
    """Below one degree whatever the drag is, and much better than trust in the bare accelerometer."""
    found, bare = Filter(at.ROTOR), Filter(at.STILL)
    rms = errors(found, drag_1_s)
    assert rms.max() < math.radians(1.0)
    assert errors(bare, drag_1_s).max() > 2.0 * rms.max()


@pytest.mark.parametrize("drag_1_s", [0.3, 0.5, 1.0])
@pytest.mark.sampled(1)
def test_drag_is_learned(drag_1_s):
    found = Filter(at.ROTOR)
    errors(found, drag_1_s)
    assert found.x[at.DRAG] == pytest.approx(drag_1_s, rel=0.25)


def test_drag_can_be_given():
    found = Filter(at.ROTOR, drag_1_s=0.7, drag_learning_m_s=math.inf)
    rms = errors(found, 0.7, noise=0.0)
    assert found.x[at.DRAG] == 0.7
    assert rms.max() < math.radians(0.2)


def test_velocity_against_the_air():
    """Steady flight at 5 m/s: force and tilt belong together."""
    drag, speed = 0.4, 5.0
    pitch = -math.atan2(drag * speed, G)
    found = Filter(at.ROTOR, drag_1_s=drag, drag_learning_m_s=math.inf, pitch=pitch)
    along = speed * math.cos(pitch)
    for _ in range(round(60.0 / STEP_S)):
        force = (-drag * along, 0.0, -(G - drag * along * math.sin(-pitch)) / math.cos(pitch))
        found.feed((0.0, 0.0, 0.0), force)
    assert found.x[at.VELOCITY] == pytest.approx(along, abs=0.3)


def test_disarmed_is_still():
    """On a slope: the accelerometer alone tells the tilt."""
    found = Filter(at.ROTOR, settled=False)
    found.disarmed = True
    for _ in range(200):
        found.feed((0.0, 0.0, 0.0), -G * down_of(0.2, 0.1))
    assert (found.roll, found.pitch) == pytest.approx((0.2, 0.1), abs=1e-3)
    assert not found.x[at.VELOCITY : at.VELOCITY + 3].any()
