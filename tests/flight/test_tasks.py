"""Every flight task in a small closed loop on the iris model."""

import math

import numpy as np
import pytest

from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.context import TouchedDown
from autopilot_bridge.flight.heading import Turn
from autopilot_bridge.flight.multicopter import (
    BrakeTask,
    FlightParameters,
    GotoTask,
    GuidedTask,
    HoldTask,
    IdleTask,
    LandedState,
    LandTask,
    ManualInput,
    ManualMode,
    ManualTask,
    OffboardTask,
    OrbitTask,
    OrbitYaw,
    RepositionTask,
    ReturnTask,
    TakeoffTask,
    TaskStatus,
)
from autopilot_bridge.flight.multicopter.return_home import return_height
from autopilot_bridge.flight.multicopter.yaw import YawSteering
from autopilot_bridge.navigation import layout as nav_layout
from flightsim.foundation.rotations import quaternion_from_euler
from tests.flight.rig import Rig, positions, tilts, velocities


def flying(task: object, height_m: float = 10.0, **fields: object) -> Rig:
    rig = Rig(height_m=height_m, **fields)
    rig.fly(task)
    return rig


def test_idle_turns_motors_only_when_armed() -> None:
    rig = Rig()
    rig.fly(IdleTask())
    rig.run(0.1)
    assert (rig.controller.actuators[:4] > 0.0).all()
    rig.ctx.armed = False
    rig.run(0.1)
    assert (rig.controller.actuators == 0.0).all()


def test_hold_on_the_ground_stays_there() -> None:
    rig = Rig()
    rig.fly(HoldTask())
    log = rig.run(3.0)
    assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE
    assert np.abs(positions(log) - positions(log)[0]).max() < 0.02


def test_hold_brakes_within_limits_and_stays() -> None:
    rig = flying(OffboardTask())
    task = rig.task
    assert isinstance(task, OffboardTask)
    task.set_trajectory(velocity_ned_m_s=(6.0, 0.0, 0.0), yaw_rad=0.0)
    rig.run(5.0)
    rig.fly(HoldTask())
    braking = rig.run(6.0)
    held = positions(rig.run(5.0))
    assert velocities(braking)[:, 0].min() > -0.5
    assert np.ptp(held, axis=0).max() < 0.15


def test_brake_is_done_when_stopped() -> None:
    rig = flying(OffboardTask())
    task = rig.task
    assert isinstance(task, OffboardTask)
    task.set_trajectory(velocity_ned_m_s=(4.0, 0.0, 0.0))
    rig.run(4.0)
    brake = BrakeTask()
    rig.fly(brake)
    assert brake.update(rig.ctx) is TaskStatus.RUNNING
    log = rig.run(5.0)
    assert brake.update(rig.ctx) is TaskStatus.DONE
    assert np.linalg.norm(velocities(log)[-1]) < 0.1


def test_takeoff_reaches_its_height_smoothly() -> None:
    rig = Rig()
    task = TakeoffTask(5.0)
    rig.fly(task)
    log = rig.run(11.0)
    height = -positions(log)[:, 2]
    assert task.update(rig.ctx) is TaskStatus.DONE
    assert height[-1] == pytest.approx(5.0, abs=0.2)
    assert height.max() < 5.4
    assert np.abs(positions(log)[:, 0:2]).max() < 0.1
    assert -velocities(log)[:, 2].min() < 1.9
    assert LandedState.TAKEOFF in rig.landed_log
    assert rig.landed_log[0] == LandedState.ON_GROUND
    assert rig.landed_log[-1] == LandedState.IN_AIR


def test_takeoff_does_nothing_while_disarmed() -> None:
    rig = Rig()
    rig.ctx.armed = False
    rig.fly(TakeoffTask(5.0))
    rig.run(3.0)
    assert (rig.controller.actuators == 0.0).all()


