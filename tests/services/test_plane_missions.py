"""Missions of aircraft: which ones PX4 takes for flyable, ArduPlane's capacity; texts of flights."""

import math

import pytest

from autopilot_bridge.commander import events
from autopilot_bridge.commander.events import DisarmReason, FailsafeAction, FailsafeKind
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.verdict import Reason
from autopilot_bridge.firmware.ardupilot import texts as ardupilot_texts
from autopilot_bridge.firmware.ardupilot.mission_rules import ARDUPLANE_MISSION_POLICY
from autopilot_bridge.firmware.px4 import texts as px4_texts
from autopilot_bridge.firmware.px4.mission_rules import PX4_PLANE_MISSION_POLICY
from autopilot_bridge.firmware.px4.plane.parameters import PX4_PLANE_PARAMETERS
from autopilot_bridge.mission_feasibility.ardupilot import (
    COPTER_PARAMETERS,
    PLANE_PARAMETERS,
    copter_problems,
    plane_problems,
)
from autopilot_bridge.mission_feasibility.px4 import Px4MissionRules, mission_problems
from autopilot_bridge.mission_plan import MissionItem, MissionType
from autopilot_bridge.parameters import ParameterStore
from autopilot_bridge.services.plans.protocol import MissionService, new_stores
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from tests.services.mission_rig import HOME, Recorder

TAKEOFF, WAYPOINT, LAND, LOITER_TO_ALT, LAND_START = 22, 16, 21, 31, 189
FRAME = LocalFrame(HOME)
RULES = Px4MissionRules(fixed_wing=True, required=2)
LARGEST_SLOPE_RAD = math.radians(5.1)  # FW_LND_ANG and a tenth of a degree


def item(command: int, north_m: float = 0.0, east_m: float = 0.0, z: float = 50.0, **fields) -> MissionItem:
    lat, lon, _ = FRAME.geodetic_from_ned(north_m, east_m, 0.0)
    return MissionItem(command=command, **{"frame": 6, "x": lat, "y": lon, "z": z, **fields})


def problems(*items: MissionItem, rules: Px4MissionRules = RULES, landed: bool = True) -> tuple[str, ...]:
    return mission_problems(items, rules, home_alt_m=HOME.alt_m, landed=landed)


START = item(TAKEOFF, 200.0)
LAND_HERE = item(LAND, 0.0, 0.0, 0.0)


def test_a_shallow_approach_is_flyable_and_a_steep_one_is_not() -> None:
    distance_m = 40.0 / math.tan(LARGEST_SLOPE_RAD)
    assert problems(START, item(WAYPOINT, -distance_m - 1.0, 0.0, 40.0), LAND_HERE) == ()
    steep = problems(START, item(WAYPOINT, -0.9 * distance_m, 0.0, 40.0), LAND_HERE)
    assert steep == (
        "Mission rejected: the landing glide slope is steeper than the vehicle setting of 5.0 degrees",
    )
    gentle = Px4MissionRules(fixed_wing=True, landing_angle_rad=math.radians(10.0), required=2)
    assert problems(START, item(WAYPOINT, -0.9 * distance_m, 0.0, 40.0), LAND_HERE, rules=gentle) == ()


def test_altitudes_over_sea_level_count_from_home() -> None:
    entry = item(WAYPOINT, -500.0, 0.0, HOME.alt_m + 40.0, frame=5)
    assert problems(START, entry, LAND_HERE) == ()


def test_a_circle_is_left_along_its_tangent() -> None:
    height_m = 30.0
    way_m = height_m / math.tan(LARGEST_SLOPE_RAD)
    centre_m = math.hypot(way_m, 80.0)
    circle = {"z": height_m, "param2": 80.0}
    assert problems(START, item(LOITER_TO_ALT, -centre_m - 1.0, **circle), LAND_HERE) == ()
    assert problems(START, item(LOITER_TO_ALT, -centre_m + 5.0, **circle), LAND_HERE) != ()
    assert problems(START, item(LOITER_TO_ALT, -90.0, 0.0, 30.0, param2=100.0), LAND_HERE) == (
        "Mission rejected: the landing point must be outside the orbit radius",
    )


def test_the_approach_comes_from_above_and_from_somewhere() -> None:
    assert problems(START, item(WAYPOINT, -500.0, 0.0, -5.0), LAND_HERE) == (
        "Mission rejected: the approach waypoint must be above the landing point",
    )
    (text,) = problems(START, LAND_HERE)
    assert "unsupported landing approach entrance waypoint type" in text
    speed = MissionItem(command=178, frame=2)
    assert problems(START, speed, LAND_HERE) == ()  # an item without a place directly before it: not checked


