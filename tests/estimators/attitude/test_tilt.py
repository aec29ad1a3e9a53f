"""Motion of the direction down, its correction, and the gyro bias, in closed form."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from estimators.attitude import layout as at
from estimators.attitude.tilt import rotate
from tests.estimators.attitude.made import STEP_S, Filter, G, down_of

angles = st.floats(-1.5, 1.5)
rates = st.tuples(*(st.floats(-8.0, 8.0),) * 3)


def state(roll, pitch):
    x = np.zeros(at.STATE_SIZE)
    x[at.DOWN : at.DOWN + 3] = down_of(roll, pitch)
    return x


@given(angles, angles, rates, st.floats(0.001, 1.0))
def test_rotation_is_the_exponential_map(roll, pitch, rate, elapsed_s):
    """Authority: scipy's rotation vectors; the body turns by w dt, so what is fixed turns back in it."""
    x = state(roll, pitch)
    rotate(x, at.DOWN, elapsed_s, *rate)
    expected = Rotation.from_rotvec(-np.array(rate) * elapsed_s).apply(down_of(roll, pitch))
    assert x[at.DOWN : at.DOWN + 3] == pytest.approx(expected, abs=1e-12)


@given(angles, angles, st.floats(-5.0, 5.0))
def test_a_turn_about_down_changes_nothing(roll, pitch, turn_rate):
    """The projector of equations 3 and 11: no yaw creeps in."""
    x = state(roll, pitch)
    down = down_of(roll, pitch)
    for _ in range(50):
        rotate(x, at.DOWN, 0.02, *(turn_rate * down))
    assert x[at.DOWN : at.DOWN + 3] == pytest.approx(down, abs=1e-12)


def test_euler_kinematics():
    """A minute of rolling, pitching and yawing at once, against the integrated Euler angle rates."""
    roll, pitch, elapsed_s = 0.1, 0.05, 0.001
    x = state(roll, pitch)
    for k in range(60_000):
        t = (k + 0.5) * elapsed_s
        p, q, r = 0.3 * math.cos(0.7 * t), 0.1 * math.cos(0.5 * t), 0.2
        rotate(x, at.DOWN, elapsed_s, p, q, r)
        # Midpoint rule of the kinematic equations.
        half_roll = roll + 0.5 * elapsed_s * (p + math.tan(pitch) * (q * math.sin(roll) + r * math.cos(roll)))
        half_pitch = pitch + 0.5 * elapsed_s * (q * math.cos(roll) - r * math.sin(roll))
        s, c = math.sin(half_roll), math.cos(half_roll)
        roll += elapsed_s * (p + math.tan(half_pitch) * (q * s + r * c))
        pitch += elapsed_s * (q * c - r * s)
    assert math.atan2(x[at.DOWN + 1], x[at.DOWN + 2]) == pytest.approx(roll, abs=1e-5)
    assert -math.asin(x[at.DOWN]) == pytest.approx(pitch, abs=1e-5)


def test_error_dies_away_with_the_gain():
    """Roll error d' = -k_p d for small errors, without bias learning."""
    found = Filter(at.WING, roll=0.02, gain_1_s=0.5, bias_gain_1_s2=0.0)
    for _ in range(100):
        found.feed((0.0, 0.0, 0.0), (0.0, 0.0, -G))
    assert found.roll == pytest.approx(0.02 * math.exp(-0.5 * 100 * STEP_S), rel=0.01)


def test_first_seconds_are_a_running_mean():
    """Any start is forgotten: a first sample that is wrong counts as one among the others."""
    found = Filter(at.STILL, settled=False, roll=0.4)
    for _ in range(100):
        found.feed((0.0, 0.0, 0.0), (0.0, 0.0, -G))
    assert abs(found.roll) < 0.01


@pytest.mark.parametrize("form", [at.STILL, at.WING, at.ROTOR])
def test_gyro_bias_is_found(form):
    """Level, armed and steady; the bias about the down axis has no trace in roll and pitch."""
    bias = (0.01, -0.008, 0.004)
    found = Filter(form)
    for k in range(round(240.0 / STEP_S)):
        if form == at.WING and k % 5 == 0:
            found.air(20.0)
        rate = bias if form != at.WING else (*bias[:2], 0.0)
        found.feed(rate, (0.0, 0.0, -G))
    assert found.bias[:2] == pytest.approx(bias[:2], abs=3e-4)
    assert abs(found.roll) < 0.002
    assert abs(found.pitch) < 0.002


def test_bias_at_rest_is_found_within_seconds_all_three():
    found = Filter(at.WING, settled=False)
    found.disarmed = True
    bias = (0.01, -0.008, 0.004)
    rng = np.random.default_rng(1)
    for _ in range(round(30.0 / STEP_S)):
        found.feed(bias + rng.normal(0.0, 0.002, 3), rng.normal((0.0, 0.0, -G), 0.05))
    assert found.bias == pytest.approx(bias, abs=6e-4)


def test_a_takeoff_run_before_arming_is_reported_is_no_bias():
    """HEARTBEAT comes once a second: 5 m/s^2 of acceleration while still thought to be at rest."""
    found = Filter(at.WING, settled=False)
    found.disarmed = True
    for _ in range(round(5.0 / STEP_S)):
        found.feed((0.0, 0.0, 0.0), (0.0, 0.0, -G))
    for _ in range(round(1.0 / STEP_S)):
        found.feed((0.0, 0.0, 0.0), (5.0, 0.0, -G))
    assert np.abs(found.bias).max() < 2e-3
    assert abs(found.pitch) < math.radians(5.0)


def test_upside_down_is_left():
    found = Filter(at.STILL, roll=math.pi)
    for _ in range(round(200.0 / STEP_S)):
        found.feed((0.0, 0.0, 0.0), (0.0, 0.0, -G))
    assert abs(found.roll) < 0.05


@given(st.lists(st.tuples(rates, st.tuples(*(st.floats(-30.0, 30.0),) * 3)), min_size=1, max_size=60))
def test_whatever_comes_down_is_a_unit_vector(samples):
    for form in (at.STILL, at.WING, at.ROTOR):
        found = Filter(form)
        found.air(15.0, 1.0)
        for rate, force in samples:
            found.feed(rate, force)
        assert np.isfinite(found.x[at.DOWN : at.AIRSPEED]).all()
        assert np.linalg.norm(found.down) == pytest.approx(1.0)
        assert np.isfinite(found.x[at.ROLL_COVARIANCE : at.STATE_SIZE]).all()


@pytest.mark.parametrize(
    ("rate", "force"),
    [
        ((80.0, 0.0, 0.0), (0.0, 0.0, -G)),
        ((0.0, 0.0, 0.0), (0.0, 500.0, 0.0)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ],
)
def test_what_no_sensor_gives_changes_nothing(rate, force):
    found = Filter(at.STILL, roll=0.1)
    before = found.x[at.DOWN :].copy()
    assert not found.feed(rate, force)
    assert np.array_equal(found.x[at.DOWN :], before, equal_nan=True)
