"""Position and velocity loops of a multicopter, one step at a time, against PX4's published structure."""

import math
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from autopilot_bridge.control.multicopter import MulticopterParameters, position
from autopilot_bridge.control.multicopter import layout as c
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.control.multicopter.position import lowpass_gain
from autopilot_bridge.navigation import layout as n
from flightsim.foundation import records
from flightsim.foundation.atmosphere import GRAVITY_M_S2 as G
from flightsim.foundation.records import new_record, the_record
from flightsim.foundation.rotations import quaternion_from_euler
from tests.control.on_arrays import on_arrays
from tests.rotations import rotation_matrix

Array = NDArray[np.float64]
DT_S = 0.016
HOVER = 0.5
BUMP_TIME_S = 0.3
trajectory_control, vertical_control, update_filters, update_airborne, estimate_hover_thrust = on_arrays(
    sp.Setpoint,
    position.trajectory_control,
    position.vertical_control,
    position.update_filters,
    position.update_airborne,
    position.estimate_hover_thrust,
)
LOOSE = {"speed_xy_max_m_s": 20.0, "speed_up_max_m_s": 8.0, "speed_down_max_m_s": 8.0, "thrust_min": 0.05}


@cache
def packed(**values: float | bool) -> MulticopterParameters:
    parameters = MulticopterParameters(**(LOOSE | values))  # type: ignore[arg-type]
    return the_record(records.packed(parameters), MulticopterParameters)


def flying() -> tuple[Array, Array, c.MulticopterState]:
    """(navigation state, setpoint, controller state) of a hover 20 m up, nose to the east."""
    nav, setpoint, s = (
        np.zeros(n.NAV_SIZE),
        np.full(sp.SETPOINT_SIZE, math.nan),
        new_record(c.MulticopterState),
    )
    yaw = 0.5 * math.pi
    quaternion_from_euler(0.0, 0.0, yaw, nav[n.Q_NED_FROM_FRD])
    nav[n.YAW] = yaw
    nav[n.POS_NED_M] = 10.0, -5.0, -20.0
    s.hover, s.airborne = HOVER, 1.0
    s.thrust_given = s.thrust_lagged = HOVER
    s.hover_variance = 0.002
    return nav, setpoint, s


def vector(s: Array, first: int) -> Array:
    return s[first : first + 3].copy()


def thrust_vector(s: c.MulticopterState) -> Array:
    """NED, in units of the hover thrust: what the attitude and the collective give."""
    return -rotation_matrix(s.q_setpoint)[:, 2] * s.thrust_setpoint / s.hover


