"""Attitude and rate control of a multicopter against their published laws, worked out with rotations."""

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from autopilot_bridge.control.multicopter import MulticopterParameters
from autopilot_bridge.control.multicopter import layout as c
from autopilot_bridge.control.multicopter.attitude import (
    attitude_control,
    limit_rates,
    quaternion_from_thrust_axis,
    rate_control,
)
from flightsim.foundation import records
from flightsim.foundation.random_streams import RandomStreams
from flightsim.foundation.records import new_record, the_record
from tests.rotations import rotation_matrix

Array = NDArray[np.float64]
DT_S = 0.004
GAINS = {"roll_p_1_s": 5.0, "pitch_p_1_s": 7.0, "yaw_p_1_s": 3.0}


def packed(**values: float) -> MulticopterParameters:
    parameters = MulticopterParameters(**values)  # type: ignore[arg-type]
    return the_record(records.packed(parameters), MulticopterParameters)


def rotation(q: Array) -> Rotation:
    return Rotation.from_quat(q[[1, 2, 3, 0]])


def quaternion(r: Rotation) -> Array:
    return r.as_quat()[[3, 0, 1, 2]]


def attitudes(seed: int, count: int) -> Array:
    q = RandomStreams(seed).generator("attitudes").normal(size=(count, 4))
    return q / np.linalg.norm(q, axis=1, keepdims=True)


def expected_rates(q: Array, q_sp: Array, yaw_weight: float, yaw_rate: float) -> Array:
    """Brescianini, Hehn, D'Andrea 2013: the shortest rotation of the thrust axis, then `yaw_weight` of the
    rotation about it that remains; 2 sgn(q_e0) P q_e of the error in body axes, and the turn about NED
    down."""
    now, wanted = rotation(q), rotation(q_sp)
    down, down_sp = now.apply([0.0, 0.0, 1.0]), wanted.apply([0.0, 0.0, 1.0])
    across = np.cross(down, down_sp)
    angle = math.atan2(float(np.linalg.norm(across)), float(down @ down_sp))
    reduced = Rotation.from_rotvec(across / np.linalg.norm(across) * angle) * now
    about_z = (reduced.inv() * wanted).as_rotvec()
    np.testing.assert_allclose(about_z[:2], 0.0, atol=1e-6)
    mixed = reduced * Rotation.from_rotvec([0.0, 0.0, yaw_weight * about_z[2]])
    error = quaternion(now.inv() * mixed)
    if error[0] < 0.0:
        error = -error
    yaw_p = GAINS["yaw_p_1_s"] / yaw_weight if yaw_weight > 0.0 else GAINS["yaw_p_1_s"]
    gains = np.array([GAINS["roll_p_1_s"], GAINS["pitch_p_1_s"], yaw_p])
    return gains * 2.0 * error[1:] + yaw_rate * now.inv().apply([0.0, 0.0, 1.0])


@pytest.mark.parametrize("yaw_weight", [0.0, 0.3, 1.0])
def test_attitude_law(yaw_weight: float) -> None:
    p = packed(**GAINS, yaw_weight=yaw_weight)
    for q, q_sp in zip(attitudes(1, 60), attitudes(2, 60), strict=True):
        rate = np.zeros(3)
        attitude_control(q, q_sp, 0.7, p, rate, np.zeros(8))
        np.testing.assert_allclose(rate, expected_rates(q, q_sp, yaw_weight, 0.7), atol=1e-6)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_opposite_thrust_axes_are_turned_by_the_full_attitude(sign: float) -> None:
    """Every rotation to the thrust axis is as short: the wanted attitude itself is flown."""
    q = quaternion(Rotation.from_euler("ZYX", [0.4, 0.2, -0.3]))
    q_sp = sign * quaternion(rotation(q) * Rotation.from_rotvec([math.pi, 0.0, 0.0]))
    rate = np.zeros(3)
    attitude_control(q, q_sp, 0.0, packed(**GAINS, yaw_weight=0.5), rate, np.zeros(8))
    np.testing.assert_allclose(np.abs(rate), [10.0, 0.0, 0.0], atol=1e-6)


def test_small_yaw_errors_keep_their_full_gain() -> None:
    q = np.array([1.0, 0.0, 0.0, 0.0])
    for weight in (0.2, 0.6, 1.0):
        for angle in (0.01, -0.01):
            q_sp = np.array([math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)])
            rate = np.zeros(3)
            attitude_control(q, q_sp, 0.0, packed(**GAINS, yaw_weight=weight), rate, np.zeros(8))
            assert rate == pytest.approx([0.0, 0.0, 3.0 * angle], rel=1e-4)


