"""Modes, arming and failsafes of aircraft, as docs/firmware and the firmwares' documents list them."""

import math

import pytest

from autopilot_bridge.commander.events import (
    AirspeedChanged,
    FailsafeActivated,
    FailsafeKind,
    MissionFinished,
    SystemStatus,
)
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason, Result
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.context import MissionFinished as PlanFinished
from autopilot_bridge.flight.context import TaskFinished
from autopilot_bridge.flight.fixed_wing import GuidedTask, LoiterTask, MissionTask, TakeoffTask
from autopilot_bridge.flight.task import SpeedKind
from autopilot_bridge.navigation import layout as nav
from flightsim.airframe import AirframeKind
from tests.commander.rig import Rig

LEVEL = (1.0, 0.0, 0.0, 0.0)


def aircraft(flavour: str, *, start_s: float = 45.0, **parameters: float) -> Rig:
    return Rig(flavour, kind=AirframeKind.FIXED_WING, start_s=start_s, **parameters)


def flying(flavour: str, mode: FlightMode, **parameters: float) -> Rig:
    """In the air at 80 m, northbound, in a mode."""
    rig = aircraft(flavour, **parameters)
    rig.tick()
    rig.commander.set_mode(FlightMode.TAKEOFF)
    rig.put_in_air(80.0)
    rig.context.nav[nav.AIRSPEED_M_S] = rig.context.nav[nav.AIRSPEED_TRUE_M_S] = 25.0
    assert rig.commander.set_mode(mode).accepted
    rig.run(0.2)
    rig.events.clear()
    return rig


@pytest.mark.parametrize(
    ("mode", "reason"),
    [
        (FlightMode.HOLD, None),
        (FlightMode.TAKEOFF, None),
        (FlightMode.MANUAL, Reason.MANUAL_CONTROL),
        (FlightMode.ACRO, Reason.MANUAL_CONTROL),
        (FlightMode.POSITION, Reason.MANUAL_CONTROL),
        (FlightMode.MISSION, Reason.MISSION_MISSING),
        (FlightMode.RETURN, Reason.MODE_NOT_ARMABLE),
        (FlightMode.LAND, Reason.MODE_NOT_ARMABLE),
        (FlightMode.OFFBOARD, Reason.NO_SETPOINTS),
    ],
)
def test_px4_armable_modes(mode: FlightMode, reason: Reason | None) -> None:
    rig = aircraft("px4")
    assert rig.commander.set_mode(mode).accepted
    verdict = rig.commander.arm()
    assert verdict.accepted is (reason is None)
    if reason is not None:
        assert verdict.result is Result.TEMPORARILY_REJECTED and reason in verdict.reasons


@pytest.mark.parametrize(
    ("mode", "armable"),
    [
        (FlightMode.MANUAL, True),
        (FlightMode.FBWA, True),
        (FlightMode.CRUISE, True),
        (FlightMode.GUIDED, True),
        (FlightMode.TAKEOFF, True),
        (FlightMode.RETURN, False),
        (FlightMode.HOLD, True),
        (FlightMode.CIRCLE, True),
        (FlightMode.AVOID, True),
        (FlightMode.MISSION, False),
    ],
)
def test_arduplane_armable_modes(mode: FlightMode, armable: bool) -> None:
    rig = aircraft("ardupilot")
    assert rig.commander.set_mode(mode).accepted
    verdict = rig.commander.arm()
    assert verdict.accepted is armable
    assert armable or verdict.result is Result.FAILED


def test_arduplane_arms_in_auto_with_a_mission() -> None:
    rig = aircraft("ardupilot")
    rig.upload(rig.waypoint(300.0, 0.0, 60.0))
    rig.commander.set_mode(FlightMode.MISSION)
    assert rig.commander.arm().accepted
    assert isinstance(rig.commander.tasks.task, MissionTask)


def test_arduplane_boots_initialising_and_arms_with_a_position_only() -> None:
    rig = aircraft("ardupilot", start_s=0.5)
    assert rig.commander.mode is FlightMode.INITIALISING
    assert rig.commander.system_status is SystemStatus.CALIBRATING
    rig.run(1.5)
    assert rig.commander.mode is FlightMode.MANUAL
    assert rig.commander.system_status is SystemStatus.STANDBY
    assert Reason.POSITION in rig.commander.arm().reasons
    assert rig.commander.arm(forced=True).accepted  # unlike a copter in GUIDED


def test_airspeed_is_checked_before_arming_and_watched_in_flight() -> None:
    rig = aircraft("px4")
    rig.judgement.airspeed_rejected = True
    rig.run(0.2)
    assert Reason.AIRSPEED in rig.commander.arm().reasons
    rig = flying("px4", FlightMode.HOLD)
    rig.judgement.airspeed_rejected = True
    rig.run(0.3)
    assert [event.valid for event in rig.happened(AirspeedChanged)] == [False]
    assert rig.commander.mode is FlightMode.HOLD  # the flight goes on
    rig.judgement.airspeed_rejected = False
    rig.run(0.3)
    assert [event.valid for event in rig.happened(AirspeedChanged)] == [False, True]