def test_cascade() -> None:
    """Position P and feed-forward give a velocity; PID and feed-forward an acceleration; gravity, and drag
    where the velocity is controlled, a thrust vector; the integrators add up the velocity error."""
    nav, setpoint, s = flying()
    p = packed()
    setpoint[sp.POS_NED_M] = 11.0, -6.5, -20.4
    setpoint[sp.VEL_NED_M_S] = 0.5, -0.3, 0.2
    setpoint[sp.ACC_NED_M_S2] = 0.4, 0.2, -0.3
    setpoint[sp.YAW_RAD], setpoint[sp.YAW_RATE_RAD_S] = 0.3, 0.6
    nav[n.VEL_NED_M_S] = 0.2, 0.1, -0.1
    s.acc_filtered = 0.3, -0.2, 0.15
    s.vel_integral = 0.1, 0.25, -0.2
    s.drag[:2] = -0.5, 0.35
    s.bump = 0.05, -0.07, 0.09
    before = s.copy()  # type: ignore[attr-defined]
    trajectory_control(nav, setpoint, p, s, DT_S, False)

    q = MulticopterParameters()
    position_p = np.array([q.pos_xy_p_1_s, q.pos_xy_p_1_s, q.pos_z_p_1_s])
    velocity = np.array([0.5, -0.3, 0.2]) + position_p * np.array([1.0, -1.5, -0.4])
    error = velocity - nav[n.VEL_NED_M_S]
    kp = np.array([q.vel_xy_p_1_s, q.vel_xy_p_1_s, q.vel_z_p_1_s])
    ki = np.array([q.vel_xy_i_1_s2, q.vel_xy_i_1_s2, q.vel_z_i_1_s2])
    kd = np.array([q.vel_xy_d, q.vel_xy_d, q.vel_z_d])
    acceleration = (
        setpoint[sp.ACC_NED_M_S2] + kp * error + before.vel_integral - kd * before.acc_filtered + before.bump
    )
    np.testing.assert_allclose(s.vel_setpoint, velocity)
    np.testing.assert_allclose(s.acc_setpoint, acceleration)
    wanted = acceleration - [-0.5, 0.35, 0.0]
    np.testing.assert_allclose(thrust_vector(s), (wanted - [0.0, 0.0, G]) / G, atol=1e-9)
    np.testing.assert_allclose(s.vel_integral, before.vel_integral + ki * error * DT_S, rtol=1e-12)
    np.testing.assert_allclose(s.bump, before.bump * math.exp(-DT_S / BUMP_TIME_S))
    assert s.yaw_rate_ff == 0.6
    nose = rotation_matrix(s.q_setpoint)[:, 0]
    assert math.atan2(nose[1], nose[0]) == pytest.approx(0.3, abs=1e-9)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(
    ("position", "velocity", "acceleration", "expected"),
    [
        (0.5, math.nan, math.nan, "position"),
        (0.5, 0.3, math.nan, "both"),
        (math.nan, 0.3, math.nan, "velocity"),
        (math.nan, 0.3, 0.4, "velocity"),
        (math.nan, math.nan, math.nan, "stand"),
        (math.nan, math.nan, 0.4, "free"),
    ],
)
def test_what_is_not_given_of_an_axis_is_filled(
    axis: int, position: float, velocity: float, acceleration: float, expected: str
) -> None:
    """NaN means not controlled, as in PX4's TrajectorySetpoint; an axis of which nothing is given stands
    still; the others are not touched."""
    nav, setpoint, s = flying()
    p = packed()
    setpoint[sp.POS_NED_M] = nav[n.POS_NED_M]
    setpoint[sp.POS + axis] += position
    setpoint[sp.VEL + axis] = velocity
    setpoint[sp.ACC + axis] = acceleration
    s.vel_integral = 0.3
    trajectory_control(nav, setpoint, p, s, DT_S, False)
    gain = p.pos_z_p_1_s if axis == 2 else p.pos_xy_p_1_s
    wanted = {
        "position": 0.5 * gain,
        "both": 0.5 * gain + 0.3,
        "velocity": 0.3,
        "stand": 0.0,
        "free": math.nan,
    }[expected]
    velocities = np.zeros(3)
    velocities[axis] = wanted
    np.testing.assert_allclose(s.vel_setpoint, velocities, atol=1e-12)
    if expected == "free":  # the acceleration alone, and the integrator starts anew
        assert s.acc_setpoint[axis] == pytest.approx(0.4)
        assert s.vel_integral[axis] == 0.0


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_unknown_velocity_is_not_controlled(axis: int) -> None:
    nav, setpoint, s = flying()
    nav[n.VEL + axis] = math.nan
    s.vel_integral = 0.3
    setpoint[sp.VEL_NED_M_S] = 0.5
    trajectory_control(nav, setpoint, packed(), s, DT_S, False)
    assert s.acc_setpoint[axis] == 0.0
    assert s.vel_integral[axis] == 0.0
    assert np.isfinite(s.q_setpoint).all()


def test_drag_is_fought_only_on_axes_whose_velocity_is_controlled() -> None:
    nav, setpoint, s = flying()
    setpoint[sp.VEL_NED_M_S] = math.nan, 0.0, 0.0
    setpoint[sp.ACC] = 0.0
    s.drag[:2] = 0.6, -0.8
    s.bump[:2] = 0.4, 0.0
    trajectory_control(nav, setpoint, packed(), s, DT_S, False)
    assert thrust_vector(s) == pytest.approx([0.0, 0.8 / G, -1.0], abs=1e-9)
    assert s.bump[0] == 0.0
    setpoint[sp.VEL_NED_M_S] = 0.0, math.nan, 0.0
    setpoint[sp.ACC_NED_M_S2] = math.nan, 0.0, math.nan
    s.bump[:2] = 0.0, 0.4
    s.vel_integral = 0.0
    trajectory_control(nav, setpoint, packed(), s, DT_S, False)
    assert thrust_vector(s) == pytest.approx([-0.6 / G, 0.0, -1.0], abs=1e-9)
    assert s.bump[1] == 0.0