def test_land_touches_down_gently_and_rests() -> None:
    rig = flying(LandTask())
    log = rig.run(22.0)
    touch = int(np.argmax(-positions(log)[:, 2] < 0.12))
    assert velocities(log)[touch - 2, 2] < 1.0
    assert rig.ctx.on_ground
    assert TouchedDown() in rig.ctx.events
    assert rig.landed_log.index(LandedState.ON_GROUND) * 0.02 < touch * 0.02 + 4.0
    assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE
    assert LandedState.LANDING in rig.landed_log


@pytest.mark.parametrize("velocity_known", [True, False])
def test_land_without_a_position_descends_level(velocity_known: bool) -> None:
    rig = flying(LandTask(), height_m=6.0)
    health = rig.ctx.health
    assert health is not None
    health.position_horizontal_absolute = health.position_horizontal_relative = False
    health.velocity_horizontal = velocity_known
    log = rig.run(16.0)
    assert rig.ctx.on_ground
    assert np.degrees(tilts(log).max()) < 5.0


def test_a_landing_is_kept_whatever_the_land_detector_thinks_later() -> None:
    rig = flying(LandTask(), height_m=2.0)
    rig.run(10.0)
    assert rig.ctx.on_ground and rig.task is not None
    for state in (LandedState.LANDING, LandedState.IN_AIR):
        rig.ctx.landed_state = state
        assert rig.task.update(rig.ctx) is TaskStatus.DONE
        assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE
    assert rig.ctx.events.count(TouchedDown()) == 1


def test_ground_contact_takes_the_thrust_away() -> None:
    rig = flying(LandTask(), height_m=2.0)
    rig.run(0.5)
    assert rig.task is not None
    assert rig.controller.setpoint[sp.ACC + 2] == 0.0
    rig.ctx.ground_contact = True
    downwards = []
    for _ in range(150):
        rig.task.update(rig.ctx)
        downwards.append(float(rig.controller.setpoint[sp.ACC + 2]))
    assert np.all(np.diff(downwards) > 0.0) and max(np.diff(downwards)) < 0.1
    assert downwards[-1] > 9.81  # more than gravity: nothing is left
    rig.ctx.ground_contact = False
    rig.task.update(rig.ctx)
    assert rig.controller.setpoint[sp.ACC + 2] == 0.0


def test_goto_settles_within_nine_seconds() -> None:
    rig = flying(GotoTask(np.array([15.0, 0.0, -10.0])))
    log = rig.run(9.0)
    error = np.linalg.norm(positions(log) - [15.0, 0.0, -10.0], axis=1)
    assert error[-1] < 0.2
    assert (error[-100:] < 0.6).all()
    assert positions(log)[:, 0].max() < 15.3
    assert math.isclose(rig.nav[nav_layout.YAW], 0.0, abs_tol=0.1)


def test_leg_of_thirty_metres_with_arducopter_limits_takes_eight_seconds() -> None:
    limits = FlightParameters(cruise_speed_m_s=10.0, acceleration_m_s2=2.5, jerk_m_s3=5.0)
    rig = flying(GotoTask(np.array([0.0, 30.0, -10.0])), parameters=limits)
    log = rig.run(10.0)
    arrival = np.argmax(np.abs(positions(log)[:, 1] - 30.0) < 0.7) * 0.02
    assert 6.5 < arrival < 8.5
    assert positions(log)[:, 1].max() < 30.7
    assert rig.nav[nav_layout.YAW] == pytest.approx(math.pi / 2.0, abs=0.1)  # the nose turned to the target


def test_reposition_keeps_what_is_nan_and_takes_off_when_commanded_up() -> None:
    rig = Rig()
    task = RepositionTask(np.array([math.nan, math.nan, -4.0]))
    rig.fly(task)
    rig.run(11.0)
    assert rig.nav[nav_layout.POS + 2] == pytest.approx(-4.0, abs=0.3)
    assert np.abs(rig.nav[nav_layout.POS : nav_layout.POS + 2]).max() < 0.2
    task.set_target(rig.ctx, np.array([5.0, 0.0, math.nan]))
    rig.run(8.0)
    assert rig.nav[nav_layout.POS_NED_M] == pytest.approx([5.0, 0.0, -4.0], abs=0.3)