def test_px4_takeoff_ends_circling_at_the_height_requested() -> None:
    rig = aircraft("px4")
    commander = rig.commander
    assert commander.guidance.takeoff(down_m=-60.0, yaw_rad=math.nan, north_m=200.0, east_m=10.0).accepted
    assert commander.arm().accepted
    assert isinstance(commander.tasks.task, TakeoffTask)
    rig.context.nav[nav.POS_NED_M] = (150.0, 0.0, -59.0)
    rig.tick()
    rig.context.events.append(TaskFinished("takeoff"))
    rig.tick()
    task = commander.tasks.task
    assert commander.mode is FlightMode.HOLD and isinstance(task, LoiterTask)
    assert task.centre_ned_m.tolist() == pytest.approx([200.0, 10.0, -60.0])


def test_arduplane_takeoff_stays_in_its_mode_and_is_no_command() -> None:
    rig = flying("ardupilot", FlightMode.TAKEOFF)
    rig.context.events.append(TaskFinished("takeoff"))
    rig.tick()
    assert rig.commander.mode is FlightMode.TAKEOFF
    assert not rig.commander.guidance.takeoff(down_m=-50.0, yaw_rad=math.nan).accepted


def test_px4_orbit_is_flown_in_hold() -> None:
    rig = flying("px4", FlightMode.HOLD)
    verdict = rig.commander.guidance.orbit(
        radius_m=-120.0, speed_m_s=22.0, yaw_behaviour=0, north_m=300.0, east_m=0.0, down_m=-90.0
    )
    task = rig.commander.tasks.task
    assert verdict.accepted and rig.commander.mode is FlightMode.HOLD and isinstance(task, LoiterTask)
    assert task.radius_m == -120.0 and task.centre_ned_m.tolist() == [300.0, 0.0, -90.0]


def test_an_orbit_commanded_on_the_ground_is_not_flown_after_arming() -> None:
    rig = aircraft("px4")
    assert rig.commander.guidance.orbit(
        radius_m=100.0, speed_m_s=20.0, yaw_behaviour=0, north_m=300.0, east_m=0.0, down_m=-90.0
    ).accepted
    assert rig.commander.arm().accepted
    task = rig.commander.tasks.task
    assert isinstance(task, LoiterTask) and task.centre_ned_m.tolist() != [300.0, 0.0, -90.0]


def test_arduplane_guided_requests() -> None:
    rig = flying("ardupilot", FlightMode.GUIDED)
    guidance = rig.commander.guidance
    assert guidance.change_heading(1.0, course=True, acceleration_m_s2=math.nan).accepted
    assert guidance.change_altitude(-100.0, rate_m_s=math.nan).accepted
    assert guidance.change_airspeed(28.0, acceleration_m_s2=math.nan).accepted
    rig.run(0.5)
    task = rig.commander.tasks.task
    assert isinstance(task, GuidedTask)
    assert rig.context.setpoint[sp.COURSE_RAD] == pytest.approx(1.0)
    assert rig.commander.set_mode(FlightMode.HOLD).accepted
    assert not guidance.change_heading(1.0, course=True, acceleration_m_s2=1.0).accepted
    assert guidance.reposition(north_m=100.0, east_m=0.0, down_m=-80.0, radius_m=-90.0).accepted
    assert rig.commander.mode is FlightMode.GUIDED
    rig.run(0.1)
    assert rig.context.landed_state is not None and guidance.guided().circle.radius_m == -90.0


def test_commanded_speeds() -> None:
    rig = flying("px4", FlightMode.HOLD)
    rig.commander.guidance.change_speed(17.0, kind=SpeedKind.GROUND_SPEED)  # PX4 takes any for an airspeed
    assert rig.context.fixed_wing.airspeed_trim_m_s == pytest.approx(17.0)
    rig.commander.guidance.change_speed(-1.0, kind=SpeedKind.AIRSPEED)
    assert rig.context.fixed_wing.airspeed_trim_m_s != pytest.approx(17.0)


def test_arduplane_mission_ends_in_a_return() -> None:
    rig = aircraft("ardupilot")
    rig.upload(rig.waypoint(300.0, 0.0, 60.0))
    rig.commander.set_mode(FlightMode.MISSION)
    rig.put_in_air(60.0)
    rig.context.events.append(PlanFinished())
    rig.tick()
    assert [event.landed for event in rig.happened(MissionFinished)] == [False]
    assert rig.commander.mode is FlightMode.RETURN


