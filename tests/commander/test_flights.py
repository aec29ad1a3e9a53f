"""Whole flights through the commander, each flavour in its own manner."""

import math

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.events import (
    Armed,
    Disarmed,
    DisarmReason,
    HomeSet,
    LandingDetected,
    MissionFinished,
    MissionItemReached,
    SystemStatus,
    TakeoffDetected,
)
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.navigation import layout as nav_layout
from tests.commander.rig import Rig


def test_px4_takes_off_holds_returns_lands_and_goes_back_to_the_mode_before() -> None:
    rig = Rig("px4")
    commander = rig.commander
    assert commander.system_status is SystemStatus.STANDBY
    assert commander.guidance.takeoff(down_m=-8.0, yaw_rad=math.nan).accepted
    assert commander.mode is FlightMode.TAKEOFF
    assert commander.arm().accepted
    assert commander.system_status is SystemStatus.ACTIVE
    rig.run_until(lambda: commander.mode is FlightMode.HOLD, 20.0)
    assert rig.height_m == pytest.approx(8.0, abs=0.5)
    commander.guidance.reposition(north_m=20.0, east_m=0.0, down_m=-8.0)
    rig.run(12.0)
    assert commander.guidance.return_home().accepted
    assert commander.mode is FlightMode.RETURN
    rig.run_until(lambda: not commander.armed, 120.0)
    landed, disarmed = rig.happened(LandingDetected)[0], rig.happened(Disarmed)[0]
    assert disarmed.reason is DisarmReason.LANDED
    assert (disarmed.time_us - landed.time_us) * 1e-6 == pytest.approx(2.0, abs=0.03)
    assert len(rig.happened(TakeoffDetected)) == 1
    assert commander.mode is FlightMode.HOLD  # RETURN can't be armed in


def test_ardupilot_takes_off_in_guided_only_and_stays_in_rtl_after_landing() -> None:
    rig = Rig("ardupilot")
    commander = rig.commander
    assert commander.set_mode(FlightMode.GUIDED).accepted
    assert not commander.guidance.takeoff(down_m=-10.0, yaw_rad=math.nan).accepted  # disarmed
    assert commander.arm().accepted
    assert commander.system_status is SystemStatus.STANDBY  # landed
    commander.guidance.reposition(north_m=20.0, east_m=0.0, down_m=-8.0)
    rig.run(3.0)
    assert rig.height_m == 0.0  # only a takeoff leaves the ground
    assert commander.guidance.takeoff(down_m=-10.0, yaw_rad=math.nan).accepted
    rig.run_until(lambda: rig.height_m > 9.7, 20.0)
    assert commander.mode is FlightMode.GUIDED
    assert commander.system_status is SystemStatus.ACTIVE
    assert not commander.guidance.takeoff(down_m=-15.0, yaw_rad=math.nan).accepted  # flying
    rig.run(3.0)
    commander.guidance.reposition(north_m=15.0, east_m=5.0, down_m=-12.0)
    rig.run(15.0)
    assert rig.context.nav[nav_layout.POS] == pytest.approx(15.0, abs=0.5)
    assert commander.guidance.return_home().accepted
    rig.run_until(lambda: not commander.armed, 120.0)
    assert commander.mode is FlightMode.RETURN


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_mission_from_the_ground(flavour: str) -> None:
    rig = Rig(flavour)
    commander = rig.commander
    rig.upload(
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, frame=6, z=10.0),
        rig.waypoint(10.0, 0.0),
        MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED, frame=2, param1=1.0, param2=4.0),
        rig.waypoint(10.0, 10.0),
        MissionItem(command=mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=2),
    )
    if flavour == "px4":
        assert commander.set_mode(FlightMode.MISSION).accepted
        assert commander.arm().accepted
    else:
        assert commander.set_mode(FlightMode.GUIDED).accepted
        assert commander.arm().accepted
        assert commander.set_mode(FlightMode.MISSION).accepted
        rig.run(3.0)
        assert not commander.airborne  # waits for MISSION_START
        assert commander.guidance.start_mission().accepted
    rig.run_until(lambda: commander.airborne, 10.0)
    rig.run_until(lambda: not commander.armed, 200.0)
    reached = [event.index for event in rig.happened(MissionItemReached)]
    if flavour == "px4":
        assert reached[:4] == [0, 1, 2, 3]
        assert commander.mode is FlightMode.HOLD
        assert FlightMode.RETURN in [event.mode for event in rig.events if hasattr(event, "mode")]
    else:
        assert reached[:4] == [1, 2, 3, 4]
        assert commander.mode is FlightMode.MISSION


def test_a_px4_mission_that_lands_leaves_hold_behind() -> None:
    rig = Rig("px4")
    rig.upload(
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, frame=6, z=5.0),
        rig.waypoint(5.0, 0.0, 0.0, command=mavlink.MAV_CMD_NAV_LAND),
    )
    rig.commander.set_mode(FlightMode.MISSION)
    rig.commander.arm()
    rig.run_until(lambda: rig.commander.airborne, 10.0)
    rig.run_until(lambda: not rig.commander.armed, 60.0)
    assert rig.commander.mode is rig.commander.commanded_mode is FlightMode.HOLD
    assert rig.missions.current == 0  # it begins again
    rig.commander.set_mode(FlightMode.MISSION)
    assert rig.commander.arm().accepted
    rig.run_until(lambda: rig.commander.airborne, 10.0)


def test_copter_s_mission_begins_again_at_every_disarm() -> None:
    rig = Rig("ardupilot")
    rig.upload(
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, frame=6, z=5.0),
        rig.waypoint(5.0, 0.0),
        rig.waypoint(9.0, 0.0),
    )
    rig.commander.set_mode(FlightMode.GUIDED)
    assert rig.commander.arm().accepted
    rig.missions.current = 2
    assert rig.commander.disarm().accepted
    assert rig.missions.current == 0