@pytest.mark.parametrize("loiters_high", [False, True])
@pytest.mark.sampled(1)
def test_return_climbs_flies_home_and_lands(loiters_high: bool) -> None:
    limits = FlightParameters(
        return_altitude_m=12.0,
        return_descend_altitude_m=6.0,
        return_loiter_time_s=2.0,
        return_loiters_high=loiters_high,
    )
    rig = flying(GotoTask(np.array([20.0, 10.0, -5.0])), height_m=5.0, parameters=limits)
    rig.run(10.0)
    rig.fly(ReturnTask())
    log = rig.run(50.0)
    track = positions(log)
    far = np.linalg.norm(track[:, 0:2], axis=1) > 18.0
    assert -track[:, 2].max() < 0.2
    assert -track[:, 2].min() == pytest.approx(12.0, abs=0.5)
    leaving = np.argmax(~far)
    assert track[leaving, 2] < -11.0  # climbed before it left
    assert rig.ctx.on_ground
    assert np.linalg.norm(track[-1, 0:2]) < 0.5


@pytest.mark.parametrize("stops", [False, True])
def test_a_return_goes_on_at_the_height_of_the_landing_or_stops_there(stops: bool) -> None:
    """PX4 1.16.1 passes RTL_DESCEND_ALT at 1.0 m/s, without a wait; ArduPilot stops."""
    limits = FlightParameters(return_altitude_m=9.0, return_descend_altitude_m=5.0, return_stops=stops)
    rig = flying(GotoTask(np.array([4.0, 0.0, -9.0])), height_m=9.0, parameters=limits)
    rig.run(6.0)
    rig.fly(ReturnTask())
    log = rig.run(25.0)
    near = np.abs(positions(log)[:, 2] + 5.0) < 0.5
    slowest_m_s = velocities(log)[near, 2].min()
    assert (slowest_m_s < 0.2) if stops else (slowest_m_s > 0.4), slowest_m_s


def test_return_without_home_lands_here() -> None:
    rig = flying(ReturnTask(), height_m=5.0)
    rig.ctx.home_ned_m[:] = math.nan
    rig.fly(ReturnTask())
    rig.run(16.0)
    assert rig.ctx.on_ground


def test_cone_rule() -> None:
    p = FlightParameters(return_altitude_m=30.0, return_descend_altitude_m=10.0, return_min_distance_m=50.0)
    assert return_height(100.0, 5.0, p) == 30.0
    assert return_height(20.0, 5.0, p) == pytest.approx(20.0)
    assert return_height(2.0, 5.0, p) == 10.0
    assert return_height(2.0, 40.0, p) == 40.0


def test_orbit_flies_the_circle_facing_its_centre() -> None:
    rig = flying(OrbitTask(np.array([0.0, 0.0, -10.0]), 10.0, 4.0))
    rig.run(16.0)
    log = rig.run(16.0)
    radius = np.linalg.norm(positions(log)[:, 0:2], axis=1)
    assert np.abs(radius - 10.0).max() < 0.4
    assert np.linalg.norm(velocities(log)[:, 0:2], axis=1) == pytest.approx(4.0, abs=0.4)
    bearing = np.arctan2(-positions(log)[:, 1], -positions(log)[:, 0])
    assert np.abs(np.remainder(bearing - log[:, 27] + np.pi, 2.0 * np.pi) - np.pi).max() < 0.25
    turning = np.unwrap(np.arctan2(positions(log)[:, 1], positions(log)[:, 0]))
    assert turning[-1] > turning[0]  # clockwise seen from above


def test_circle_starts_ahead_and_counts_turns() -> None:
    task = OrbitTask(None, 5.0, -3.0, yaw_behaviour=OrbitYaw.HOLD_INITIAL, turns=1.0)
    rig = flying(task)
    rig.run(0.1)
    assert task.centre_ned_m == pytest.approx([5.0, 0.0, -10.0], abs=0.3)
    rig.run(14.0)
    assert task.update(rig.ctx) is TaskStatus.DONE


