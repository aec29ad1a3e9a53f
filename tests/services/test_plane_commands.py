"""Commands of aircraft: the plane's column of docs/firmware, and where they send the aircraft."""

import math
from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.autopilot.status import StatusReport
from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.navigation import layout as nav_layout
from tests.services.command_rig import NAN
from tests.services.plane_rig import PlaneRig

ARM, MODE, TAKEOFF, LAND, RTL = 400, 176, 22, 21, 20
CHANGE_SPEED, CHANGE_ALTITUDE, CHANGE_HEADING = 43000, 43001, 43002
LAND_START, GO_AROUND = 189, 191


def rig_of(flavour: str, state: str) -> PlaneRig:
    """ready: on the ground, disarmed, in GUIDED (ArduPlane) or Hold (PX4); flying: in the air there."""
    rig = PlaneRig(flavour)
    if state == "flying":
        rig.fly()
    elif flavour == "ardupilot":
        rig.commander.set_mode(FlightMode.GUIDED)
    rig.channel.sent.clear()
    return rig


ARDUPLANE_TABLE = [
    # command, parameters, state, acknowledgements
    (31999, (), "ready", [3]),
    (MODE, (1, 10), "ready", [0]),
    (MODE, (1, 16), "ready", [4]),
    (MODE, (1, 17), "ready", [4]),
    (MODE, (1, 26), "ready", [4]),
    (MODE, (1, 99), "ready", [4]),
    (MODE, (0, 5), "ready", [2]),
    (ARM, (1,), "ready", [0]),
    (ARM, (2,), "ready", [3]),
    (ARM, (0,), "flying", [4]),
    (ARM, (0, 21196), "flying", [0]),
    (TAKEOFF, (0, 0, 0, 0, 0, 0, 50), "ready", [4]),
    (TAKEOFF, (0, 0, 0, 0, 0, 0, 50), "flying", [4]),
    (LAND, (), "flying", [3]),
    (RTL, (), "flying", [0]),
    (mavlink.MAV_CMD_NAV_LOITER_UNLIM, (), "flying", [0]),
    (mavlink.MAV_CMD_NAV_WAYPOINT, (), "flying", [3]),
    (mavlink.MAV_CMD_DO_JUMP, (), "flying", [3]),
    (mavlink.MAV_CMD_DO_ORBIT, (), "flying", [3]),
    (mavlink.MAV_CMD_DO_REPOSITION, (-1, 1, 0, 0, 47.4, 8.5, 100), "flying", [3]),
    (mavlink.MAV_CMD_DO_CHANGE_SPEED, (0, 25, -1), "flying", [0]),
    (mavlink.MAV_CMD_DO_CHANGE_SPEED, (0, -2, 0), "flying", [0]),
    (mavlink.MAV_CMD_DO_CHANGE_SPEED, (0, 3, 0), "flying", [4]),  # below AIRSPEED_MIN
    (mavlink.MAV_CMD_DO_CHANGE_SPEED, (0, NAN, 0), "flying", [4]),
    (mavlink.MAV_CMD_CONDITION_YAW, (90, 30, 1, 0), "flying", [3]),
    (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, (0,), "flying", [3]),
    (mavlink.MAV_CMD_MISSION_START, (0, 0), "ready", [0]),
    (mavlink.MAV_CMD_MISSION_START, (1, 0), "ready", [2]),
    (mavlink.MAV_CMD_DO_SET_HOME, (1,), "ready", [0]),
    (CHANGE_SPEED, (0, 25, 0), "flying", [0]),
    (CHANGE_SPEED, (1, 25, 0), "flying", [2]),  # airspeeds only
    (CHANGE_SPEED, (0, 3, 0), "flying", [2]),
    (CHANGE_SPEED, (0, NAN, 0), "flying", [2]),
    (CHANGE_ALTITUDE, (0, 0, 0, 0, 0, 0, 120), "flying", [0]),
    (CHANGE_ALTITUDE, (0, 0, 0, 0, 0, 0, 0), "flying", [2]),
    (CHANGE_ALTITUDE, (0, 0, 0, 0, 0, 0, -1), "flying", [2]),
    (CHANGE_ALTITUDE, (0, 0, 0, 0, 0, 0, NAN), "flying", [2]),
    (CHANGE_HEADING, (1, 90, 5), "flying", [0]),
    (CHANGE_HEADING, (0, 90, NAN), "flying", [0]),
    (CHANGE_HEADING, (1, 360, 5), "flying", [2]),
    (CHANGE_HEADING, (1, -1, 5), "flying", [2]),
    (CHANGE_HEADING, (7, 90, 5), "flying", [2]),
    (LAND_START, (), "flying", [4]),
    (GO_AROUND, (), "flying", [4]),
    (mavlink.MAV_CMD_DO_AUX_FUNCTION, (4, 2), "flying", [0]),
    (mavlink.MAV_CMD_DO_AUX_FUNCTION, (4, 7), "flying", [2]),
    (mavlink.MAV_CMD_DO_AUX_FUNCTION, (9999, 2), "flying", [4]),
    (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, (0,), "ready", [4]),
    (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, (1,), "ready", [4]),
    (mavlink.MAV_CMD_DO_SET_SERVO, (9, 1500), "ready", [0]),
    (mavlink.MAV_CMD_DO_SET_SERVO, (3, 1500), "ready", [4]),
    (mavlink.MAV_CMD_DO_SET_SERVO, (99, 1500), "ready", [4]),
    (mavlink.MAV_CMD_DO_FENCE_ENABLE, (1,), "ready", [4]),
    (mavlink.MAV_CMD_RUN_PREARM_CHECKS, (), "ready", [0]),
    (mavlink.MAV_CMD_GET_HOME_POSITION, (), "ready", [0]),
    (mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, (1,), "ready", [0]),
    (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (77,), "ready", [2]),
    (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (0,), "ready", [0]),
]