@pytest.mark.parametrize("direction", np.linspace(0.0, 2.0 * math.pi, 7)[:-1])
def test_position_error_alone_is_flown_at_the_speed_limit(direction: float) -> None:
    nav, setpoint, s = flying()
    unit = np.array([math.cos(direction), math.sin(direction), 0.0])
    setpoint[sp.POS_NED_M] = nav[n.POS_NED_M] + 100.0 * unit
    trajectory_control(nav, setpoint, packed(speed_xy_max_m_s=6.0), s, DT_S, False)
    np.testing.assert_allclose(s.vel_setpoint, 6.0 * unit, atol=1e-9)
    # together with a feed-forward: the position's share has its right of way
    setpoint[sp.VEL_NED_M_S] = 3.0 * unit
    trajectory_control(nav, setpoint, packed(speed_xy_max_m_s=6.0), s, DT_S, False)
    np.testing.assert_allclose(s.vel_setpoint, 6.0 * unit, atol=1e-9)


@pytest.mark.parametrize(
    ("share", "forward"),
    [
        ((2.0, 1.0), (7.0, -3.0)),
        ((2.0, 1.0), (-9.0, 1.0)),
        ((0.0, 0.0), (5.0, 8.0)),
        ((-1.0, 3.0), (0.0, 9.0)),
        ((0.3, -0.2), (7.0, 0.5)),
        ((5.9, 0.0), (0.5, 0.0)),
    ],
)
def test_feed_forward_gives_way_at_the_speed_limit(
    share: tuple[float, float], forward: tuple[float, float]
) -> None:
    """The largest part k of the feed-forward f with |p + k f| = limit, p the position's share."""
    limit = 6.0
    nav, setpoint, s = flying()
    p = packed(speed_xy_max_m_s=limit)
    setpoint[sp.POS_NED_M] = nav[n.POS_NED_M] + np.array([*share, 0.0]) / p.pos_xy_p_1_s
    setpoint[sp.VEL_NED_M_S] = *forward, 0.0
    trajectory_control(nav, setpoint, p, s, DT_S, False)
    low, high = 0.0, 1.0
    for _ in range(60):  # bisection: nothing of the kernel's formula
        k = 0.5 * (low + high)
        inside = np.linalg.norm(np.array(share) + k * np.array(forward)) <= limit
        low, high = (k, high) if inside else (low, k)
    expected = np.array(share) + low * np.array(forward)
    np.testing.assert_allclose(s.vel_setpoint[:2], expected, atol=1e-6)


@pytest.mark.parametrize(("axis", "other"), [(0, 1), (1, 0)])
def test_an_axis_without_a_velocity_takes_nothing_of_the_speed_limit(axis: int, other: int) -> None:
    nav, setpoint, s = flying()
    setpoint[sp.VEL_NED_M_S] = 0.0
    setpoint[sp.VEL + axis], setpoint[sp.VEL + other], setpoint[sp.ACC + other] = 6.0, math.nan, 0.5
    trajectory_control(nav, setpoint, packed(speed_xy_max_m_s=6.0), s, DT_S, False)
    assert s.vel_setpoint[axis] == pytest.approx(6.0)
    assert math.isnan(s.vel_setpoint[other])


@pytest.mark.parametrize(("error_m", "velocity"), [(-50.0, -3.0), (50.0, 1.5), (-0.5, -0.5), (0.5, 0.5)])
def test_climb_and_descent_have_limits_of_their_own(error_m: float, velocity: float) -> None:
    nav, setpoint, s = flying()
    setpoint[sp.POS + 2] = nav[n.POS + 2] + error_m
    p = packed(speed_up_max_m_s=3.0, speed_down_max_m_s=1.5)
    trajectory_control(nav, setpoint, p, s, DT_S, False)
    assert s.vel_setpoint[2] == pytest.approx(velocity)


