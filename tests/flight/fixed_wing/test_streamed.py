"""Setpoints from outside: PX4's Offboard and ArduPlane's GUIDED."""

import math

import numpy as np
import pytest

from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.fixed_wing import GuidedKind, GuidedTask, OffboardKind, OffboardTask
from autopilot_bridge.flight.task import SpeedKind
from autopilot_bridge.navigation import layout as n
from flightsim.environment import Environment
from flightsim.foundation.rotations import quaternion_from_euler
from tests.flight.fixed_wing.aircraft import Aircraft
from tests.flight.fixed_wing.kinematic import PointMass

NAN = math.nan


def angle(a: float, b: float) -> float:
    return abs(math.remainder(a - b, 2.0 * math.pi))


# Offboard


def test_before_the_first_setpoint_it_circles() -> None:
    mass = PointMass()
    task = OffboardTask()
    mass.fly(task)
    log = mass.run(60.0)
    assert np.hypot(log[-500:, 0], log[-500:, 1]).mean() == pytest.approx(80.0, rel=0.05)


def test_a_position_is_flown_to_and_circled() -> None:
    mass = PointMass(wind_ne_m_s=(4.0, 0.0))
    task = OffboardTask()
    mass.fly(task)
    for _ in range(900):
        task.set_trajectory((600.0, 200.0, -140.0))
        mass.run(0.1)
    log = np.array(mass.log[-1000:])
    assert np.hypot(log[:, 0] - 600.0, log[:, 1] - 200.0).mean() == pytest.approx(80.0, rel=0.03)
    assert log[-1, 2] == pytest.approx(-140.0, abs=0.5)


@pytest.mark.parametrize("course", [0.5, -2.5])
def test_a_velocity_is_a_course_and_a_climb_rate(course: float) -> None:
    mass = PointMass(wind_ne_m_s=(4.0, -5.0))
    task = OffboardTask()
    task.set_trajectory(velocity_ned_m_s=(10.0 * math.cos(course), 10.0 * math.sin(course), -1.5))
    mass.fly(task)
    mass.run(20.0)
    north, east = mass.velocity
    assert angle(math.atan2(east, north), course) < math.radians(1.0)
    assert mass.climb == pytest.approx(1.5, abs=0.01)


def test_position_and_velocity_are_a_path_and_its_tangent() -> None:
    mass = PointMass(wind_ne_m_s=(0.0, 6.0))
    task = OffboardTask()
    task.set_trajectory((0.0, 150.0, -110.0), (25.0, 0.0, NAN))
    mass.fly(task)
    log = mass.run(40.0)
    assert np.abs(log[-500:, 1] - 150.0).max() < 1.0
    assert log[-1, 2] == pytest.approx(-110.0, abs=0.5)
    assert log[-1, 0] > 500.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_acceleration_bends_the_path(side: float) -> None:
    mass = PointMass((0.0, 0.0, -100.0), wind_ne_m_s=(3.0, 0.0))
    task = OffboardTask()
    mass.fly(task)
    radius, speed = 150.0, 25.0
    # along a circle around (0, side * radius), the setpoint a quarter of a second ahead at most
    for _ in range(3000):
        phase = math.atan2(mass.place[1] - side * radius, mass.place[0])
        tangent = phase + side * 0.5 * math.pi
        task.set_trajectory(
            (radius * math.cos(phase), side * radius + radius * math.sin(phase), -100.0),
            (speed * math.cos(tangent), speed * math.sin(tangent), 0.0),
            (-(speed**2) / radius * math.cos(phase), -(speed**2) / radius * math.sin(phase), 0.0),
        )
        mass.run(0.02)
    log = np.array(mass.log[-1500:])
    away = np.hypot(log[:, 0], log[:, 1] - side * radius)
    assert away.mean() == pytest.approx(radius, rel=0.03)