PX4_PLANE_TABLE = [
    (ARM, (1,), "ready", [0]),
    (ARM, (0,), "flying", [1]),
    (MODE, (1, 3, 2), "ready", [0, 1]),  # slow position flight is a multicopter's
    (MODE, (1, 4, 9), "ready", [0, 1]),  # no precision landing on an aircraft
    (MODE, (1, 4, 5), "flying", [0, 0]),
    (TAKEOFF, (0, 0, 0, NAN, NAN, NAN, NAN), "ready", [0]),
    (LAND, (), "flying", [0]),
    (mavlink.MAV_CMD_DO_REPOSITION, (-1, 1, 0, NAN, NAN, NAN, NAN), "flying", [0]),
    (mavlink.MAV_CMD_DO_REPOSITION, (-1, 0, 0, NAN, NAN, NAN, NAN), "flying", [3]),
    (mavlink.MAV_CMD_DO_ORBIT, (100, 2, 0, NAN, NAN, NAN, NAN), "flying", [0]),
    (mavlink.MAV_CMD_DO_CHANGE_SPEED, (0, 20, -1), "flying", [0]),
    (LAND_START, (), "flying", [6]),
    (GO_AROUND, (), "flying", [1]),
    (mavlink.MAV_CMD_MISSION_START, (0, 0), "ready", [2]),
    (mavlink.MAV_CMD_CONDITION_YAW, (90, 30, 0, 0), "flying", [3]),
    (CHANGE_HEADING, (1, 90, 5), "flying", [3]),
]


@pytest.mark.parametrize(("command", "parameters", "state", "acks"), ARDUPLANE_TABLE)
def test_arduplane_results(command: int, parameters: tuple[float, ...], state: str, acks: list[int]) -> None:
    rig = rig_of("ardupilot", state)
    rig.plan(rig.waypoint(500.0, 0.0, 100.0))
    assert rig.long(command, *parameters) == acks


@pytest.mark.parametrize(("command", "parameters", "state", "acks"), PX4_PLANE_TABLE)
def test_px4_plane_results(command: int, parameters: tuple[float, ...], state: str, acks: list[int]) -> None:
    assert rig_of("px4", state).long(command, *parameters) == acks


