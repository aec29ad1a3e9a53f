"""Refusals of the firmwares, with their texts (docs/firmware/ardupilot.md and px4.md, "Refusals").

Each was read in the firmware's source; those of ArduCopter and ArduPlane were also seen on the wire.
"""

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.commander.pilot import lifts
from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.mission_plan import MissionItem
from flightsim.airframe import AirframeKind
from tests.commander.rig import Rig

HOME = MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, x=47.39774, y=8.54559, z=489.0)
TAKEOFF = MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, frame=3, z=10.0)
WAYPOINT = MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, frame=3, x=47.398, y=8.5456, z=10.0)
DELAY = MissionItem(command=mavlink.MAV_CMD_NAV_DELAY, frame=3, param1=1.0)
SPEED = MissionItem(command=mavlink.MAV_CMD_DO_CHANGE_SPEED, frame=2, param2=5.0)
FAILED_AUTO = "Mode change to AUTO failed: init failed"


def texts_of(rig: Rig) -> list[str]:
    """The texts of a request that was just made."""
    rig.tick()
    return rig.texts()


def armed_copter(*, flying: bool = False, **parameters: float) -> Rig:
    rig = Rig("ardupilot", **parameters)
    assert rig.commander.set_mode(FlightMode.GUIDED).accepted
    if flying:
        rig.put_in_air()
    else:
        assert rig.commander.arm().accepted
        rig.tick()
    rig.events.clear()
    return rig


@pytest.mark.parametrize(
    ("items", "current", "texts"),
    [
        ((), 0, [FAILED_AUTO]),
        ((HOME, WAYPOINT, WAYPOINT), 0, ["Auto: Missing Takeoff Cmd", FAILED_AUTO]),
        ((HOME, TAKEOFF, WAYPOINT), 2, ["Auto: Missing Takeoff Cmd", FAILED_AUTO]),
        ((HOME, TAKEOFF, WAYPOINT), 0, []),
        ((HOME, SPEED, TAKEOFF), 0, []),
        ((HOME, DELAY, TAKEOFF), 0, []),
    ],
)
def test_arducopter_auto_armed_on_the_ground(
    items: tuple[MissionItem, ...], current: int, texts: list[str]
) -> None:
    rig = armed_copter()
    rig.missions.replace(items, 1)
    rig.missions.current = current
    verdict = rig.commander.set_mode(FlightMode.MISSION)
    assert verdict.accepted is not texts
    assert verdict.result is (Result.FAILED if texts else Result.ACCEPTED)
    assert texts_of(rig) == texts
    assert (rig.commander.mode is FlightMode.GUIDED) is bool(texts)


def test_arducopter_mission_start_is_a_mode_change() -> None:
    rig = armed_copter()
    rig.missions.replace((HOME, WAYPOINT), 1)
    assert rig.commander.guidance.start_mission().result is Result.FAILED
    rig.run(3.0)
    assert rig.height_m == 0.0


def test_arducopter_auto_in_flight_and_disarmed_needs_no_takeoff() -> None:
    rig = armed_copter(flying=True)
    rig.missions.replace((HOME, WAYPOINT), 1)
    assert rig.commander.set_mode(FlightMode.MISSION).accepted
    on_ground = Rig("ardupilot")
    on_ground.missions.replace((HOME, WAYPOINT), 1)
    assert on_ground.commander.set_mode(FlightMode.MISSION).accepted


def test_a_command_of_the_mode_that_is_flown_is_accepted() -> None:
    rig = armed_copter(flying=True)
    rig.missions.replace((HOME, TAKEOFF, WAYPOINT), 1)
    assert rig.commander.set_mode(FlightMode.MISSION).accepted
    rig.missions.replace((), 0)
    assert rig.commander.set_mode(FlightMode.MISSION).accepted


@pytest.mark.parametrize(
    ("mode", "text"),
    [
        (FlightMode.HOLD, "Mode change to LOITER failed: requires position"),
        (FlightMode.RETURN, "Mode change to RTL failed: requires position"),
        (FlightMode.POSHOLD, "Mode change to POSHOLD failed: requires position"),
        (FlightMode.CIRCLE, "Mode change to CIRCLE failed: requires position"),
        (FlightMode.BRAKE, "Mode change to BRAKE failed: requires position"),
        (FlightMode.ALTITUDE, None),
        (FlightMode.LAND, None),
        (FlightMode.STABILIZED, None),
    ],
)
def test_arducopter_without_a_position(mode: FlightMode, text: str | None) -> None:
    rig = armed_copter(flying=True, FS_EKF_ACTION=0)
    rig.commander.set_mode(FlightMode.ALTITUDE)
    rig.judgement.position_valid = False
    rig.run(0.3)
    rig.events.clear()
    assert rig.commander.set_mode(mode).accepted is (text is None)
    assert [t for t in texts_of(rig) if "Mode change" in t] == ([] if text is None else [text])


def test_arducopter_says_how_to_enable_follow() -> None:
    rig = armed_copter(flying=True)
    assert not rig.commander.set_mode(FlightMode.FOLLOW).accepted
    assert texts_of(rig) == ["Set FOLL_ENABLE = 1", "Mode change to FOLLOW failed: init failed"]