def test_attitude_of_every_thrust_axis() -> None:
    """The body's axes as PX4 defines them: x is square to the thrust axis and to the horizontal right-hand
    direction of the heading; upside down, x keeps pointing forwards."""
    rng = RandomStreams(4).generator("axes")
    for z, yaw in zip(rng.normal(size=(300, 3)), rng.uniform(-math.pi, math.pi, 300), strict=True):
        z /= np.linalg.norm(z)
        right = np.array([-math.sin(yaw), math.cos(yaw), 0.0])
        x = np.cross(right, z)
        x *= (1.0 if z[2] >= 0.0 else -1.0) / np.linalg.norm(x)
        q = np.zeros(4)
        quaternion_from_thrust_axis(*z, yaw, q)  # type: ignore[call-arg]
        np.testing.assert_allclose(rotation_matrix(q), np.column_stack([x, np.cross(z, x), z]), atol=1e-9)
        assert np.linalg.norm(q) == pytest.approx(1.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_thrust_axis_along_the_right_hand_direction_turns_the_nose_down(side: float) -> None:
    yaw = 0.7
    z = side * np.array([-math.sin(yaw), math.cos(yaw), 0.0])
    q = np.zeros(4)
    quaternion_from_thrust_axis(*z, yaw, q)  # type: ignore[call-arg]
    x = np.array([0.0, 0.0, 1.0])
    np.testing.assert_allclose(rotation_matrix(q), np.column_stack([x, np.cross(z, x), z]), atol=1e-9)


def test_rates_are_limited_axis_by_axis() -> None:
    p = packed(roll_rate_max_rad_s=1.0, pitch_rate_max_rad_s=2.0, yaw_rate_max_rad_s=0.5)
    for sign in (1.0, -1.0):
        rates = sign * np.array([3.0, 3.0, 3.0])
        limit_rates(rates, p)
        np.testing.assert_array_equal(rates, sign * np.array([1.0, 2.0, 0.5]))
        inside = sign * np.array([0.9, 1.9, 0.4])
        limit_rates(inside, p)
        np.testing.assert_array_equal(inside, sign * np.array([0.9, 1.9, 0.4]))


PID = {
    "rate_roll_p": 0.15,
    "rate_roll_i": 0.5,
    "rate_roll_d": 0.003,
    "rate_roll_ff": 0.02,
    "rate_roll_k": 0.8,
    "rate_roll_integral_max": 0.25,
    "rate_pitch_p": 0.25,
    "rate_pitch_i": 0.4,
    "rate_pitch_d": 0.005,
    "rate_pitch_ff": 0.03,
    "rate_pitch_k": 1.2,
    "rate_pitch_integral_max": 0.35,
    "rate_yaw_p": 0.45,
    "rate_yaw_i": 0.3,
    "rate_yaw_d": 0.002,
    "rate_yaw_ff": 0.05,
    "rate_yaw_k": 1.1,
    "rate_yaw_integral_max": 0.2,
    "rate_derivative_cutoff_hz": 25.0,
}
AXES = ("roll", "pitch", "yaw")


def of_axes(name: str) -> Array:
    return np.array([PID[f"rate_{axis}_{name}"] for axis in AXES])


def rate_state() -> Any:
    s = new_record(c.MulticopterState)
    s.rate_previous = 0.10, -0.20, 0.05
    s.rate_derivative = 2.0, -3.0, 1.5
    s.rate_integral = 0.05, -0.06, 0.04
    return s


def test_rate_law() -> None:
    """K (P e + I - D rate') + FF setpoint, the derivative of the rate through a first-order low-pass."""
    s, p = rate_state(), packed(**PID)
    before = s.copy()
    rates, wanted = np.array([0.3, -0.5, 0.2]), np.array([0.8, 0.4, -0.6])
    rate_control(rates, wanted, p, s, DT_S, True)
    slope = (rates - before.rate_previous) / DT_S
    time_constant_s = 1.0 / (2.0 * math.pi * 25.0)
    old = before.rate_derivative
    derivative = old + DT_S / (DT_S + time_constant_s) * (slope - old)
    error = wanted - rates
    integral = before.rate_integral
    torque = (
        of_axes("k") * (of_axes("p") * error + integral - of_axes("d") * derivative) + of_axes("ff") * wanted
    )
    fade = 1.0 - (error / math.radians(400.0)) ** 2  # the integrator rests in flips (PX4)
    np.testing.assert_allclose(s.unallocated, torque, rtol=1e-12)
    np.testing.assert_allclose(s.rate_derivative, derivative, rtol=1e-12)
    np.testing.assert_allclose(s.rate_integral, integral + fade * of_axes("i") * error * DT_S, rtol=1e-12)
    np.testing.assert_array_equal(s.rate_previous, rates)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("missing", "error", "integrates"),
    [
        (0.0, 0.5, True),
        (0.0, -0.5, True),
        (0.3, 0.5, False),
        (-0.3, -0.5, False),
        (0.3, -0.5, True),
        (-0.3, 0.5, True),
        (0.009, 0.5, True),
        (-0.009, -0.5, True),
        (0.011, 0.5, False),
        (-0.011, -0.5, False),
    ],
)
def test_integrator_waits_while_the_motors_cannot_give_more(
    axis: int, missing: float, error: float, integrates: bool
) -> None:
    s, p = rate_state(), packed(**PID)
    s.unallocated[axis] = missing
    before = s.rate_integral[axis]
    wanted = np.zeros(3)
    wanted[axis] = error
    rate_control(np.zeros(3), wanted, p, s, DT_S, True)
    moved = s.rate_integral[axis] - before
    assert (moved * error > 0.0) if integrates else moved == 0.0
    others = [k for k in range(3) if k != axis]
    # no error, no change
    np.testing.assert_array_equal(s.rate_integral[others], rate_state().rate_integral[others])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_integrator_has_its_limit_and_its_switch(sign: float) -> None:
    s, p = rate_state(), packed(**PID)
    for _ in range(2000):
        rate_control(np.zeros(3), np.full(3, sign * 0.5), p, s, DT_S, True)
        s.unallocated = 0.0  # all of it is given
    np.testing.assert_allclose(s.rate_integral, sign * of_axes("integral_max"))
    rate_control(np.zeros(3), np.full(3, -sign * 0.5), p, s, DT_S, False)
    np.testing.assert_allclose(s.rate_integral, sign * of_axes("integral_max"))


@pytest.mark.parametrize("rate_deg_s", [401.0, 800.0])
def test_integrator_rests_in_flips(rate_deg_s: float) -> None:
    s, p = rate_state(), packed(**PID)
    before = s.rate_integral.copy()
    rate_control(np.zeros(3), np.full(3, math.radians(rate_deg_s)), p, s, DT_S, True)
    np.testing.assert_array_equal(s.rate_integral, before)
