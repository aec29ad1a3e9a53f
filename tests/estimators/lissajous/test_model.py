"""The motion model and its filter against closed forms, finite differences and plain matrix algebra."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from estimators.lissajous.model import (
    AXIS,
    Discretisation,
    axis,
    correct,
    course,
    course_variance,
    frequency_jacobian,
    move,
    predict,
    predict_augmented,
)

OMEGA = (1.3, 2.1)
CORRECT = (Discretisation.EXACT, Discretisation.SERIES)


def axes_of(omega, dt_s, form=Discretisation.EXACT):
    axes = np.zeros((2, AXIS))
    for i in range(2):
        axis(int(form), omega[i], dt_s, axes[i])
    return axes


def matrix_of(axes):
    """The 4 x 4 transition, column by column."""
    columns = []
    for unit in np.eye(4):
        state = unit.copy()
        move(state, axes)
        columns.append(state)
    return np.stack(columns, axis=1)


def covariance(seed, size=4):
    root = np.random.default_rng(seed).normal(size=(size, size))
    return root @ root.T + 0.1 * np.eye(size)


def test_exact_step_is_harmonic_motion() -> None:
    """Equation 11 with amplitude and phase by equation 13."""
    state = np.array([3.0, -2.0, -1.0, 4.0])
    start = state.copy()
    for _ in range(7):
        move(state, axes_of(OMEGA, 0.31))
    t = 7 * 0.31
    for i, omega in enumerate(OMEGA):
        position, velocity = start[2 * i : 2 * i + 2]
        amplitude, phase = math.hypot(position, velocity / omega), math.atan2(omega * position, velocity)
        assert state[2 * i] == pytest.approx(amplitude * math.sin(omega * t + phase))
        assert state[2 * i + 1] == pytest.approx(amplitude * omega * math.cos(omega * t + phase))


def test_irregular_steps_end_where_one_does() -> None:
    state, once = np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 2.0, 3.0, 4.0])
    for dt_s in (0.013, 0.4, 1e-6, 0.887):
        move(state, axes_of(OMEGA, dt_s))
    move(once, axes_of(OMEGA, 0.013 + 0.4 + 1e-6 + 0.887))
    assert state == pytest.approx(once)


@pytest.mark.parametrize(
    ("form", "corner"),
    [(Discretisation.SERIES, 0.5), (Discretisation.PRINTED_SIGN, 0.5), (Discretisation.PRINTED, 0.25)],
)
def test_series_is_equation_17(form: Discretisation, corner: float) -> None:
    """I + dt A + (dt A)^2 / 2; as printed the corner has half of what it should."""
    matrix = matrix_of(axes_of(OMEGA, 0.05, form))
    continuous = np.zeros((4, 4))
    for i, omega in enumerate(OMEGA):
        continuous[2 * i, 2 * i + 1] = 0.05
        continuous[2 * i + 1, 2 * i] = -0.05 * omega**2
    expected = np.eye(4) + continuous + corner * continuous @ continuous
    assert matrix == pytest.approx(expected)


@pytest.mark.parametrize("form", CORRECT)
@pytest.mark.parametrize("omega", [OMEGA, (1e-7, 3.0)])
def test_frequency_jacobian_is_the_derivative(form: Discretisation, omega: tuple[float, float]) -> None:
    state, step = np.array([2.0, -1.0, 0.5, 3.0]), 1e-5
    found = np.zeros((2, 2))
    frequency_jacobian(state, axes_of(omega, 0.2, form), found)
    for i in range(2):
        ends = []
        for sign in (1.0, -1.0):
            moved = list(omega)
            moved[i] += sign * step
            end = state.copy()
            move(end, axes_of(moved, 0.2, form))
            ends.append(end)
        expected = (ends[0] - ends[1]) / (2.0 * step)
        assert found[i] == pytest.approx(expected[2 * i : 2 * i + 2], abs=1e-7)


def test_printed_sign_differs_in_two_places() -> None:
    """Equation 25a: T(1,1) and T(3,3) change sign, all else is the same."""
    good = axes_of(OMEGA, 0.05, Discretisation.SERIES)
    printed = axes_of(OMEGA, 0.05, Discretisation.PRINTED_SIGN)
    differs = good != printed
    assert differs.sum() == 2 and np.all(good[differs] == -printed[differs])


def test_exact_step_does_not_grow_and_the_printed_one_does() -> None:
    """Amplitudes over 400 steps: the same, and by printed equation 17 1.85 to 248 times as large."""
    for omega, growth in ((0.5 * math.pi, 1.85), (0.7 * math.pi, 3.3), (1.5 * math.pi, 248.0)):
        exact = np.linalg.det(matrix_of(axes_of((omega, omega), 0.05))[:2, :2])
        printed = np.linalg.det(matrix_of(axes_of((omega, omega), 0.05, Discretisation.PRINTED))[:2, :2])
        assert exact == pytest.approx(1.0)
        assert math.sqrt(printed**400) == pytest.approx(growth, rel=0.02)


def test_prediction_is_equations_21_and_22() -> None:
    state, before, process = np.array([2.0, -1.0, 0.5, 3.0]), covariance(1), covariance(2)
    uncertain = np.array([[0.04, 0.01], [0.01, 0.09]])
    axes = axes_of(OMEGA, 0.2)
    matrix, jacobian = matrix_of(axes), np.zeros((2, 2))
    frequency_jacobian(state, axes, jacobian)
    spread = np.zeros((4, 2))
    spread[:2, 0], spread[2:, 1] = jacobian
    after, moved = before.copy(), state.copy()
    predict(moved, after, axes, process, uncertain, np.zeros((2, 2)))
    assert moved == pytest.approx(matrix @ state)
    assert after == pytest.approx(matrix @ before @ matrix.T + process + spread @ uncertain @ spread.T)
    assert np.array_equal(after, after.T)


def test_augmented_prediction_is_the_extended_filters() -> None:
    state = np.array([2.0, -1.0, 0.5, 3.0, *OMEGA])
    before, process, axes = covariance(3, 6), covariance(4), axes_of(OMEGA, 0.2)
    jacobian = np.zeros((2, 2))
    frequency_jacobian(state, axes, jacobian)
    full = np.eye(6)
    full[:4, :4] = matrix_of(axes)
    full[:2, 4], full[2:4, 5] = jacobian
    noise = np.zeros((6, 6))
    noise[:4, :4] = process
    noise[4, 4] = noise[5, 5] = 0.02
    after = before.copy()
    predict_augmented(state, after, axes, process, 0.02, np.zeros((2, 2)))
    assert after == pytest.approx(full @ before @ full.T + noise)


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from([4, 6]))
def test_correction_is_fusion_in_information_form(seed: int, size: int) -> None:
    """Equations 26, 27; with more states than are measured, the Kalman form (6, 7) of the same."""
    rng = np.random.default_rng(seed)
    before, noise = covariance(seed, size), covariance(seed + 1)
    state, measured = rng.normal(size=size), rng.normal(size=4)
    observed = np.eye(4, size)
    information = np.linalg.inv(before) + observed.T @ np.linalg.inv(noise) @ observed
    expected = np.linalg.inv(information)
    mean = expected @ (np.linalg.solve(before, state) + observed.T @ np.linalg.solve(noise, measured))
    innovation = measured - state[:4]
    distance = innovation @ np.linalg.solve(before[:4, :4] + noise, innovation)
    after, moved = before.copy(), state.copy()
    assert correct(moved, after, measured, noise, np.zeros((4, 12))) == pytest.approx(distance)
    assert moved == pytest.approx(mean, rel=1e-6, abs=1e-8)
    assert after == pytest.approx(expected, rel=1e-6, abs=1e-8)


def test_correction_by_what_is_no_covariance_changes_nothing() -> None:
    state, before = np.ones(4), np.zeros((4, 4))
    assert math.isnan(correct(state, before, np.zeros(4), -np.eye(4), np.zeros((4, 12))))
    assert np.array_equal(state, np.ones(4)) and not before.any()


@pytest.mark.parametrize("velocity", [(3.0, 1.0), (0.0, 2.0), (-1.0, -4.0), (-2.0, 0.0)])
def test_course_variance_is_to_first_order(velocity: tuple[float, float]) -> None:
    """J P J' with J by finite differences, also where one velocity is zero (equation 29 has 0/0 there)."""
    state = np.array([0.0, velocity[0], 0.0, velocity[1]])
    spread = covariance(5)
    step, slope = 1e-6, np.zeros(4)
    for i in (1, 3):
        ends = []
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[i] += sign * step
            ends.append(course(moved))
        slope[i] = math.remainder(ends[0] - ends[1], math.tau) / (2.0 * step)
    assert course(state) == pytest.approx(math.atan2(velocity[1], velocity[0]))
    assert course_variance(state, spread) == pytest.approx(slope @ spread @ slope, rel=1e-6)


def test_course_at_rest_is_not_known() -> None:
    assert course_variance(np.zeros(4), np.eye(4)) == math.inf