@pytest.mark.parametrize("command", [CHANGE_SPEED, CHANGE_ALTITUDE, CHANGE_HEADING])
def test_guided_changes_fail_in_other_modes(command: int) -> None:
    rig = rig_of("ardupilot", "flying")
    rig.commander.set_mode(FlightMode.HOLD)
    assert rig.long(command, 0, 25, 0, 0, 0, 0, 100) == [4]


@pytest.mark.parametrize(
    ("number", "text"),
    [
        (16, "Flight mode change failed"),
        (24, "Flight mode change failed"),
        (17, "Q_ENABLE 0"),
        (26, "No such mode 26"),
        (99, "No such mode 99"),
    ],
)
def test_arduplane_says_why_a_mode_is_refused(number: int, text: str) -> None:
    rig = rig_of("ardupilot", "ready")
    assert rig.long(MODE, 1, number) == [4]
    assert rig.channel.texts() == [text]


def test_aircraft_follow_no_target() -> None:
    """PX4's Follow Target (AUTO 8) is refused in the air; ArduCopter's FOLLOW (23) is another mode here."""
    rig = rig_of("px4", "flying")
    before = rig.commander.mode
    assert rig.long(MODE, 1, 4, 8) == [0, 1]
    assert "".join(rig.channel.texts()) == "Switching to Follow Target is currently not available\t"
    assert rig.commander.mode is before
    rig = rig_of("ardupilot", "flying")
    before = rig.commander.mode
    assert rig.long(MODE, 1, 23) == [4]
    assert rig.channel.texts() == ["Q_ENABLE 0"]
    assert rig.commander.mode is before


@pytest.mark.parametrize(
    ("radius_m", "yaw", "flown_m"),
    [
        (80.0, NAN, 80.0),
        (80.0, 0.0, 80.0),
        (80.0, 1.0, -80.0),
        (-80.0, 0.0, 125.0),  # WP_LOITER_RAD of the aircraft, clockwise
        (0.0, 1.0, -125.0),
        (NAN, NAN, 125.0),
    ],
)
def test_arduplane_reposition_takes_radius_and_direction(radius_m: float, yaw: float, flown_m: float) -> None:
    rig = rig_of("ardupilot", "flying")
    assert rig.int(
        mavlink.MAV_CMD_DO_REPOSITION, -1, 1, radius_m, yaw, *rig.place(400.0, 300.0), 120.0, frame=6
    ) == [0]
    rig.tick()
    circle = rig.commander.tasks.task.circle
    assert circle.radius_m == pytest.approx(flown_m)
    assert rig.centre() == pytest.approx((400.0, 300.0, -120.0), abs=0.05)


def test_arduplane_reposition_changes_the_mode_only_when_commanded() -> None:
    rig = rig_of("ardupilot", "flying")
    rig.commander.set_mode(FlightMode.HOLD)
    place = rig.place(400.0, 0.0)
    assert rig.int(mavlink.MAV_CMD_DO_REPOSITION, -1, 0, 0, 0, *place, 120.0, frame=6) == [4]
    assert rig.int(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, 0, *place, 120.0, frame=1) == [2]
    assert rig.channel.texts() == ["Unknown mavlink coordinate frame 1"]
    assert rig.int(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, 0, *place, 120.0, frame=6) == [0]
    assert rig.commander.mode is FlightMode.GUIDED


@pytest.mark.parametrize("radius_m", [90.0, -90.0, NAN, 0.0])
def test_px4_reposition_does_not_read_a_radius(radius_m: float) -> None:
    rig = rig_of("px4", "flying")
    altitude_m = 489.0 + 150.0  # over the sea in every frame: PX4 doesn't look at it
    place = rig.place(0.0, 500.0)
    assert rig.int(
        mavlink.MAV_CMD_DO_REPOSITION, -1, 1, radius_m, math.radians(90.0), *place, altitude_m, frame=6
    ) == [0]
    rig.tick()
    task = rig.commander.tasks.task
    assert task.radius_m == pytest.approx(rig.context.fixed_wing.loiter_radius_m)
    assert task.centre_ned_m == pytest.approx((0.0, 500.0, -150.0), abs=0.05)


