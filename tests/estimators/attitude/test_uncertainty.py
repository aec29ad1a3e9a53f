"""Covariance of the filter as it is."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from estimators.attitude import layout as at
from estimators.attitude.parameters import GYRO_BIAS_WALK, GYRO_NOISE, AttitudeParameters, coefficients
from estimators.attitude.uncertainty import propagate
from tests.estimators.attitude.made import STEP_S, Filter, G

P = coefficients(AttitudeParameters())
UPPER = np.triu_indices(3)


def full(six):
    matrix = np.zeros((3, 3))
    matrix[UPPER] = six
    return matrix + np.triu(matrix, 1).T


@given(
    st.lists(st.floats(-1.0, 1.0), min_size=9, max_size=9),
    st.floats(0.0, 1.0),
    st.floats(0.0, 0.1),
    st.floats(0.1, 1.0),
)
def test_against_matrices(root, gain, learn, fade):
    root = np.array(root).reshape(3, 3)
    before = root @ root.T
    x = np.zeros(at.STATE_SIZE)
    x[at.ROLL_COVARIANCE : at.ROLL_COVARIANCE + 6] = before[UPPER]
    propagate(x, at.ROLL_COVARIANCE, P, STEP_S, gain, learn, fade, 0.05)
    transition = np.array([[1.0 - gain, -STEP_S, gain], [learn, 1.0, -learn], [0.0, 0.0, fade]])
    noise = np.diag([P[GYRO_NOISE] ** 2 * STEP_S, P[GYRO_BIAS_WALK] ** 2 * STEP_S, (1.0 - fade**2) * 0.05**2])
    expected = transition @ before @ transition.T + noise
    assert full(x[at.ROLL_COVARIANCE : at.ROLL_COVARIANCE + 6]) == pytest.approx(expected, abs=1e-12)


def test_steady_state_is_the_spread_of_many_runs():
    """The error model simulated: what the covariance says is what is seen."""
    rng = np.random.default_rng(3)
    k, ki, tau, sigma = 0.11 * STEP_S, 0.003 * STEP_S, 3.0, 0.03
    fade = math.exp(-STEP_S / tau)
    tilt, bias, reference = np.zeros(2000), np.zeros(2000), np.zeros(2000)
    x = np.zeros(at.STATE_SIZE)
    for _ in range(6000):
        step = rng.normal(0.0, P[GYRO_NOISE] * math.sqrt(STEP_S), 2000)
        tilt, bias = ((1.0 - k) * tilt - STEP_S * bias + k * reference + step, bias + ki * (tilt - reference))
        reference = fade * reference + rng.normal(0.0, sigma * math.sqrt(1.0 - fade**2), 2000)
        propagate(x, at.ROLL_COVARIANCE, P, STEP_S, k, ki, fade, sigma)
    assert math.sqrt(x[at.ROLL_COVARIANCE]) == pytest.approx(tilt.std(), rel=0.06)
    assert math.sqrt(x[at.ROLL_COVARIANCE + 3]) == pytest.approx(bias.std(), rel=0.08)


def test_less_is_known_in_a_turn_than_at_rest():
    still, turning = Filter(at.WING), Filter(at.WING)
    still.disarmed = True
    for k in range(3000):
        still.feed((0.0, 0.0, 0.0), (0.0, 0.0, -G))
        if k % 5 == 0:
            turning.air(20.0)
        turning.feed((0.0, 0.35, 0.35), (0.0, 0.0, -1.4 * G))
    assert turning.x[at.ROLL_COVARIANCE] > 4.0 * still.x[at.ROLL_COVARIANCE]


def test_a_wing_without_airspeed_knows_that_it_is_blind_in_turns():
    seeing, blind = Filter(at.WING), Filter(at.WING)
    for k in range(3000):
        if k % 5 == 0:
            seeing.air(20.0)
        for found in (seeing, blind):
            found.feed((0.0, 0.2, 0.3), (0.0, 0.0, -1.2 * G))
    assert blind.x[at.ROLL_COVARIANCE] > 10.0 * seeing.x[at.ROLL_COVARIANCE]