def test_the_end_of_a_mission_without_return_holds() -> None:
    rig = Rig("px4")
    rig.upload(MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, frame=6, z=5.0), rig.waypoint(5.0, 0.0, 5.0))
    rig.commander.set_mode(FlightMode.MISSION)
    rig.commander.arm()
    rig.run_until(lambda: rig.happened(MissionFinished), 60.0)
    assert rig.commander.airborne and rig.commander.mode is FlightMode.HOLD
    assert rig.texts()[-1] == "Mission finished, loitering"


def test_px4_reports_the_last_item_reached_whatever_it_is() -> None:
    """MAVSDK takes the mission for finished when the last item, often a change of speed, was reached."""
    rig = Rig("px4")
    speed = MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED, frame=2, param1=1.0, param2=4.0)
    rig.upload(
        MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, frame=6, z=5.0), rig.waypoint(5.0, 0.0, 5.0), speed
    )
    rig.commander.set_mode(FlightMode.MISSION)
    rig.commander.arm()
    rig.run_until(lambda: rig.happened(MissionFinished), 60.0)
    assert [event.index for event in rig.happened(MissionItemReached)] == [0, 1, 2]


def test_home_is_set_when_the_position_is_good_and_again_at_arming() -> None:
    rig = Rig("px4", start_s=0.0)
    rig.run(3.0)
    assert rig.commander.home.position is None
    rig.run(0.2)
    assert rig.commander.home.position is not None
    rig.run(3.0)
    rig.context.nav[nav_layout.POS] = 3.0
    before = len(rig.happened(HomeSet))
    assert rig.commander.arm().accepted
    rig.tick()
    assert len(rig.happened(HomeSet)) == before + 1
    assert rig.context.home_ned_m[0] == pytest.approx(3.0)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_px4_alone_sets_home_where_it_lifts_off(flavour: str) -> None:
    rig = Rig(flavour)
    if flavour == "ardupilot":
        assert rig.commander.set_mode(FlightMode.GUIDED).accepted
    assert rig.commander.arm().accepted
    rig.tick()
    rig.context.nav[nav_layout.POS] = 4.0  # down the runway
    before = len(rig.happened(HomeSet))
    assert rig.commander.guidance.takeoff(down_m=-8.0, yaw_rad=math.nan).accepted
    rig.run_until(lambda: bool(rig.happened(TakeoffDetected)), 10.0)
    assert len(rig.happened(HomeSet)) - before == (1 if flavour == "px4" else 0)
    assert rig.context.home_ned_m[0] == pytest.approx(4.0 if flavour == "px4" else 0.0, abs=0.01)


def test_a_commanded_home_stays_when_arming() -> None:
    rig = Rig("px4")
    assert rig.commander.home.command(47.4, 8.55, 500.0)
    rig.commander.arm()
    assert rig.commander.home.position is not None
    assert rig.commander.home.position.lat_deg == 47.4


@pytest.mark.parametrize(
    "place", [(95.0, 8.0, 0.0), (math.nan, 8.0, 0.0), (47.0, 8.0, math.inf), (47.0, 400.0, 0.0)]
)
def test_home_is_a_place_on_earth(place: tuple[float, float, float]) -> None:
    rig = Rig("px4")
    before = rig.commander.home.position
    assert not rig.commander.home.command(*place)
    assert rig.commander.home.position == before


@pytest.mark.parametrize(("flavour", "seconds"), [("px4", 11.0), ("ardupilot", 10.0)])
def test_an_armed_vehicle_that_stays_on_the_ground_is_disarmed(flavour: str, seconds: float) -> None:
    rig = Rig(flavour)
    if flavour == "ardupilot":
        rig.commander.set_mode(FlightMode.GUIDED)
    rig.commander.arm()
    rig.run_until(lambda: not rig.commander.armed, 20.0)
    armed, disarmed = rig.happened(Armed)[0], rig.happened(Disarmed)[0]
    assert (disarmed.time_us - armed.time_us) * 1e-6 == pytest.approx(seconds, abs=0.05)
    assert disarmed.reason is DisarmReason.PREFLIGHT_TIMEOUT


def test_pause_and_resume_a_mission() -> None:
    rig = Rig("ardupilot")
    commander = rig.commander
    rig.upload(MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, frame=6, z=10.0), rig.waypoint(100.0, 0.0))
    commander.set_mode(FlightMode.GUIDED)
    commander.arm()
    commander.guidance.start_mission()
    rig.run_until(lambda: rig.context.nav[nav_layout.POS] > 20.0, 60.0)
    assert commander.guidance.pause().accepted
    rig.run(6.0)
    stopped_m = float(rig.context.nav[nav_layout.POS])
    rig.run(2.0)
    assert rig.context.nav[nav_layout.POS] == pytest.approx(stopped_m, abs=0.05)
    assert commander.guidance.resume().accepted
    rig.run_until(lambda: rig.context.nav[nav_layout.POS] > 97.0, 60.0)
    commander.set_mode(FlightMode.BRAKE)
    assert not commander.guidance.pause().accepted


def test_termination_is_for_good() -> None:
    rig = Rig("ardupilot")
    rig.commander.set_mode(FlightMode.GUIDED)
    rig.put_in_air()
    rig.commander.terminate()
    rig.tick()
    assert not rig.commander.armed
    assert not rig.commander.arm().accepted
    assert not rig.commander.set_mode(FlightMode.GUIDED).accepted