@pytest.mark.parametrize("radius_m", [150.0, -150.0])
def test_px4_orbit_stays_in_hold(radius_m: float) -> None:
    rig = rig_of("px4", "flying")
    # MAVSDK sends the altitude over the sea in a frame of heights over home, which PX4 doesn't look at
    assert rig.int(
        mavlink.MAV_CMD_DO_ORBIT, radius_m, NAN, 0, NAN, *rig.place(300.0, 0.0), 489.0 + 110.0, frame=6
    ) == [0]
    rig.tick()
    assert rig.commander.mode is FlightMode.HOLD
    assert rig.commander.tasks.task.radius_m == radius_m
    assert rig.commander.tasks.task.centre_ned_m == pytest.approx((300.0, 0.0, -110.0), abs=0.05)


def test_px4_takeoff_goes_to_the_place_given() -> None:
    rig = rig_of("px4", "ready")
    lat, lon = rig.place(400.0, 100.0)
    assert rig.long(TAKEOFF, 0, 0, 0, NAN, lat * 1e-7, lon * 1e-7, 489.0 + 60.0) == [0]
    assert rig.long(ARM, 1) == [0]
    place = rig.commander.tasks.task.place_ned_m
    assert place == pytest.approx((400.0, 100.0, -60.0), abs=0.5)


def test_arduplane_change_speed_is_reported() -> None:
    rig = rig_of("ardupilot", "flying")
    assert rig.long(mavlink.MAV_CMD_DO_CHANGE_SPEED, 0, 30, 0) == [0]
    assert rig.channel.texts() == ["Set airspeed 30 m/s"]
    assert rig.context.fixed_wing.airspeed_trim_m_s == 30.0
    assert rig.long(mavlink.MAV_CMD_DO_CHANGE_SPEED, 1, 12, 0) == [0]
    assert rig.store.get("MIN_GROUNDSPEED") == 12.0
    assert rig.long(mavlink.MAV_CMD_DO_CHANGE_SPEED, 9, 0, 60) == [0]
    assert rig.store.get("TRIM_THROTTLE") == 60
    rig.commander.set_mode(FlightMode.HOLD)
    assert rig.long(mavlink.MAV_CMD_DO_CHANGE_SPEED, 0, 30, 0) == [4]


def test_arduplane_heading_altitude_and_airspeed_are_flown() -> None:
    rig = rig_of("ardupilot", "flying")
    assert rig.long(CHANGE_HEADING, 1, 90, 3.0) == [0]
    rig.tick()
    setpoint = rig.context.setpoint
    assert setpoint[sp.HEADING_RAD] == pytest.approx(math.pi / 2.0)
    assert math.isnan(setpoint[sp.COURSE_RAD])
    assert rig.long(CHANGE_HEADING, 0, 270, 3.0) == [0]
    assert rig.int(CHANGE_ALTITUDE, 0, 0, 0, 0, 0, 0, 489.0 + 140.0, frame=0) == [0]
    assert rig.long(CHANGE_SPEED, 0, 30, 0) == [0]
    rig.tick()
    assert math.cos(setpoint[sp.COURSE_RAD] - 1.5 * math.pi) == pytest.approx(1.0)
    assert setpoint[sp.DOWN_M] == pytest.approx(-140.0, abs=0.01)
    assert setpoint[sp.AIRSPEED_M_S] == pytest.approx(30.0)
    assert rig.int(CHANGE_ALTITUDE, 0, 0, 0, 0, 0, 0, 50.0, frame=1) == [2]


class Noted:
    """Notes what a guided command passes on, in the place of the guidance."""

    def __init__(self) -> None:
        self.calls: list[tuple[float, ...]] = []

    def change_heading(self, heading_rad: float, *, course: bool, acceleration_m_s2: float) -> None:
        self.calls.append((heading_rad, course, acceleration_m_s2))

    def change_altitude(self, down_m: float, *, rate_m_s: float) -> None:
        self.calls.append((down_m, rate_m_s))

    def change_airspeed(self, airspeed_m_s: float, *, acceleration_m_s2: float) -> None:
        self.calls.append((airspeed_m_s, acceleration_m_s2))