def test_offboard_kinds() -> None:
    task = OffboardTask()
    rig = flying(task)
    rig.run(2.0)  # nothing received yet: holds
    assert np.linalg.norm(velocities(rig.run(0.5))[-1]) < 0.2
    task.set_trajectory(velocity_ned_m_s=(3.0, 0.0, -1.0), yaw_rate_rad_s=0.5)
    log = rig.run(5.0)
    assert velocities(log)[-1] == pytest.approx([3.0, 0.0, -1.0], abs=0.2)
    assert log[-1, 6] == pytest.approx(0.5, abs=0.05)
    q = np.zeros(4)
    quaternion_from_euler(0.15, -0.1, 1.0, q)
    task.set_attitude(q, rig.controller.hover_thrust)
    log = rig.run(3.0)
    assert log[-1, 25:28] == pytest.approx([0.15, -0.1, 1.0], abs=0.03)
    task.set_rates((0.0, 0.0, 1.0), rig.controller.hover_thrust)
    log = rig.run(2.0)
    assert log[-1, 4:7] == pytest.approx([0.0, 0.0, 1.0], abs=0.08)


def test_guided_velocity_expires_and_position_stays() -> None:
    task = GuidedTask()
    rig = flying(task)
    task.set_velocity(rig.ctx, (4.0, 0.0, 0.0))
    log = rig.run(3.0)
    assert velocities(log)[-1, 0] == pytest.approx(4.0, abs=0.3)
    log = rig.run(3.5)
    assert abs(velocities(log)[-1, 0]) < 0.3  # three seconds of time-out, then it brakes
    task.set_position(rig.ctx, (0.0, 0.0, -12.0))
    rig.run(9.0)
    assert rig.nav[nav_layout.POS_NED_M] == pytest.approx([0.0, 0.0, -12.0], abs=0.3)


def _yaws_deg(log: np.ndarray) -> np.ndarray:
    """Unwrapped headings of a log."""
    return np.degrees(np.unwrap(log[:, nav_layout.EULER_RAD][:, 2]))