@pytest.mark.parametrize(
    ("required", "takeoff", "landing", "accepted"),
    [
        (0, False, False, True),
        (1, False, True, False),
        (1, True, False, True),
        (2, True, False, False),
        (2, False, True, True),
        (3, True, False, False),
        (3, True, True, True),
        (4, True, False, False),
        (4, False, False, True),
        (4, True, True, True),
        (5, True, True, True),
        (5, False, False, False),  # in flight
    ],
)
def test_required_items(required: int, takeoff: bool, landing: bool, accepted: bool) -> None:
    rules = Px4MissionRules(fixed_wing=True, landing_angle_rad=0.1, required=required)
    plan = (
        *((START,) if takeoff else ()),
        item(WAYPOINT, -900.0, 0.0, 40.0),
        *((LAND_HERE,) if landing else ()),
    )
    assert (problems(*plan, rules=rules, landed=False) == ()) is accepted


def test_land_starts() -> None:
    begin = MissionItem(command=LAND_START, frame=2)
    entry = item(WAYPOINT, -900.0, 0.0, 40.0)
    assert problems(START, begin, entry, LAND_HERE) == ()
    assert "Mission rejected: more than one land start commands" in problems(
        START, begin, begin, entry, LAND_HERE
    )
    assert "Mission rejected: invalid land start" in problems(START, entry, LAND_HERE, begin)


def test_the_rules_follow_the_parameters() -> None:
    store = ParameterStore(PX4_PLANE_PARAMETERS)
    stores = new_stores()
    channel = Recorder("one")

    class Link:
        channels = (channel,)

    service = MissionService(
        PX4_PLANE_MISSION_POLICY,
        stores,
        Link(),
        lambda severity, text: None,
        home=lambda: GeodeticPosition(lat_deg=HOME.lat_deg, lon_deg=HOME.lon_deg, alt_m=HOME.alt_m),
        parameters=store,
    )
    plan = (START, item(WAYPOINT, -400.0, 0.0, 40.0), LAND_HERE)
    stores[MissionType.MISSION].replace(plan, 1)
    assert not service.mission_valid()
    store.set("FW_LND_ANG", 10.0)
    assert service.mission_valid()
    stores[MissionType.MISSION].replace(plan[:2], 2)
    assert service.problems() == ("Mission rejected: Landing waypoint/pattern required",)
    store.set("MIS_TKO_LAND_REQ", 0)
    assert service.mission_valid()


def test_a_multicopter_lands_from_anywhere_and_needs_what_its_parameter_asks_for() -> None:
    copter = Px4MissionRules(fixed_wing=False)
    assert problems(START, item(WAYPOINT), rules=copter) == ()
    assert problems(START, LAND_HERE, rules=copter) == ()
    strict = Px4MissionRules(fixed_wing=False, required=2)
    assert problems(START, item(WAYPOINT), rules=strict) == (
        "Mission rejected: Landing waypoint/pattern required",
    )
    home = item(20, 0.0, 0.0, 0.0)
    assert problems(START, item(WAYPOINT), home, rules=strict) != ()  # a return is no landing


def test_a_return_behind_the_start_of_a_landing_is_refused() -> None:
    begin, entry, back = MissionItem(command=LAND_START, frame=2), item(WAYPOINT, -900.0, 0.0, 40.0), item(20)
    assert problems(START, entry, LAND_HERE, begin, back)[0] == (
        "Mission rejected: land start item before RTL item is not possible"
    )


def test_what_arduplane_does_not_arm_with() -> None:
    begin = MissionItem(command=LAND_START, frame=2)
    usual = dict(PLANE_PARAMETERS)
    assert plane_problems((START, begin, LAND_HERE), usual) == (
        "Arm: DO_LAND_START set and RTL_AUTOLAND disabled",
    )
    assert plane_problems((START, begin, LAND_HERE), {**usual, "RTL_AUTOLAND": 2.0}) == ()
    assert plane_problems((START, begin, LAND_HERE), {**usual, "ARMING_CHECK": 0.0}) == ()
    required = {**usual, "ARMING_MIS_ITEMS": 1.0 + 8.0}
    assert plane_problems((START,), required) == ("Arm: Missing mission item: land",)
    assert plane_problems((START, LAND_HERE), required) == ()
    assert plane_problems((START,), {**required, "ARMING_CHECK": 4.0}) == ()  # without the mission's check