@pytest.mark.parametrize("bearing", [0.0, 2.0, 4.0])
def test_tilt_limit_and_tracking_anti_windup(bearing: float) -> None:
    """Vertical first: the lift stays, and the horizontal thrust is cut to the tangent of the largest tilt.
    What is missing goes back through the integrator at 2 / P (PX4)."""
    nav, setpoint, s = flying()
    p = packed(tilt_max_rad=math.radians(30.0))
    unit = np.array([math.cos(bearing), math.sin(bearing), 0.0])
    setpoint[sp.VEL_NED_M_S] = 0.0
    setpoint[sp.ACC_NED_M_S2] = 12.0 * unit
    nav[n.VEL_NED_M_S] = -0.5 * unit
    trajectory_control(nav, setpoint, p, s, DT_S, False)
    tangent = math.tan(math.radians(30.0))
    np.testing.assert_allclose(thrust_vector(s), tangent * unit - [0.0, 0.0, 1.0], atol=1e-9)
    wanted = 12.0 + 0.5 * p.vel_xy_p_1_s
    back = 2.0 / p.vel_xy_p_1_s * (wanted - G * tangent)
    integral = p.vel_xy_i_1_s2 * (0.5 - back) * DT_S
    np.testing.assert_allclose(s.vel_integral, integral * unit, atol=1e-9)


def test_climb_at_full_thrust_leaves_a_margin_for_the_path() -> None:
    nav, setpoint, s = flying()
    p = packed(thrust_xy_margin=0.3, thrust_max=0.9)
    setpoint[sp.VEL_NED_M_S] = 0.0
    setpoint[sp.ACC_NED_M_S2] = 8.0, 0.0, -20.0
    trajectory_control(nav, setpoint, p, s, DT_S, False)
    assert s.thrust_setpoint == pytest.approx(0.9)
    flown = thrust_vector(s) * HOVER
    # the margin of 0.3 x 0.9, and no more
    np.testing.assert_allclose(flown, [0.27, 0.0, -math.sqrt(0.9**2 - 0.27**2)], atol=1e-9)
    # a smaller wish is met, and the climb gets the rest
    setpoint[sp.ACC_NED_M_S2] = 2.0, 0.0, -20.0
    s.vel_integral = 0.0
    trajectory_control(nav, setpoint, p, s, DT_S, False)
    side = HOVER * 2.0 / G
    np.testing.assert_allclose(thrust_vector(s) * HOVER, [side, 0.0, -math.sqrt(0.9**2 - side**2)], atol=1e-9)


@pytest.mark.parametrize("angle", [0.3, 2.5, 4.4])
def test_horizontal_integrator_is_bounded_by_gravity(angle: float) -> None:
    nav, setpoint, s = flying()
    direction = np.array([math.cos(angle), math.sin(angle)])
    s.vel_integral[:2] = 1.5 * G * direction
    s.drag[:2] = 1.5 * G * direction  # so that the thrust is not limited
    setpoint[sp.VEL_NED_M_S] = 0.0
    trajectory_control(nav, setpoint, packed(), s, DT_S, False)
    np.testing.assert_allclose(s.vel_integral[:2], G * direction, rtol=1e-9)


def test_on_the_ground_horizontal_integrators_stay_empty() -> None:
    nav, setpoint, s = flying()
    s.airborne = 0.0
    s.vel_integral[:2] = 0.4
    setpoint[sp.VEL_NED_M_S] = 1.0
    trajectory_control(nav, setpoint, packed(), s, DT_S, False)
    assert not s.vel_integral[:2].any()


def test_yaw_that_is_not_given_is_the_present_one() -> None:
    nav, setpoint, s = flying()
    setpoint[sp.VEL_NED_M_S] = 0.0
    trajectory_control(nav, setpoint, packed(), s, DT_S, False)
    nose = rotation_matrix(s.q_setpoint)[:, 0]
    assert nose == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)
    assert s.yaw_rate_ff == 0.0