@pytest.mark.parametrize(("throttle", "accepted"), [(-1.0, True), (-0.6, True), (-0.3, False), (0.4, False)])
def test_arducopter_does_not_leap_off_the_ground(throttle: float, accepted: bool) -> None:
    rig = armed_copter()
    for _ in range(10):
        rig.commander.pilot.move(roll=0.0, pitch=0.0, throttle=throttle, yaw=0.0, time_us=rig.time_us)
        rig.tick()
    rig.events.clear()
    assert rig.commander.set_mode(FlightMode.STABILIZED).accepted is accepted
    assert texts_of(rig) == ([] if accepted else ["Mode change to STABILIZE failed: throttle too high"])


def test_a_stick_lifts_from_half_the_thrust_of_a_hover_on() -> None:
    assert not lifts(-0.52, 0.5) and lifts(-0.48, 0.5)  # a linear stick
    assert not lifts(-0.52, 0.39) and lifts(-0.4, 0.39)
    assert not lifts(-1.0, 0.1)


@pytest.mark.parametrize(
    ("kind", "values", "text"),
    [
        (AirframeKind.MULTICOPTER, {"ANGLE_MAX": 500.0}, "Arm: Check ANGLE_MAX"),
        (AirframeKind.MULTICOPTER, {"PILOT_SPEED_UP": 0.0}, "Arm: Check PILOT_SPEED_UP"),
        (AirframeKind.MULTICOPTER, {"FS_THR_VALUE": 900.0}, "Arm: Check FS_THR_VALUE"),
        (AirframeKind.MULTICOPTER, {"ACRO_BAL_ROLL": 9.0}, "Arm: Check ACRO_BAL_ROLL/PITCH"),
        (AirframeKind.FIXED_WING, {"ROLL_LIMIT_DEG": 2.0}, "Arm: ROLL_LIMIT_DEG too small (2.0)"),
        (AirframeKind.FIXED_WING, {"PTCH_LIM_MAX_DEG": 2.0}, "Arm: PTCH_LIM_MAX_DEG too small (2.0)"),
        (AirframeKind.FIXED_WING, {"PTCH_LIM_MIN_DEG": -2.0}, "Arm: PTCH_LIM_MIN_DEG too large (-2.0)"),
        (AirframeKind.FIXED_WING, {"AIRSPEED_MIN": 3.0}, "Arm: AIRSPEED_MIN too low (3 < 5)"),
        (AirframeKind.FIXED_WING, {"FS_LONG_TIMEOUT": 1.0}, "Arm: FS_LONG_TIMEOUT < FS_SHORT_TIMEOUT"),
    ],
)
def test_ardupilot_does_not_arm_with_such_values(
    kind: AirframeKind, values: dict[str, float], text: str
) -> None:
    rig = Rig("ardupilot", kind=kind)
    rig.commander.set_mode(FlightMode.STABILIZED)
    for name, value in values.items():
        rig.store.set(name, value, check_range=False)
    rig.commander.parameters = rig.flavour.commander_parameters(rig.store)
    assert rig.commander.arm().result is Result.FAILED
    assert text in texts_of(rig)
    assert rig.commander.arm(forced=True).accepted


def test_px4_takes_a_landing_in_any_state() -> None:
    """It then descends."""
    rig = Rig("px4")
    rig.put_in_air()
    rig.judgement.position_valid = rig.judgement.altitude_valid = False
    rig.run(0.3)
    assert rig.commander.set_mode(FlightMode.LAND).accepted
    assert not rig.commander.set_mode(FlightMode.RETURN).accepted


@pytest.mark.parametrize(
    ("mode", "sticks", "text"),
    [
        (FlightMode.GUIDED, {"throttle": 0.4}, "Arm: Throttle (RC3) is not neutral"),
        (FlightMode.GUIDED, {"roll": 0.4}, "Arm: Roll (RC1) is not neutral"),
        (FlightMode.ALTITUDE, {"throttle": 0.0}, "Arm: Throttle (RC3) is not neutral"),
        (FlightMode.ALTITUDE, {"throttle": 0.4}, "Arm: Throttle too high"),
        (FlightMode.HOLD, {"throttle": 0.4}, "Arm: Throttle too high"),
        (FlightMode.STABILIZED, {"throttle": -0.8}, "Arm: Throttle too high"),
        (FlightMode.STABILIZED, {}, None),
    ],
)
def test_arducopter_arms_with_the_sticks_at_rest(
    mode: FlightMode, sticks: dict[str, float], text: str | None
) -> None:
    rig = Rig("ardupilot")
    rig.commander.set_mode(mode)
    for _ in range(10):
        rig.commander.pilot.move(
            **{"roll": 0.0, "pitch": 0.0, "yaw": 0.0, "throttle": -1.0, **sticks}, time_us=rig.time_us
        )
        rig.tick()
    rig.events.clear()
    assert rig.commander.arm().accepted is (text is None)
    assert [t for t in texts_of(rig) if t.startswith("Arm:")] == ([] if text is None else [text])
