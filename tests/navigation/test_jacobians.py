"""Transition and measurement Jacobians against numerical differentiation of the kernels themselves."""

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.navigation import (
    NavigationParameters,
    air_fusion,
    covariance,
    delayed_fusion,
    fusion,
    mechanisation,
)
from autopilot_bridge.navigation import states as s
from autopilot_bridge.navigation.solution import process_from
from flightsim.foundation.random_streams import RandomStreams
from flightsim.foundation.rotations import quaternion_from_euler

Array = NDArray[np.float64]
SIZE = s.ERROR_SIZE_WITH_WIND
DT_S = 0.004
STEPS = 5
IMU = np.array([0.4, -0.7, 0.9, 1.5, -2.0, -11.0, 20.0])


def core_with(error: Array) -> Array:
    """A moving vehicle's core with an error injected."""
    core = np.zeros(s.CORE_SIZE)
    quaternion_from_euler(0.3, -0.4, 1.2, core[s.Q : s.Q + 4])
    core[s.X_VEL : s.X_VEL + 3] = 4.0, -3.0, 1.0
    core[s.X_POS : s.X_POS + 3] = 100.0, 50.0, -20.0
    core[s.X_GYRO_BIAS : s.X_GYRO_BIAS + 3] = 0.01, -0.02, 0.005
    core[s.X_ACCEL_BIAS : s.X_ACCEL_BIAS + 3] = 0.1, -0.05, 0.2
    core[s.X_MAG_BIAS : s.X_MAG_BIAS + 3] = 0.01, 0.02, -0.01
    core[s.X_WIND : s.X_WIND + 2] = -2.0, 5.0
    core[s.GRAVITY] = 9.81
    core[s.STRETCH : s.STRETCH + 2] = 1.0
    work = np.zeros(s.WORK_SIZE)
    work[:SIZE] = error
    covariance.inject(core, work)
    mechanisation.take_sample(core, IMU, 60.0, 400.0)
    core[s.GYRO_LAST : s.GYRO_LAST + 3] = IMU[:3]
    mechanisation.refresh_rotation(core)
    rotation = core[s.R : s.R + 9].reshape(3, 3)
    core[s.FORCE_NED : s.FORCE_NED + 3] = rotation @ (IMU[3:6] - core[s.X_ACCEL_BIAS : s.X_ACCEL_BIAS + 3])
    return core


def error_between(true: Array, estimated: Array) -> Array:
    """Error state from two cores."""
    out = np.zeros(SIZE)
    turn = true[s.R : s.R + 9].reshape(3, 3) @ estimated[s.R : s.R + 9].reshape(3, 3).T
    out[:3] = 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    out[3:] = true[4 : s.NOMINAL_SIZE] - estimated[4 : s.NOMINAL_SIZE]
    return out


def propagated(error: Array) -> Array:
    core = core_with(error)
    for _ in range(STEPS):
        mechanisation.advance(core, DT_S, 0.2)
    return core


def numerical_transition(nominal: Array) -> Array:
    """Transition over `STEPS` by differencing the mechanisation."""
    h = 1e-5
    out = np.zeros((SIZE, SIZE))
    for i in range(SIZE):
        step = np.zeros(SIZE)
        step[i] = h
        out[:, i] = error_between(propagated(step), nominal) / h
    return out


def analytic_transition(core: Array) -> Array:
    out = np.eye(SIZE)
    covariance.carry(out, core, core[s.SUM_TIME], False)
    return out


def test_transition() -> None:
    nominal = propagated(np.zeros(SIZE))
    error = analytic_transition(nominal) - numerical_transition(nominal)
    # What is of second order in the interval T = 20 ms: gyro bias to velocity, g T^2 / 2 = 2 mm/s per rad/s.
    assert np.abs(error[s.VEL : s.VEL + 3, s.GYRO_BIAS : s.GYRO_BIAS + 3]).max() < 3e-3
    error[s.VEL : s.POS + 3, s.GYRO_BIAS : s.GYRO_BIAS + 3] = 0.0
    assert np.abs(error).max() < 4e-4