def test_free_fall_points_no_thrust_and_keeps_the_least() -> None:
    nav, setpoint, s = flying()
    setpoint[sp.VEL_NED_M_S] = 0.0
    setpoint[sp.ACC_NED_M_S2] = 0.0, 0.0, 2.0 * G
    trajectory_control(nav, setpoint, packed(thrust_min=0.12), s, DT_S, False)
    assert s.thrust_setpoint == 0.12
    assert rotation_matrix(s.q_setpoint)[:, 2] == pytest.approx([0.0, 0.0, 1.0])


@pytest.mark.parametrize("airborne", [True, False])
def test_entering_starts_from_the_thrust_that_is_flown(airborne: bool) -> None:
    """At the switch, the thrust vector stays as it is, and goes over to the new one with its time."""
    nav, setpoint, s = flying()
    quaternion_from_euler(0.15, -0.25, 0.9, nav[n.Q_NED_FROM_FRD])
    s.airborne, s.thrust_given = float(airborne), 0.56
    s.drag[:2] = 0.3, -0.4
    setpoint[sp.VEL_NED_M_S] = 1.0, -0.7, 0.3
    trajectory_control(nav, setpoint, packed(), s, DT_S, True)
    present = -rotation_matrix(nav[n.Q_NED_FROM_FRD])[:, 2] * 0.56 / HOVER
    if airborne:
        np.testing.assert_allclose(thrust_vector(s), present, atol=1e-9)
    else:
        assert np.abs(thrust_vector(s) - present).max() > 0.05
        assert not s.bump.any()


def test_the_vertical_jump_is_bounded_and_a_tilt_counts_up_to_its_limit() -> None:
    for thrust, tilt, bump in (
        (0.0, 0.0, 5.0),  # falling: G wanted, at most 5
        (1.0, 0.0, -5.0),
        (0.52, 0.4, G * (1.0 - 0.52 * math.cos(0.4) / HOVER)),
        (0.9, 1.5, G * (1.0 - 0.9 * 0.3 / HOVER)),
    ):
        nav, setpoint, s = flying()
        quaternion_from_euler(tilt, 0.0, 0.0, nav[n.Q_NED_FROM_FRD])
        s.thrust_given = thrust
        setpoint[sp.VEL_NED_M_S] = 0.0
        vertical_control(nav, setpoint, packed(), s, DT_S, True)
        assert s.acc_setpoint[2] == pytest.approx(bump, rel=1e-9)


@pytest.mark.parametrize(
    ("acceleration", "error", "integrates"),
    [
        (0.0, 0.2, True),
        (0.0, -0.2, True),
        (30.0, 0.2, False),  # no thrust left to take away
        (30.0, -0.2, True),
        (-30.0, -0.2, False),  # full thrust already
        (-30.0, 0.2, True),
    ],
)
def test_vertical_integrator_waits_at_the_limits_of_the_thrust(
    acceleration: float, error: float, integrates: bool
) -> None:
    nav, setpoint, s = flying()
    s.vel_setpoint[2] = error
    setpoint[sp.ACC + 2] = acceleration
    p = packed()
    vertical_control(nav, setpoint, p, s, DT_S, False)
    assert s.vel_integral[2] == pytest.approx(p.vel_z_i_1_s2 * error * DT_S if integrates else 0.0)


@pytest.mark.parametrize(("error", "integrates"), [(0.2, False), (-0.2, True)])
def test_before_lift_off_the_integrator_pulls_upwards_only(error: float, integrates: bool) -> None:
    nav, setpoint, s = flying()
    s.airborne = 0.0
    s.vel_setpoint[2] = error
    vertical_control(nav, setpoint, packed(), s, DT_S, False)
    assert bool(s.vel_integral[2]) is integrates


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_vertical_integrator_is_bounded_by_gravity(sign: float) -> None:
    nav, setpoint, s = flying()
    s.vel_integral[2] = sign * 2.0 * G
    setpoint[sp.ACC + 2] = -sign * 2.0 * G
    vertical_control(nav, setpoint, packed(), s, DT_S, False)
    assert s.vel_integral[2] == sign * G