# a lost position


def test_px4_without_a_position_circles_down_unless_it_flies_attitudes() -> None:
    rig = flying("px4", FlightMode.HOLD)
    rig.judgement.position_valid = False
    rig.run(0.3)
    assert rig.commander.mode is FlightMode.DESCEND
    assert [event.kind for event in rig.happened(FailsafeActivated)] == [FailsafeKind.POSITION_LOST]

    rig = flying("px4", FlightMode.HOLD)
    stream = rig.commander.setpoints
    stream.offboard.set_attitude(LEVEL, 0.6)
    stream.note(rig.time_us, needs_position=False)
    assert rig.commander.set_mode(FlightMode.OFFBOARD).accepted
    rig.judgement.position_valid = False
    for _ in range(10):
        stream.note(rig.time_us, needs_position=False)
        rig.run(0.3)
    assert rig.commander.mode is FlightMode.OFFBOARD and not rig.happened(FailsafeActivated)


def test_px4_returns_while_the_position_is_poor_and_lands_when_it_is_worse() -> None:
    rig = flying("px4", FlightMode.HOLD)
    rig.judgement.position_accuracy_m = 49.0
    rig.run(0.5)
    assert rig.commander.mode is FlightMode.HOLD
    rig.judgement.position_accuracy_m = 51.0  # COM_POS_LOW_EPH
    rig.run(0.5)
    assert rig.commander.mode is FlightMode.RETURN
    rig.judgement.position_accuracy_m = 126.0  # COM_POS_FS_EPH 50, and two and a half times as much
    rig.run(0.5)
    assert rig.commander.mode is FlightMode.DESCEND


@pytest.mark.parametrize("mode", [FlightMode.GUIDED, FlightMode.HOLD, FlightMode.RETURN])
def test_arduplane_flies_on_by_dead_reckoning(mode: FlightMode) -> None:
    rig = flying("ardupilot", mode)
    rig.judgement.position_valid = False
    rig.run(20.0)
    assert rig.commander.mode is mode and rig.commander.system_status is SystemStatus.ACTIVE
    assert rig.commander.set_mode(FlightMode.GUIDED).accepted


# lost links


def test_arduplane_short_and_long_radio_failsafe() -> None:
    rig = flying("ardupilot", FlightMode.FBWA)
    pilot = rig.commander.pilot
    pilot.radio_failed_since_us = rig.time_us
    rig.run(1.2)
    assert rig.commander.mode is FlightMode.FBWA
    rig.run(0.6)  # FS_SHORT_TIMEOUT 1.5 s
    assert rig.commander.mode is FlightMode.CIRCLE
    pilot.radio_failed_since_us = None
    rig.run(0.3)
    assert rig.commander.mode is FlightMode.FBWA
    pilot.radio_failed_since_us = rig.time_us
    rig.run(5.5)  # FS_LONG_TIMEOUT
    assert rig.commander.mode is FlightMode.RETURN
    pilot.radio_failed_since_us = None
    rig.run(1.0)
    assert rig.commander.mode is FlightMode.RETURN


def test_arduplane_radio_lost_in_guided_changes_nothing_by_default() -> None:
    rig = flying("ardupilot", FlightMode.GUIDED)
    rig.commander.pilot.radio_failed_since_us = rig.time_us
    rig.run(10.0)
    assert rig.commander.mode is FlightMode.GUIDED


def test_arduplane_failsafe_on_the_ground_does_not_disarm() -> None:
    rig = aircraft("ardupilot", FS_GCS_ENABL=1, FS_LONG_ACTN=1)
    rig.commander.set_mode(FlightMode.FBWA)
    assert rig.commander.arm().accepted
    rig.commander.pilot.on_gcs(rig.time_us)
    rig.run(7.0)
    assert rig.commander.armed and rig.commander.mode is FlightMode.RETURN


@pytest.mark.parametrize("axis", [0, 1], ids=["roll", "pitch"])
@pytest.mark.parametrize("angle_deg", [65.0, -65.0, 55.0, -55.0])
def test_px4_attitude_beyond_its_limits_is_reported(axis: int, angle_deg: float) -> None:
    """60 degrees to either side (FD_FAIL_R, FD_FAIL_P)."""
    rig = flying("px4", FlightMode.HOLD)
    euler_rad = [0.0, 0.0, 0.0]
    euler_rad[axis] = math.radians(angle_deg)
    rig.context.nav[nav.EULER_RAD] = euler_rad
    rig.run(1.0)
    kinds = [event.kind for event in rig.happened(FailsafeActivated)]
    assert kinds == ([FailsafeKind.ATTITUDE_EXCESSIVE] if abs(angle_deg) > 60.0 else [])
    assert rig.commander.mode is FlightMode.HOLD  # CBRK_FLIGHTTERM: it only warns