def test_prediction_is_the_transition_and_the_noise() -> None:
    nominal = propagated(np.zeros(SIZE))
    transition = analytic_transition(nominal)
    root = RandomStreams(3).generator("transition").normal(size=(SIZE, SIZE))
    p = root @ root.T
    parameters = NavigationParameters(magnetometer_bias_turn_rad=1e15)
    t = STEPS * DT_S
    decay = np.ones(SIZE)
    decay[s.GYRO_BIAS : s.GYRO_BIAS + 3] = np.exp(
        -t * parameters.gyro_bias_walk_rad_s_sqrt_s**2 / (2.0 * parameters.gyro_bias_rad_s**2)
    )
    decay[s.ACCEL_BIAS : s.ACCEL_BIAS + 3] = np.exp(
        -t * parameters.accel_bias_walk_m_s2_sqrt_s**2 / (2.0 * parameters.accel_bias_m_s2**2)
    )
    decay[s.GPS_ERROR : s.GPS_ERROR + 3] = np.exp(-t / parameters.gps_position_tau_s)
    decay[s.MAG_BIAS : s.MAG_BIAS + 3] = np.exp(-t / parameters.magnetometer_bias_tau_s)
    full = np.diag(decay) @ transition
    expected = full @ p @ full.T
    covariance.predict(p, nominal, process_from(parameters))
    np.testing.assert_array_equal(p, p.T)
    noise = p - expected
    off_diagonal = noise - np.diag(np.diag(noise))
    np.testing.assert_allclose(off_diagonal, 0.0, atol=1e-11)
    assert noise[s.VEL, s.VEL] == pytest.approx(parameters.accel_noise_m_s2_sqrt_hz**2 * t, rel=1e-6)
    walk = 1.0 - np.exp(-2.0 * t / parameters.gps_position_tau_s)
    wander_m, offset_walk = parameters.gps_position_walk_m[0], parameters.barometer_offset_walk_m_per_sqrt_s
    assert noise[s.GPS_ERROR, s.GPS_ERROR] == pytest.approx(wander_m**2 * walk, rel=1e-6)
    assert noise[s.BARO_OFFSET, s.BARO_OFFSET] == pytest.approx(offset_walk**2 * t, rel=1e-6)
    assert noise[s.WIND, s.WIND] == pytest.approx(parameters.wind_walk_m_s_sqrt_s**2 * t, rel=1e-6)
    assert (np.diag(noise)[: s.POS] > 0.0).all()
    assert not nominal[s.SUM_TIME : s.SUM_GYRO].any()


def history_row(core: Array) -> Array:
    row = np.zeros((1, s.HISTORY_COLUMNS))
    row[0, :3] = core[s.X_POS : s.X_POS + 3]
    row[0, 3:6] = core[s.X_VEL : s.X_VEL + 3]
    row[0, 6:] = core[s.Q : s.Q + 4]
    return row


def prediction(error: Array, kind: str, axis: int) -> float:
    """What a sensor would read of a vehicle whose state differs from the nominal one by `error`."""
    core = core_with(error)
    if kind == "velocity":
        return float(core[s.X_VEL + axis])
    if kind == "position":
        return float(core[s.X_POS + axis])
    if kind == "GPS position":
        return float(core[s.X_POS + axis] + core[s.X_GPS_ERROR + axis])
    if kind == "baro":
        return float(-core[s.X_POS + 2] + core[s.X_BARO_OFFSET])
    air = core[s.X_VEL : s.X_VEL + 3] - [*core[s.X_WIND : s.X_WIND + 2], 0.0]
    if kind == "airspeed":
        return float(np.linalg.norm(air))
    if kind == "sideslip":
        return float((core[s.R : s.R + 9].reshape(3, 3).T @ air)[1])
    field = np.array([0.2, 0.02, 0.43])
    return float((core[s.R : s.R + 9].reshape(3, 3).T @ field + core[s.X_MAG_BIAS : s.X_MAG_BIAS + 3])[axis])


def analytic_row(kind: str, axis: int, delay_s: float, core: Array, u: Array) -> Array:
    """H from the kernels: with P the identity, P H^T is H."""
    p, work = np.eye(SIZE), np.zeros(s.WORK_SIZE)
    if kind == "velocity":
        r = core[s.R : s.R + 9].reshape(3, 3)
        b = delay_s * r[axis]
        delayed_fusion.velocity_ph(p, work, axis, u[(axis + 1) % 3], u[(axis + 2) % 3], b[0], b[1], b[2])
    elif kind in ("position", "GPS position"):
        delayed_fusion.position_ph(p, work, axis, delay_s, kind == "GPS position")
    elif kind == "baro":
        fusion.baro_ph(p, work, delay_s)
    else:
        rx, ry, rz = delayed_fusion.body_axis_in_ned(history_row(core), 0, axis)
        mx, my, mz = 0.2, 0.02, 0.43
        fusion.mag_ph(p, work, axis, ry * mz - rz * my, rz * mx - rx * mz, rx * my - ry * mx)
    return work[s.PH :].copy()


def numerical_row(kind: str, axis: int) -> Array:
    h = 1e-6
    out = np.zeros(SIZE)
    for i in range(SIZE):
        step = np.zeros(SIZE)
        step[i] = h
        out[i] = (prediction(step, kind, axis) - prediction(-step, kind, axis)) / (2.0 * h)
    return out