def test_an_acceleration_alone_keeps_course_and_height() -> None:
    mass = PointMass(heading_rad=0.4)
    task = OffboardTask()
    task.set_trajectory(acceleration_ned_m_s2=(1.0, 2.0, 0.0))
    mass.fly(task)
    log = mass.run(20.0)
    assert math.atan2(log[-1, 1], log[-1, 0]) == pytest.approx(0.4, abs=0.01)
    assert log[-1, 2] == pytest.approx(-100.0, abs=0.1)


@pytest.mark.parametrize("bank_deg", [20.0, -20.0])
def test_attitude_and_throttle_fly_the_aircraft(bank_deg: float) -> None:
    rig = Aircraft(height_m=100.0)
    task = OffboardTask()
    q = np.zeros(4)
    quaternion_from_euler(math.radians(bank_deg), 0.08, 2.0, q)  # the yaw doesn't matter
    task.set_attitude(q, 0.8)
    rig.fly(task)
    log = rig.run(6.0)
    assert task.kind is OffboardKind.ATTITUDE
    assert np.degrees(log[-100:, 25]).mean() == pytest.approx(bank_deg, abs=1.0)
    assert log[-100:, 26].mean() == pytest.approx(0.08, abs=0.02)
    assert rig.controller.thrust == pytest.approx(0.8)


def test_rates_are_flown() -> None:
    rig = Aircraft(height_m=100.0)
    task = OffboardTask()
    task.set_rates((0.15, NAN, 0.0), 0.8)
    rig.fly(task)
    log = rig.run(3.0)
    assert rig.controller.setpoint[sp.LEVEL] == sp.RATES
    assert log[-50:, n.RATES_FRD_RAD_S][:, 0].mean() > 0.05
    assert log[-1, 25] > 0.15  # it rolls on


def test_offboard_rests_on_the_ground_without_power() -> None:
    rig = Aircraft()
    task = OffboardTask()
    task.set_trajectory((500.0, 0.0, -50.0))
    rig.fly(task)
    rig.run(1.0)
    assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE
    task.set_attitude((1.0, 0.0, 0.0, 0.0), 0.5)
    rig.run(1.0)
    assert rig.controller.setpoint[sp.LEVEL] == sp.FLY
    assert rig.controller.thrust == pytest.approx(0.5)


def test_offboard_without_a_position_holds_a_bank() -> None:
    mass = PointMass()
    task = OffboardTask()
    task.set_trajectory((600.0, 200.0, -140.0))
    mass.fly(task)
    health = mass.ctx.health
    assert health is not None
    health.position_horizontal_relative = health.position_horizontal_absolute = False
    log = mass.run(5.0)
    assert np.degrees(log[-1, 3]) == pytest.approx(15.0, abs=0.5)


# GUIDED


def guided(mass: PointMass) -> GuidedTask:
    task = GuidedTask()
    task.set_hold(mass.ctx)
    mass.fly(task)
    return task


def test_guided_circles_here_until_commanded_otherwise() -> None:
    mass = PointMass()
    task = guided(mass)
    mass.run(50.0)
    assert task.kind is GuidedKind.HOLD
    assert task.circle is not None and task.circle.circling
    task.set_position(mass.ctx, (500.0, 0.0, NAN), -100.0, 28.0)
    log = mass.run(70.0)
    assert task.kind is GuidedKind.POSITION
    assert np.hypot(log[-500:, 0] - 500.0, log[-500:, 1]).mean() == pytest.approx(100.0, rel=0.03)
    assert log[-1, 2] == pytest.approx(-100.0, abs=0.5)
    assert log[-1, 4] == pytest.approx(28.0, abs=0.2)
    turned = np.unwrap(np.arctan2(log[-500:, 1], log[-500:, 0] - 500.0))
    assert turned[-1] < turned[0]