@pytest.mark.parametrize(
    ("command", "parameters", "passed_on"),
    [
        (CHANGE_HEADING, (0, 90, 3), (math.pi / 2.0, True, 3.0)),
        (CHANGE_HEADING, (1, 0, 0.04), (0.0, False, 0.05)),
        (CHANGE_HEADING, (1, 359.5, -3), (math.radians(359.5), False, 0.05)),
        (CHANGE_HEADING, (1, 180, NAN), (math.pi, False, 0.05)),
        (CHANGE_ALTITUDE, (0, 0, -2.5, 0, 0, 0, 120), (-120.0, 2.5)),
        (CHANGE_ALTITUDE, (0, 0, NAN, 0, 0, 0, 120), (-120.0, 0.0)),
        (CHANGE_ALTITUDE, (0, 0, 2.5, 0, 0, 0, -2), (2.0, 2.5)),
        (CHANGE_SPEED, (0, 25, -1.5), (25.0, 1.5)),
        (CHANGE_SPEED, (0, 25, NAN), (25.0, 0.0)),
    ],
)
def test_rates_and_accelerations_of_guided_changes(
    command: int, parameters: tuple[float, ...], passed_on: tuple[float, ...]
) -> None:
    """Rates have no sign; the lateral acceleration is at least 0.05 m/s^2."""
    rig = rig_of("ardupilot", "flying")
    rig.commander.guidance = noted = Noted()  # type: ignore[assignment]
    assert rig.long(command, *parameters) == [0]
    assert noted.calls == [pytest.approx(passed_on, abs=0.01)]


def test_the_limits_of_guided_airspeeds() -> None:
    for name, outside in (("AIRSPEED_MIN", -0.5), ("AIRSPEED_MAX", 0.5)):
        rig = rig_of("ardupilot", "flying")
        limit = rig.store.get(name)
        for command, answer in ((CHANGE_SPEED, 2), (mavlink.MAV_CMD_DO_CHANGE_SPEED, 4)):
            assert rig.long(command, 0, limit) == [0]
            assert rig.long(command, 0, limit + outside) == [answer]


@pytest.mark.parametrize(
    ("parameters", "answer", "texts"),
    [
        ((9, 0, 0), 4, []),
        ((9, 0, 1), 0, ["Set throttle 1"]),
        ((9, 0, 100), 0, ["Set throttle 100"]),
        ((9, 0, 101), 4, []),
        ((9, 0, -1), 4, []),
        ((9, 0, NAN), 4, []),
        ((1, 0, 0), 0, ["Set groundspeed 0 m/s"]),
        ((1, 100, 0), 0, ["Set groundspeed 100 m/s"]),
        ((1, 100.5, 0), 4, []),
        ((1, -0.5, 0), 4, []),
        ((1, -1, 60), 0, ["Set throttle 60"]),
        ((0, -2, 60), 0, []),
        ((NAN, 25, 0), 0, ["Set airspeed 25 m/s"]),
    ],
)
def test_speed_ground_speed_and_throttle(
    parameters: tuple[float, ...], answer: int, texts: list[str]
) -> None:
    rig = rig_of("ardupilot", "flying")
    assert rig.long(mavlink.MAV_CMD_DO_CHANGE_SPEED, *parameters) == [answer]
    assert rig.channel.texts() == texts


def landing_plan(rig: PlaneRig) -> tuple[MissionItem, ...]:
    return (
        rig.waypoint(500.0, 0.0, 100.0),
        MissionItem(command=LAND_START, frame=6),
        rig.waypoint(-500.0, 0.0, 40.0),
        rig.waypoint(0.0, 0.0, 0.0, command=LAND),
    )


def test_land_start_blocks_arming_while_autoland_is_off() -> None:
    rig = rig_of("ardupilot", "ready")
    rig.plan(*landing_plan(rig))
    assert rig.long(ARM, 1) == [4]
    assert rig.channel.texts() == ["Arm: DO_LAND_START set and RTL_AUTOLAND disabled"]
    rig.store.set("RTL_AUTOLAND", 2)
    assert rig.long(ARM, 1) == [0]