def test_arducopter_takes_off_first() -> None:
    usual, missing = dict(COPTER_PARAMETERS), ("Auto: Missing Takeoff Cmd",)
    speed, delay = MissionItem(command=178, frame=2), MissionItem(command=93, frame=2)
    assert copter_problems((speed, delay, START, item(WAYPOINT)), usual, landed=True) == ()
    assert copter_problems((item(WAYPOINT), START), usual, landed=True) == missing
    assert copter_problems((item(WAYPOINT),), usual, landed=False) == ()


def test_arduplane_holds_655_items() -> None:
    assert ARDUPLANE_MISSION_POLICY.capacity[MissionType.MISSION] == 655


def text_of(flavour: str, event: events.Event) -> list[str]:
    texts = {"px4": px4_texts, "ardupilot": ardupilot_texts}[flavour]
    return [notice.text for notice in texts.plane_notices(event)]


T = {"time_us": 0}


@pytest.mark.parametrize(
    ("event", "text"),
    [
        (events.Armed(**T), "Throttle armed"),
        (
            events.LaunchDetected(**T, acceleration_m_s2=0.0, delay_s=0.2),
            "Armed AUTO, xaccel = 0.0 m/s/s, waiting 0.2 sec",
        ),
        (
            events.TakeoffStarted(**T, ground_speed_m_s=0.0, height_m=50.0, heading_deg=353.1),
            "Triggered AUTO. GPS speed = 0.0",
        ),
        (events.MissionItemReached(**T, index=2, distance_m=51.2), "Reached waypoint #2 dist 51m"),
        (events.MissionFinished(**T), "Mission complete, changing mode to RTL"),
        (events.LandingApproachStarted(**T, height_m=32.53), "Landing approach start at 32.5m"),
        (
            events.FlareStarted(**T, height_m=4.46, sink_m_s=1.531, ground_speed_m_s=17.2),
            "Flare 4.5m sink=1.53 speed=17.2",
        ),
        (events.AltitudeChanged(**T, height_m=100.0), "Change alt to 100.0"),
        (events.LandingAborted(**T, height_m=30.0), "Landing aborted, climbing to 30m"),
        (events.AirspeedChanged(**T, valid=False), "Airspeed sensor 1 failure. Disabling"),
        (
            events.ArmingDenied(**T, mode=FlightMode.RETURN, reasons=(Reason.MODE_NOT_ARMABLE,)),
            "Arm: RTL mode not armable",
        ),
        (
            events.FailsafeActivated(**T, kind=FailsafeKind.MANUAL_LOST, action=FailsafeAction.CIRCLE),
            "RC Short Failsafe: switched to CIRCLE",
        ),
        (
            events.FailsafeActivated(**T, kind=FailsafeKind.MANUAL_LOST_LONG, action=FailsafeAction.RETURN),
            "RC Long Failsafe On: switched to RTL",
        ),
    ],
)
def test_what_arduplane_says(event: events.Event, text: str) -> None:
    assert text_of("ardupilot", event) == [text]


def test_arduplane_after_a_landing() -> None:
    landed = events.Disarmed(**T, reason=DisarmReason.LANDED)
    assert text_of("ardupilot", landed) == ["Throttle disarmed", "Auto disarmed"]
    assert text_of("ardupilot", events.MissionFinished(**T, landed=True)) == []
    assert text_of("ardupilot", events.MissionItemReached(**T, index=1)) == []


@pytest.mark.parametrize(
    ("event", "text"),
    [
        (events.Armed(**T), "Armed by external command"),
        (events.ModeChanged(**T, mode=FlightMode.MISSION, previous=FlightMode.HOLD), "Executing Mission"),
        (events.LaunchDetected(**T, acceleration_m_s2=1.0, delay_s=0.0), "Takeoff on runway"),
        (
            events.LaunchDetected(**T, acceleration_m_s2=50.0, delay_s=0.2),
            "Launch detected. Enabling motors in 0.2s",
        ),
        (events.TakeoffDetected(**T), "Takeoff detected"),
        (events.LandingDetected(**T), "Landing detected"),
        (events.MissionFinished(**T, landed=True), "Mission finished, landed"),
        (events.Disarmed(**T, reason=DisarmReason.LANDED), "Disarmed by landing"),
        (events.FlareStarted(**T, height_m=1.5, sink_m_s=1.0, ground_speed_m_s=18.0), "Landing, flaring"),
    ],
)
def test_what_px4_says(event: events.Event, text: str) -> None:
    assert text_of("px4", event) == [text]