@pytest.mark.parametrize(
    ("direction", "relative", "turned_deg"),
    [(0, False, 90.0), (1, False, 90.0), (-1, False, -270.0), (1, True, 90.0), (-1, True, -90.0)],
)
@pytest.mark.sampled(2)
def test_a_commanded_turn_has_its_rate_and_direction(
    direction: int, relative: bool, turned_deg: float
) -> None:
    turn = Turn(math.radians(90.0), direction=direction, rate_max_rad_s=math.radians(20.0), relative=relative)
    rig = flying(RepositionTask(np.array([0.0, 0.0, -10.0]), turn=turn))
    first = _yaws_deg(rig.run(3.0))
    rate_deg_s = (first[-1] - first[len(first) // 2]) / 1.5
    assert rate_deg_s == pytest.approx(math.copysign(20.0, turned_deg), abs=1.5)
    rest = _yaws_deg(rig.run(15.0))
    assert first[-1] - first[0] + rest[-1] - rest[0] == pytest.approx(turned_deg, abs=3.0)
    assert turn.done


def test_a_commanded_turn_never_exceeds_the_vehicle_s_rate() -> None:
    parameters = FlightParameters(yaw_rate_max_rad_s=math.radians(30.0))
    heading, turn = YawSteering(), Turn(math.radians(170.0), rate_max_rad_s=math.radians(300.0))
    for _ in range(100):
        heading.follow(turn, parameters, 0.02)
        assert heading.rate_rad_s <= math.radians(30.0) + 1e-9


def test_guided_positions_turn_at_their_yaw_rate_until_the_time_out() -> None:
    task = GuidedTask()
    rig = flying(task)
    task.set_position(rig.ctx, (0.0, 0.0, -10.0), yaw_rate_rad_s=math.radians(20.0))
    yaws = _yaws_deg(rig.run(3.0))
    assert (yaws[-1] - yaws[len(yaws) // 2]) / 1.5 == pytest.approx(20.0, abs=1.5)
    rig.run(2.0)
    yaws = _yaws_deg(rig.run(2.0))
    assert abs(yaws[-1] - yaws[0]) < 2.0  # GUID_TIMEOUT


def test_guided_attitude_thrust_is_a_climb_rate() -> None:
    task = GuidedTask()
    rig = flying(task)
    task.set_attitude(rig.ctx, (1.0, 0.0, 0.0, 0.0), 0.6)
    log = rig.run(2.9)
    expected = 0.2 * rig.ctx.parameters.climb_speed_m_s
    assert -velocities(log)[-1, 2] == pytest.approx(expected, abs=0.1)


def test_guided_position_lifts_nothing_off_the_ground() -> None:
    task = GuidedTask()
    rig = Rig()
    rig.fly(task)
    task.set_position(rig.ctx, (0.0, 0.0, -10.0))
    rig.run(3.0)
    assert -rig.nav[nav_layout.POS + 2] < 0.2


@pytest.mark.parametrize("mode", list(ManualMode))
def test_manual_modes_answer_the_sticks(mode: ManualMode) -> None:
    rig = flying(ManualTask(mode), height_m=30.0)
    rig.ctx.sticks = ManualInput(pitch=0.4, valid=True)
    log = rig.run(1.5)
    assert log[-1, 7] > 0.3  # stick forward flies forward
    assert abs(log[-1, 8]) < 0.2
    rig.ctx.sticks = ManualInput(yaw=0.5, valid=True)
    before = rig.nav[nav_layout.YAW]
    rig.run(0.6)
    assert rig.nav[nav_layout.YAW] > before + 0.03


@pytest.mark.parametrize("mode", [ManualMode.ALTITUDE, ManualMode.POSITION])
def test_manual_height_holds_climbs_and_takes_off(mode: ManualMode) -> None:
    rig = Rig()
    rig.fly(ManualTask(mode))
    rig.ctx.sticks = ManualInput(valid=True)
    rig.run(1.0)
    assert rig.controller.setpoint[sp.LEVEL] == sp.IDLE
    rig.ctx.sticks = ManualInput(throttle=0.7, valid=True)
    rig.run(7.0)
    rig.ctx.sticks = ManualInput(valid=True)
    rig.run(3.0)
    height = -positions(rig.run(4.0))[:, 2]
    assert height.min() > 1.5
    assert np.ptp(height) < 0.2


def test_position_mode_without_velocity_flies_tilt() -> None:
    rig = flying(ManualTask(ManualMode.POSITION))
    health = rig.ctx.health
    assert health is not None
    health.velocity_horizontal = False
    health.position_horizontal_absolute = health.position_horizontal_relative = False
    rig.run(0.5)
    assert rig.controller.setpoint[sp.LEVEL] == sp.ATTITUDE


def test_a_jump_of_the_position_estimate_does_not_jerk_the_vehicle() -> None:
    rig = flying(GotoTask(np.array([20.0, 0.0, -10.0])))
    rig.run(4.0)
    health = rig.ctx.health
    assert health is not None
    before = rig.controller.setpoint[sp.POS_NED_M] - rig.nav[nav_layout.POS_NED_M]
    rig.nav[nav_layout.POS_NED_M] += [3.0, -2.0, 0.0]
    health.position_resets += 1
    health.position_reset_ne_m = (3.0, -2.0)
    assert rig.task is not None
    rig.task.update(rig.ctx)
    after = rig.controller.setpoint[sp.POS_NED_M] - rig.nav[nav_layout.POS_NED_M]
    assert after == pytest.approx(before, abs=0.15)


def test_filter_position_lost_and_found() -> None:
    rig = flying(HoldTask())
    rig.run(1.0)
    health = rig.ctx.health
    assert health is not None
    health.position_horizontal_absolute = health.position_horizontal_relative = False
    rig.run(2.0)
    assert np.isnan(rig.controller.setpoint[sp.POS_HORIZONTAL]).all()
    health.position_horizontal_absolute = True
    log = rig.run(2.0)
    assert np.isfinite(rig.controller.setpoint[sp.POS_NED_M]).all()
    assert np.linalg.norm(velocities(log), axis=1).max() < 0.5