def test_after_a_landing_the_mission_must_be_left_before_arming_again() -> None:
    rig = rig_of("ardupilot", "ready")
    rig.store.set("RTL_AUTOLAND", 2)
    rig.plan(*landing_plan(rig))
    rig.commander.set_mode(FlightMode.MISSION)
    rig.missions.current = 4
    assert rig.long(ARM, 1) == [4]
    assert rig.channel.texts() == ["Arm: In landing sequence"]
    assert rig.long(MODE, 1, 5) == [0]
    assert rig.channel.texts() == ["In landing sequence: mission reset"]
    assert rig.missions.current == 0
    assert rig.long(ARM, 1) == [0]


def test_a_landing_sequence_takes_the_prearm_bit_until_the_mode_changes() -> None:
    rig = rig_of("ardupilot", "ready")
    rig.store.set("RTL_AUTOLAND", 2)
    rig.plan(*landing_plan(rig))
    status = StatusReport(rig.flavour, rig.commander)
    prearm = mavlink.MAV_SYS_STATUS_PREARM_CHECK
    rig.commander.set_mode(FlightMode.MISSION)
    rig.run(0.2)
    assert status.sys_status()[2] & prearm
    rig.missions.current = 4
    rig.run(35.0)
    assert not status.sys_status()[2] & prearm
    assert "PreArm: In landing sequence" in rig.texts()
    rig.long(MODE, 1, 5)
    rig.run(0.2)
    assert status.sys_status()[2] & prearm


def test_a_mission_with_a_takeoff_may_be_armed_for_after_its_landing() -> None:
    rig = rig_of("ardupilot", "ready")
    rig.store.set("RTL_AUTOLAND", 2)
    takeoff, *rest = landing_plan(rig)
    rig.plan(replace(takeoff, command=TAKEOFF), *rest)
    rig.commander.set_mode(FlightMode.MISSION)
    rig.missions.current = 4
    rig.run(0.2)
    assert rig.commander.armable


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_land_start_goes_to_the_landing_sequence(flavour: str) -> None:
    rig = rig_of(flavour, "flying")
    rig.plan(*landing_plan(rig))
    assert rig.long(LAND_START) == [0]
    assert rig.commander.mode is FlightMode.MISSION
    first = rig.flavour.policy.mission_first_item
    assert rig.missions.current == first + 2  # the waypoint behind DO_LAND_START


def test_auto_without_a_mission_gives_up() -> None:
    rig = rig_of("ardupilot", "ready")
    assert rig.long(mavlink.MAV_CMD_MISSION_START, 0, 0) == [0]
    assert rig.channel.texts() == ["Mission complete, changing mode to RTL"]
    assert rig.commander.mode is FlightMode.RETURN


def test_a_fence_can_be_switched_on_when_there_is_one() -> None:
    rig = rig_of("ardupilot", "ready")
    assert rig.long(mavlink.MAV_CMD_DO_FENCE_ENABLE, 1) == [4]
    rig.fence.replace(
        (MissionItem(command=mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION, frame=0, param1=3.0),) * 3, 1
    )
    assert rig.long(mavlink.MAV_CMD_DO_FENCE_ENABLE, 1) == [0]
    assert rig.store.get("FENCE_ENABLE") == 1


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_landing_can_be_broken_off(flavour: str) -> None:
    rig = rig_of(flavour, "flying")
    # on the approach: at its entry, along it
    rig.plan(rig.waypoint(-900.0, 0.0, 60.0), rig.waypoint(0.0, 0.0, 0.0, command=LAND))
    rig.context.nav[nav_layout.POS_NED_M] = (-880.0, 0.0, -60.0)
    rig.missions.current = len(rig.missions.items) - 1
    assert rig.commander.set_mode(FlightMode.MISSION).accepted
    rig.run(0.1)
    assert rig.long(GO_AROUND) == [0]
    rig.tick()
    assert rig.long(GO_AROUND) != [0]  # broken off already