@pytest.mark.parametrize(
    ("acceleration", "thrust"),
    [(0.0, HOVER), (-0.5 * G, 0.75), (0.5 * G, 0.25), (2 * G, 0.0), (-2 * G, 0.95)],
)
def test_vertical_thrust_is_that_of_the_acceleration(acceleration: float, thrust: float) -> None:
    nav, setpoint, s = flying()
    setpoint[sp.ACC + 2] = acceleration
    assert vertical_control(nav, setpoint, packed(thrust_max=0.95), s, DT_S, False) == pytest.approx(thrust)


def test_low_pass_gain() -> None:
    """Backward Euler of a lag of 1 / (2 pi f)."""
    for dt_s, cutoff_hz in ((0.004, 5.0), (0.016, 0.8)):
        tau_s = 1.0 / (2.0 * math.pi * cutoff_hz)
        assert lowpass_gain(dt_s, cutoff_hz) == pytest.approx(dt_s / (dt_s + tau_s))


def test_acceleration_filter_and_missing_samples() -> None:
    nav, _, s = flying()
    p = packed()
    s.acc_filtered = old = np.array([0.5, -0.4, 0.3])
    nav[n.ACC_NED_M_S2] = 1.0, 2.0, -3.0
    update_filters(nav, p, s, DT_S)
    alpha = DT_S / (DT_S + 1.0 / (2.0 * math.pi * MulticopterParameters().vel_derivative_cutoff_hz))
    expected = old + alpha * (np.array([1.0, 2.0, -3.0]) - old)
    np.testing.assert_allclose(s.acc_filtered, expected, rtol=1e-12)
    nav[n.ACC_NED_M_S2] = math.nan
    update_filters(nav, p, s, DT_S)
    np.testing.assert_allclose(s.acc_filtered, expected, rtol=1e-12)


def drag_after_one_step(
    force: tuple[float, float, float], cutoff_hz: float = 0.8, **changes: float
) -> tuple[Array, Array]:
    """(drag, horizontal part of the force across the thrust axis) after one step from a drag of its own."""
    nav, _, s = flying()
    quaternion_from_euler(0.2, -0.3, 1.1, nav[n.Q_NED_FROM_FRD])
    nav[n.SPECIFIC_FORCE_FRD_M_S2] = force
    s.drag = 0.4, -0.6, 0.0
    for name, value in changes.items():
        setattr(s, name.lower(), value)
    update_filters(nav, packed(drag_compensation_cutoff_hz=cutoff_hz), s, DT_S)
    across = rotation_matrix(nav[n.Q_NED_FROM_FRD]) @ [force[0], force[1], 0.0]
    return s.drag, across[:2]


def test_drag_is_the_measured_force_across_the_thrust_axis() -> None:
    beta = DT_S / (DT_S + 1.0 / (2.0 * math.pi * 0.8))
    start = np.array([0.4, -0.6])
    drag, across = drag_after_one_step((-1.2, 0.7, -11.0))
    np.testing.assert_allclose(drag[:2], start + beta * (across - start), rtol=1e-12)
    drag, across = drag_after_one_step((-20.0, 15.0, -11.0))
    size = float(np.linalg.norm(across))
    np.testing.assert_allclose(drag[:2], start + beta * (across * 6.0 / size - start), rtol=1e-12)
    # a force of the ground is no drag
    drag, _ = drag_after_one_step((-1.2, 0.7, -11.0), GROUND_CONTACT=1.0)
    np.testing.assert_allclose(drag[:2], (1.0 - beta) * start, rtol=1e-12)
    # nothing measured: as it was
    drag, _ = drag_after_one_step((math.nan, 0.7, -11.0))
    np.testing.assert_array_equal(drag[:2], start)
    for off in (
        drag_after_one_step((-1.2, 0.7, -11.0), 0.0),
        drag_after_one_step((-1.2, 0.7, -11.0), AIRBORNE=0.0),
    ):
        np.testing.assert_array_equal(off[0], np.zeros(3))