@pytest.mark.parametrize("course", [False, True])
def test_a_heading_is_flown_on_and_on_with_limited_bank(course: bool) -> None:
    mass = PointMass(heading_rad=3.0, wind_ne_m_s=(6.0, 0.0))
    task = guided(mass)
    mass.run(5.0)
    task.set_heading(mass.ctx, 0.5 * math.pi, course, 1.7)
    log = mass.run(70.0)
    assert task.kind is GuidedKind.HEADING
    assert task.circle is None
    assert np.abs(log[100:, 3]).max() <= math.atan(1.7 / 9.80665) + 1e-3
    north, east = mass.velocity
    flown = math.atan2(east, north) if course else mass.heading
    assert angle(flown, 0.5 * math.pi) < math.radians(1.0)
    task.set_position(mass.ctx, (0.0, 0.0, -100.0))
    mass.run(0.02)
    assert task.kind is GuidedKind.POSITION


def test_altitude_at_once_or_crawling() -> None:
    mass = PointMass()
    task = guided(mass)
    task.set_altitude(mass.ctx, -140.0, 0.0)
    mass.run(40.0)
    assert mass.place[2] == pytest.approx(-140.0, abs=0.5)
    task.set_altitude(mass.ctx, -200.0, 5.0)
    mass.run(20.0)
    assert -140.3 > mass.place[2] > -150.0  # ArduPlane: 3 m in 20 s
    assert mass.ctx.setpoint[sp.DOWN_M] == pytest.approx(mass.place[2] - 0.1, abs=0.05)


def test_airspeed_is_reached_at_its_acceleration_and_outlasts_change_speed() -> None:
    mass = PointMass()
    task = guided(mass)
    mass.run(1.0)
    task.set_airspeed(mass.ctx, 30.0, 0.5)
    mass.run(4.0)
    assert mass.ctx.setpoint[sp.AIRSPEED_M_S] == pytest.approx(27.0, abs=0.1)
    mass.run(10.0)
    assert mass.ctx.setpoint[sp.AIRSPEED_M_S] == pytest.approx(30.0)
    task.change_speed(mass.ctx, SpeedKind.AIRSPEED, 20.0)
    mass.run(1.0)
    assert mass.ctx.setpoint[sp.AIRSPEED_M_S] == pytest.approx(30.0)
    task.set_airspeed(mass.ctx, 99.0, 0.0)
    mass.run(0.1)
    assert mass.ctx.setpoint[sp.AIRSPEED_M_S] == mass.parameters.airspeed_max_m_s


def test_every_part_of_an_attitude_has_its_own_timeout() -> None:
    mass = PointMass()
    task = guided(mass)
    task.set_attitude(mass.ctx, 0.4, 0.1, 0.9)
    mass.run(2.0)
    s = mass.ctx.setpoint
    assert task.kind is GuidedKind.ATTITUDE
    assert (s[sp.ROLL_RAD], s[sp.PITCH_RAD], s[sp.THROTTLE]) == pytest.approx((0.4, 0.1, 0.9))
    task.set_attitude(mass.ctx, 0.3, None, None)
    mass.run(2.0)
    assert s[sp.ROLL_RAD] == pytest.approx(0.3)
    assert math.isnan(s[sp.PITCH_RAD]) and math.isnan(s[sp.THROTTLE])
    mass.run(1.5)
    assert math.isnan(s[sp.ROLL_RAD])
    assert task.kind is GuidedKind.HOLD  # back to the circle


def test_guided_moves_nothing_on_the_ground() -> None:
    rig = Aircraft()
    task = GuidedTask()
    task.set_hold(rig.ctx)
    rig.fly(task)
    task.set_position(rig.ctx, (500.0, 0.0, -50.0))
    rig.run(2.0)
    assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE
    assert rig.controller.thrust == 0.0


def test_guided_flies_the_aircraft_in_wind() -> None:
    rig = Aircraft(height_m=100.0, environment=Environment(wind_ned_m_s=(0.0, 6.0, 0.0), turbulence="light"))
    task = GuidedTask()
    task.set_hold(rig.ctx)
    rig.fly(task)
    task.set_heading(rig.ctx, 0.5 * math.pi, True, 5.0)
    rig.run(15.0)
    log = rig.run(15.0)
    courses = np.arctan2(log[:, 8], log[:, 7])
    assert np.degrees(np.abs(courses - 0.5 * math.pi)).max() < 5.0