@pytest.mark.parametrize("kind", ["velocity", "position", "GPS position", "baro", "mag"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_measurement(kind: str, axis: int) -> None:
    core = core_with(np.zeros(SIZE))
    row = analytic_row(kind, axis, 0.0, core, np.zeros(3))
    np.testing.assert_allclose(row, numerical_row(kind, axis), atol=1e-6)


@pytest.mark.parametrize("kind", ["velocity", "position", "GPS position", "baro"])
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_delayed_measurement(kind: str, axis: int) -> None:
    """A measurement of the past refers to the present error through the inverse of the transition since."""
    now = propagated(np.zeros(SIZE))
    expected = numerical_row(kind, axis) @ np.linalg.inv(numerical_transition(now))
    row = analytic_row(kind, axis, STEPS * DT_S, now, now[s.SUM_FORCE : s.SUM_FORCE + 3])
    np.testing.assert_allclose(row, expected, atol=5e-3)  # first order in the delay of 20 ms


@pytest.mark.parametrize("delay_s", [0.0, 0.3])
def test_delayed_height_is_that_of_the_past(delay_s: float) -> None:
    """A vehicle that sank by `delay * v_down` since the pressure was sampled was that much higher then: the
    predicted pressure altitude, and its variance, by the same row."""
    error = RandomStreams(5).generator("error").normal(size=SIZE)
    work = np.zeros(s.WORK_SIZE)
    work[:SIZE] = error
    past_down = error[s.POS + 2] - delay_s * error[s.VEL + 2]
    assert fusion.baro_dot(work, s.DX, delay_s) == pytest.approx(-past_down + error[s.BARO_OFFSET], abs=1e-12)
    root = RandomStreams(6).generator("covariance").normal(size=(SIZE, SIZE))
    p = root @ root.T
    row = np.zeros(SIZE)
    row[[s.POS + 2, s.VEL + 2, s.BARO_OFFSET]] = -1.0, delay_s, 1.0
    assert fusion.baro_ph(p, work, delay_s) == pytest.approx(float(row @ p @ row), rel=1e-12)
    np.testing.assert_allclose(work[s.PH : s.PH + SIZE], p @ row, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", ["airspeed", "sideslip"])
def test_air_data(kind: str) -> None:
    """Gain, innovation and predicted variance of the update itself: with P the identity the error estimate
    is H^T times the innovation over its variance."""
    core = core_with(np.zeros(SIZE))
    history = history_row(core)
    row = numerical_row(kind, 0)
    before, work, p = core.copy(), np.zeros(s.WORK_SIZE), np.eye(SIZE)
    air = np.zeros(air_fusion.AIR_SIZE)
    air[air_fusion.GATE_AIRSPEED] = air[air_fusion.GATE_SIDESLIP] = 100.0
    air[air_fusion.AIRSPEED] = prediction(np.zeros(SIZE), "airspeed", 0) + 0.3
    air[air_fusion.AIRSPEED_VAR] = air[air_fusion.SIDESLIP_VAR] = 4.0
    todo = air_fusion.HAS_AIRSPEED if kind == "airspeed" else air_fusion.HAS_SIDESLIP
    accepted = air_fusion.update(p, core, history, work, air, 0, todo)
    assert accepted == (air_fusion.ACCEPTED_AIRSPEED if kind == "airspeed" else air_fusion.ACCEPTED_SIDESLIP)
    innovation = 0.3 if kind == "airspeed" else -prediction(np.zeros(SIZE), "sideslip", 0)
    variance = row @ row + 4.0
    np.testing.assert_allclose(
        core[s.X_VEL : s.NOMINAL_SIZE] - before[s.X_VEL : s.NOMINAL_SIZE],
        row[s.VEL :] * innovation / variance,
        atol=1e-6,
    )
    np.testing.assert_allclose(p, np.eye(SIZE) - np.outer(row, row) / variance, atol=1e-6)


def test_wind_alone_is_corrected_and_the_rest_considered() -> None:
    """Against Joseph's form of the covariance with the other gains set to zero."""
    rng = RandomStreams(3).generator("wind")
    root = rng.normal(size=(SIZE, SIZE))
    p = root @ root.T
    h = np.zeros(SIZE)
    h[s.VEL : s.VEL + 3] = 0.6, -0.8, 0.0
    h[s.WIND : s.WIND + 2] = -0.6, 0.8
    work = np.zeros(s.WORK_SIZE)
    work[s.PH :] = p @ h
    variance = float(h @ p @ h) + 2.0
    gain = np.zeros(SIZE)
    gain[s.WIND :] = (p @ h)[s.WIND :] / variance
    rest = np.eye(SIZE) - np.outer(gain, h)
    expected = rest @ p @ rest.T + 2.0 * np.outer(gain, gain)
    air_fusion.apply_to_wind(p, work, 1.5, variance)
    np.testing.assert_allclose(p, expected, atol=1e-10)
    np.testing.assert_allclose(work[:SIZE], 1.5 * gain, atol=1e-12)
