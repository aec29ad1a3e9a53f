"""The control cascade on the iris model, and what it does with bad input."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from autopilot_bridge.control.multicopter import MulticopterController, MulticopterParameters
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.control.multicopter.attitude import (
    attitude_control,
    body_z_of,
    quaternion_from_thrust_axis,
)
from autopilot_bridge.flight.multicopter import OffboardTask
from autopilot_bridge.navigation import layout as nav_layout
from autopilot_bridge.navigation.layout import NAV_SIZE
from flightsim.environment import Environment, Turbulence
from flightsim.foundation import records
from flightsim.foundation.records import the_record
from flightsim.foundation.rotations import euler_from_quaternion, quaternion_from_euler
from tests.flight.rig import Rig, positions, tilts, velocities
from tests.rotations import rotation_matrix

PX4_DEFAULTS = replace(
    MulticopterParameters(),
    pos_xy_p_1_s=0.95,
    vel_xy_p_1_s=1.8,
    vel_xy_i_1_s2=0.4,
    rate_yaw_p=0.2,
    rate_yaw_i=0.1,
    thrust_min=0.12,
    hover_thrust=0.5,
)


def packed(parameters: MulticopterParameters) -> MulticopterParameters:
    return the_record(records.packed(parameters), MulticopterParameters)


def hovering(**fields: object) -> tuple[Rig, OffboardTask]:
    rig = Rig(height_m=20.0, **fields)
    task = OffboardTask()
    task.set_trajectory((0.0, 0.0, -20.0), yaw_rad=0.0)
    rig.fly(task)
    rig.run(3.0)
    return rig, task


@settings(max_examples=100, deadline=None)
@given(st.floats(-1.2, 1.2), st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_attitude_from_thrust_axis_and_yaw(tilt: float, direction: float, yaw: float) -> None:
    z = (math.sin(tilt) * math.cos(direction), math.sin(tilt) * math.sin(direction), math.cos(tilt))
    q = np.zeros(4)
    quaternion_from_thrust_axis(*z, yaw, q)
    assert np.linalg.norm(q) == pytest.approx(1.0)
    assert body_z_of(q) == pytest.approx(z, abs=1e-9)
    euler = np.zeros(3)
    euler_from_quaternion(q, euler)
    assert math.remainder(euler[2] - yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(*[st.floats(-0.5, 0.5)] * 2, st.floats(-3.0, 3.0), *[st.floats(-0.5, 0.5)] * 2, st.floats(-0.3, 0.3))
def test_attitude_control_turns_towards_the_setpoint(
    roll: float, pitch: float, yaw: float, roll_sp: float, pitch_sp: float, turn: float
) -> None:
    q, q_sp, rate = np.zeros(4), np.zeros(4), np.zeros(3)
    quaternion_from_euler(roll, pitch, yaw, q)
    quaternion_from_euler(roll_sp, pitch_sp, yaw + turn, q_sp)
    attitude_control(q, q_sp, 0.0, packed(MulticopterParameters()), rate, np.zeros(8))
    error = np.zeros(3)  # vector part of q^-1 q_sp
    w, x, y, z = q
    error[:] = (
        w * q_sp[1] - x * q_sp[0] - y * q_sp[3] + z * q_sp[2],
        w * q_sp[2] + x * q_sp[3] - y * q_sp[0] - z * q_sp[1],
        w * q_sp[3] - x * q_sp[2] + y * q_sp[1] - z * q_sp[0],
    )
    if w * q_sp[0] + x * q_sp[1] + y * q_sp[2] + z * q_sp[3] < 0.0:
        error = -error
    assert rate @ error >= -1e-6
    assert np.isfinite(rate).all()


@pytest.mark.parametrize(
    ("roll", "pitch"), [(0.0, 0.0), (0.4, 0.0), (-0.4, 0.0), (0.0, 0.5), (0.0, -0.5), (-0.3, 0.6)]
)
@pytest.mark.parametrize("yaw_rate", [0.7, -0.7])
def test_yaw_rate_is_about_the_vertical(roll: float, pitch: float, yaw_rate: float) -> None:
    """Without an attitude error, the body rates are those of a turn about NED down: R^T (0, 0, rate)."""
    q, rate = np.zeros(4), np.zeros(3)
    quaternion_from_euler(roll, pitch, 1.1, q)
    attitude_control(q, q.copy(), yaw_rate, packed(MulticopterParameters()), rate, np.zeros(8))
    assert rate == pytest.approx(rotation_matrix(q).T @ [0.0, 0.0, yaw_rate], abs=1e-9)


@pytest.mark.parametrize("control", [MulticopterParameters(), PX4_DEFAULTS], ids=["iris", "px4"])
def test_position_step_of_fifteen_metres(control: MulticopterParameters) -> None:
    rig, task = hovering(control=control)
    task.set_trajectory((15.0, 0.0, -20.0), yaw_rad=0.0)
    log = rig.run(9.0)
    error = np.linalg.norm(positions(log) - [15.0, 0.0, -20.0], axis=1)
    assert error[-1] < 0.6
    assert np.abs(positions(log)[:, 2] + 20.0).max() < 0.6
    assert math.degrees(tilts(log).max()) < 50.0


def test_velocity_climb_and_yaw_rate_are_tracked() -> None:
    rig, task = hovering()
    task.set_trajectory(velocity_ned_m_s=(3.0, -2.0, -1.0), yaw_rate_rad_s=0.5)
    log = rig.run(6.0)
    assert velocities(log)[-1] == pytest.approx([3.0, -2.0, -1.0], abs=0.15)
    assert log[-1, 6] == pytest.approx(0.5, abs=0.03)


def test_yaw_step_settles() -> None:
    rig, task = hovering()
    task.set_trajectory((0.0, 0.0, -20.0), yaw_rad=1.5)
    log = rig.run(5.0)
    assert log[:, 27].max() < 1.75
    assert log[-1, 27] == pytest.approx(1.5, abs=0.05)


@pytest.mark.parametrize("control", [MulticopterParameters(), PX4_DEFAULTS], ids=["iris", "px4"])
@pytest.mark.parametrize(
    ("environment", "limit_m"),
    [(Environment(), 0.3), (Environment(wind_ned_m_s=(5.0, 0.0, 0.0), turbulence=Turbulence.MODERATE), 0.6)],
    ids=["still", "windy"],
)
@pytest.mark.slow
def test_lissajous_path_error(
    control: MulticopterParameters, environment: Environment, limit_m: float
) -> None:
    """100 x 100 m curve, streamed position, velocity and acceleration, 5 m/s at its fastest."""
    phase = np.linspace(0.0, 2.0 * np.pi, 4001)
    speed = np.hypot(100.0 * np.cos(2.0 * phase), 150.0 * np.cos(3.0 * phase)).max()
    w = 5.0 / speed
    rig = Rig(height_m=20.0, environment=environment, control=control)
    task = OffboardTask()
    rig.fly(task)
    errors = []
    for k in range(int(100.0 * 50)):
        t = k * 0.02
        # the curve is begun from rest, as a mission begins it: five seconds to full speed
        rate = w * min(1.0, t / 5.0)
        speeding_up = w / 5.0 if t < 5.0 else 0.0
        u = 0.5 * rate * t if t < 5.0 else w * (t - 2.5)
        sn, cn = math.sin(2.0 * u), math.cos(2.0 * u)
        se, ce = math.sin(3.0 * u), math.cos(3.0 * u)
        position = np.array([50.0 * sn, 50.0 * se, -20.0])
        slope = np.array([100.0 * cn, 150.0 * ce, 0.0])
        velocity = rate * slope
        acceleration = speeding_up * slope - rate * rate * np.array([200.0 * sn, 450.0 * se, 0.0])
        task.set_trajectory(position, velocity, acceleration, 0.0)
        for _ in range(rig.slow_steps):
            rig.step()
        errors.append(rig.nav[nav_layout.POS_NED_M] - position)
    rms = math.sqrt(np.mean(np.sum(np.square(errors), axis=1)))
    assert rms < limit_m


def test_drag_compensation_halves_the_error_in_a_gale() -> None:
    windy = Environment(wind_ned_m_s=(10.0, 0.0, 0.0))

    def error(cutoff_hz: float) -> float:
        control = replace(PX4_DEFAULTS, drag_compensation_cutoff_hz=cutoff_hz)
        rig = Rig(height_m=20.0, environment=windy, control=control)
        task = OffboardTask()
        task.set_trajectory((0.0, 0.0, -20.0), yaw_rad=0.0)
        rig.fly(task)
        return float(np.abs(positions(rig.run(12.0))[100:, 0]).mean())

    assert error(0.8) < 0.6 * error(0.0)


def test_without_a_wanted_velocity_drag_is_left_to_stop_the_vehicle() -> None:
    rig, task = hovering()
    task.set_trajectory(velocity_ned_m_s=(8.0, 0.0, 0.0), yaw_rad=0.0)
    rig.run(6.0)
    task.set_trajectory(
        velocity_ned_m_s=(math.nan, math.nan, 0.0), acceleration_ned_m_s2=(0.0, 0.0, math.nan), yaw_rad=0.0
    )
    log = rig.run(12.0)
    assert math.degrees(tilts(log)[100:].max()) < 1.5
    assert np.hypot(*velocities(log)[-1, :2]) < 2.0


def test_hover_thrust_is_learnt_from_a_wrong_start() -> None:
    for start in (0.25, 0.7):
        rig, _ = hovering(control=replace(MulticopterParameters(), hover_thrust=start))
        log = rig.run(15.0)
        assert rig.controller.hover_thrust == pytest.approx(rig.controller.thrust, abs=0.01)
        assert abs(positions(log)[-1, 2] + 20.0) < 0.1


def test_level_switches_do_not_jerk() -> None:
    rig, task = hovering()
    task.set_trajectory(velocity_ned_m_s=(6.0, 0.0, 0.0), yaw_rad=0.0)
    rig.run(4.0)
    q = np.zeros(4)
    quaternion_from_euler(0.0, -0.2, 0.0, q)
    task.set_attitude(q, rig.controller.hover_thrust * 1.05)
    rig.run(1.0)
    before_q, before_thrust = rig.controller.attitude_setpoint.copy(), rig.controller.thrust
    task.set_trajectory(velocity_ned_m_s=(0.0, 0.0, 0.0), yaw_rad=0.0)
    rig.step()
    angle = 2.0 * math.acos(min(1.0, abs(float(before_q @ rig.controller.attitude_setpoint))))
    assert math.degrees(angle) < 3.0
    assert rig.controller.thrust == pytest.approx(before_thrust, abs=0.03)


@settings(max_examples=25, deadline=None)
@given(
    position=st.tuples(*[st.floats(-500.0, 500.0)] * 3),
    velocity=st.tuples(*[st.floats(-50.0, 50.0)] * 3),
    acceleration=st.tuples(*[st.floats(-30.0, 30.0)] * 3),
    yaw=st.floats(-10.0, 10.0),
)
@pytest.mark.slow
def test_tilt_and_speed_limits_hold(
    position: tuple[float, float, float],
    velocity: tuple[float, float, float],
    acceleration: tuple[float, float, float],
    yaw: float,
) -> None:
    rig, task = hovering()
    task.set_trajectory(position, velocity, acceleration, yaw)
    for _ in range(40):
        rig.step()
        down = body_z_of(rig.controller.attitude_setpoint)[2]
        assert down >= math.cos(rig.controller.parameters.tilt_max_rad) - 1e-6
        v = rig.controller.velocity_setpoint_ned_m_s
        p = rig.controller.parameters
        assert math.hypot(v[0], v[1]) <= p.speed_xy_max_m_s + 1e-6
        assert -p.speed_up_max_m_s - 1e-9 <= v[2] <= p.speed_down_max_m_s + 1e-9
        assert (np.abs(rig.controller.rate_setpoint_frd_rad_s) <= [3.84, 3.84, 3.5]).all()


bad_floats = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True), st.just(math.nan), st.floats(-5.0, 5.0)
)


@settings(max_examples=200, deadline=None)
@given(
    setpoint=st.lists(bad_floats, min_size=19, max_size=19),
    level=st.sampled_from([0.0, 1.0, 2.0, 3.0, 4.0, math.nan]),
    nav_nan=st.lists(st.integers(0, NAV_SIZE - 1), max_size=6),
)
def test_no_input_makes_a_motor_command_unsafe(
    setpoint: list[float], level: float, nav_nan: list[int]
) -> None:
    nav = np.zeros(NAV_SIZE)
    nav[nav_layout.Q] = 1.0
    nav[nav_layout.FORCE + 2] = -9.81
    controller = MulticopterController(physics_rate_hz=250.0, nav=nav)
    nav[nav_nan] = math.nan
    controller.setpoint[:19] = setpoint
    controller.setpoint[sp.LEVEL] = level
    for _ in range(10):
        controller.step()
        assert np.isfinite(controller.actuators).all()
        assert (controller.actuators >= 0.0).all()
        assert (controller.actuators <= 1.0).all()
        assert (controller.actuators[4:] == 0.0).all()
    # and afterwards it flies on: nothing of the bad input is left in its state
    nav[:] = 0.0
    nav[nav_layout.Q] = 1.0
    nav[nav_layout.FORCE + 2] = -9.81
    controller.setpoint[:] = math.nan
    controller.setpoint[sp.VEL_NED_M_S] = 0.0
    controller.setpoint[sp.LEVEL] = sp.TRAJECTORY
    for _ in range(500):
        controller.step()
    assert (controller.actuators[:4] > 0.3).all()
    assert np.ptp(controller.actuators[:4]) < 0.2


def test_off_stops_and_idle_idles() -> None:
    nav = np.zeros(NAV_SIZE)
    nav[nav_layout.Q] = 1.0
    controller = MulticopterController(physics_rate_hz=250.0, nav=nav)
    controller.step()
    assert (controller.actuators == 0.0).all()
    controller.setpoint[sp.LEVEL] = sp.IDLE
    controller.step()
    assert controller.actuators[:4] == pytest.approx(np.full(4, controller.parameters.motor_idle))


def test_gains_can_be_replaced_in_flight() -> None:
    rig, _ = hovering()
    rig.controller.set_parameters(PX4_DEFAULTS)
    log = rig.run(3.0)
    assert np.abs(velocities(log)).max() < 0.2
    rig.controller.change(tilt_max_rad=0.3)
    assert rig.controller.parameters.tilt_max_rad == 0.3


def test_motor_failure_of_authority_does_not_wind_up() -> None:
    rig, _ = hovering()
    rig.vehicle.set_motor_effectiveness(0, 0.85)
    log = rig.run(6.0)
    assert np.abs(positions(log) - [0.0, 0.0, -20.0]).max() < 1.0


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"tilt_max_rad": 2.0}, "tilt_max_rad = 2.0"),
        ({"vel_xy_p_1_s": -1.0}, "vel_xy_p_1_s -1"),
        ({"hover_thrust": math.nan}, "hover_thrust nan"),
        ({"thrust_min": 0.9, "thrust_max": 0.5}, "thrust_min = 0.9"),
        ({"thrust_model_factor": 1.5}, "thrust_model_factor 1.5"),
    ],
)
def test_parameters_name_what_is_wrong(fields: dict[str, float], text: str) -> None:
    with pytest.raises(ValueError, match=text):
        MulticopterParameters(**fields)


def test_construction_refuses_a_wrong_rate_and_a_wrong_state() -> None:
    with pytest.raises(ValueError, match="physics_rate_hz = 10"):
        MulticopterController(physics_rate_hz=10.0, nav=np.zeros(NAV_SIZE))
    with pytest.raises(ValueError, match="shape"):
        MulticopterController(physics_rate_hz=250.0, nav=np.zeros(3))