@pytest.mark.parametrize(
    ("climb_m", "vertical_m_s", "airborne"),
    [(0.1, 0.4, 0.0), (0.1, -0.4, 0.0), (0.3, 0.0, 1.0), (0.0, 0.6, 1.0), (0.0, -0.6, 1.0), (-1.0, 0.0, 0.0)],
)
def test_airborne_by_motion_under_power(climb_m: float, vertical_m_s: float, airborne: float) -> None:
    nav, _, s = flying()
    s.airborne, s.start_down_m = 0.0, -20.0 + climb_m
    nav[n.VEL + 2] = vertical_m_s
    update_airborne(nav, s)
    assert s.airborne == airborne


def test_hover_thrust_filter_is_a_kalman_filter() -> None:
    """One state h; the accelerometer along the thrust axis reads g T / h (PX4's hover thrust estimator)."""
    nav, _, s = flying()
    p = packed()
    s.thrust_lagged, s.thrust_given = 0.52, 0.60
    s.acc_setpoint[2], s.vel_integral[2] = -0.7, 0.2
    nav[n.FORCE + 2] = -11.0
    estimate_hover_thrust(nav, p, s, DT_S)
    lagged = 0.52 + 0.08 * DT_S / MulticopterParameters().rotor_time_constant_s
    h = -G * lagged / HOVER**2
    variance = 0.002 + 0.0036**2 * DT_S
    gain = variance * h / (h * variance * h + 1.0)
    hover = HOVER + gain * (11.0 - G * lagged / HOVER)
    assert s.thrust_lagged == pytest.approx(lagged)
    assert s.hover == pytest.approx(hover, rel=1e-12)
    assert s.hover_variance == pytest.approx((1.0 - gain * h) * variance, rel=1e-12)
    # the thrust of this moment stays: hover (1 - acc / g) before and after, the integrator makes up
    moved = s.vel_integral[2] - 0.2
    assert hover * (1.0 - (-0.7 + moved) / G) == pytest.approx(HOVER * (1.0 - -0.7 / G))


def test_hover_thrust_is_not_learnt_from_outliers_or_on_the_ground() -> None:
    nav, _, s = flying()
    nav[n.FORCE + 2] = -G - 3.1 * math.sqrt((G / HOVER) ** 2 * 0.002 + 1.0)
    estimate_hover_thrust(nav, packed(), s, DT_S)
    assert s.hover == HOVER
    grown = (0.002 + 0.0036**2 * DT_S) * (1.0 + 2.0 * DT_S)
    assert s.hover_variance == pytest.approx(grown, rel=1e-9)
    nav[n.FORCE + 2] = -G - 2.9 * math.sqrt((G / HOVER) ** 2 * 0.002 + 1.0)
    estimate_hover_thrust(nav, packed(), s, DT_S)
    assert s.hover < HOVER
    for change in ({"AIRBORNE": 0.0}, {"GROUND_CONTACT": 1.0}, {"force": math.nan}, {"parameter": 0.0}):
        nav, _, s = flying()
        nav[n.FORCE + 2] = change.get("force", -11.0)
        for name in change.keys() & {"AIRBORNE", "GROUND_CONTACT"}:
            setattr(s, name.lower(), change[name])
        estimate_hover_thrust(nav, packed(use_hover_thrust_estimate="parameter" not in change), s, DT_S)
        assert s.hover == HOVER
        assert s.hover_variance == 0.002


@pytest.mark.parametrize(("start", "force", "bound"), [(HOVER, -1e-3, 0.9), (0.12, -40.0, 0.05)])
def test_hover_thrust_stays_within_what_can_be(start: float, force: float, bound: float) -> None:
    nav, _, s = flying()
    s.hover = s.thrust_given = s.thrust_lagged = start
    nav[n.FORCE + 2] = force
    for _ in range(2000):
        estimate_hover_thrust(nav, packed(), s, DT_S)
        assert 0.05 <= s.hover <= 0.9
        assert 0.003**2 <= s.hover_variance <= 0.04
    assert s.hover == bound


@pytest.mark.parametrize("rotor_s", [0.0, 0.001])
def test_quick_rotors_give_at_once_what_is_commanded(rotor_s: float) -> None:
    nav, _, s = flying()
    s.thrust_given = 0.7
    nav[n.FORCE + 2] = -G
    estimate_hover_thrust(nav, packed(rotor_time_constant_s=rotor_s), s, DT_S)
    assert s.thrust_lagged == pytest.approx(0.7)
