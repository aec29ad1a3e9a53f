"""COMMAND_LONG, COMMAND_INT and SET_MODE: the results that docs/firmware lists, by state."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.navigation import layout as nav_layout
from autopilot_bridge.services.commands.command import Command, command_from_message, flags, on_earth, whole
from tests.services.command_rig import NAN, ServiceRig

ARM, MODE, TAKEOFF, LAND, RTL = 400, 176, 22, 21, 20
HERE = (473977400, 85455900)


def rig_of(flavour: str, state: str) -> ServiceRig:
    """ready: on the ground, disarmed; booting; armed: on the ground; flying."""
    rig = ServiceRig(flavour, start_s=0.5 if state == "booting" else 45.0)
    if flavour == "ardupilot":
        rig.commander.set_mode(FlightMode.GUIDED)
    if state == "armed":
        assert rig.commander.arm().accepted
    elif state == "flying":
        rig.put_in_air()
    rig.commander.drain_events()
    return rig


PX4_TABLE = [
    # command, parameters, state, acknowledgements
    (31999, (), "ready", [3]),
    (0, (), "ready", [3]),
    (ARM, (1,), "booting", [1]),
    (ARM, (1,), "ready", [0]),
    (ARM, (0.5,), "ready", [0]),
    (ARM, (1, NAN, NAN, NAN, NAN, NAN, NAN), "ready", [0]),
    (ARM, (2,), "ready", []),
    (ARM, (-1,), "ready", []),
    (ARM, (NAN,), "ready", []),
    (ARM, (1,), "armed", [0]),
    (ARM, (0,), "ready", [0]),
    (ARM, (0,), "armed", [0]),
    (ARM, (0,), "flying", [1]),
    (ARM, (0, 21196), "flying", [0]),
    (ARM, (1, 21196), "booting", [1]),
    (MODE, (129, 4, 3), "ready", [0, 0]),
    (MODE, (1, 4, 4), "ready", [0, 0]),
    (MODE, (1, 6), "ready", [0, 0]),
    (MODE, (1, 8), "ready", [0, 0]),
    (MODE, (1, 99), "ready", [0, 0]),
    (MODE, (0, 4, 3), "ready", [0, 0]),
    (MODE, (1, 4, 77), "ready", [0, 1]),
    (MODE, (1, 4, 4), "flying", [0, 1]),
    (MODE, (1, 6), "flying", [0, 1]),
    (MODE, (1, 3), "flying", [0, 1]),
    (MODE, (1, 4, 5), "flying", [0, 0]),
    (TAKEOFF, (0, 0, 0, NAN, NAN, NAN, NAN), "ready", [0]),
    (TAKEOFF, (0, 0, 0, NAN, NAN, NAN, NAN), "armed", [0]),
    (LAND, (), "ready", [0]),
    (LAND, (), "flying", [0]),
    (RTL, (), "ready", [0]),
    (RTL, (), "flying", [0]),
    (mavlink.MAV_CMD_DO_REPOSITION, (-1, 1, 0, NAN, NAN, NAN, NAN), "ready", [0]),
    (mavlink.MAV_CMD_DO_REPOSITION, (-1, 1, 0, NAN, NAN, NAN, NAN), "flying", [0]),
    (mavlink.MAV_CMD_DO_REPOSITION, (-1, 0, 0, NAN, NAN, NAN, NAN), "flying", [3]),
    (mavlink.MAV_CMD_DO_CHANGE_ALTITUDE, (500, 0), "ready", [0]),
    (mavlink.MAV_CMD_DO_CHANGE_ALTITUDE, (NAN, 0), "flying", [0]),
    (mavlink.MAV_CMD_DO_ORBIT, (10, 2, 0, NAN, NAN, NAN, NAN), "ready", [0]),
    (mavlink.MAV_CMD_DO_ORBIT, (10, 2, 0, NAN, NAN, NAN, NAN), "flying", [0]),
    (mavlink.MAV_CMD_DO_CHANGE_SPEED, (1, 3, -1), "ready", [0]),
    (mavlink.MAV_CMD_DO_CHANGE_SPEED, (1, 3, -1), "flying", [0]),
    (mavlink.MAV_CMD_DO_SET_HOME, (1,), "ready", [0]),
    (mavlink.MAV_CMD_DO_SET_HOME, (0, 0, 0, 0, 47.4, 8.5, 500), "ready", [0]),
    (mavlink.MAV_CMD_MISSION_START, (0, 0), "ready", [2]),
    (mavlink.MAV_CMD_DO_LAND_START, (), "ready", [6]),
    (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, (1,), "flying", [0]),
    (mavlink.MAV_CMD_CONDITION_YAW, (90, 30, 0, 0), "flying", [3]),
    (mavlink.MAV_CMD_DO_MOTOR_TEST, (1,), "ready", [3]),
    (mavlink.MAV_CMD_DO_SET_SERVO, (9, 1500), "ready", [3]),
    (mavlink.MAV_CMD_DO_SET_RELAY, (0, 1), "ready", [3]),
    (mavlink.MAV_CMD_DO_FENCE_ENABLE, (1,), "ready", [3]),
    (mavlink.MAV_CMD_DO_PARACHUTE, (1,), "ready", [3]),
    (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, (0,), "flying", [3]),
    (mavlink.MAV_CMD_IMAGE_START_CAPTURE, (), "ready", [3]),
    (mavlink.MAV_CMD_VIDEO_START_CAPTURE, (), "ready", [3]),
    (mavlink.MAV_CMD_NAV_WAYPOINT, (), "ready", [3]),
    (mavlink.MAV_CMD_NAV_LOITER_UNLIM, (), "ready", [3]),
    (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (0,), "ready", [3]),
    (mavlink.MAV_CMD_DO_DIGICAM_CONTROL, (), "ready", []),
    (mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, (), "ready", []),
    (mavlink.MAV_CMD_DO_VTOL_TRANSITION, (4,), "ready", []),
    (mavlink.MAV_CMD_SET_CAMERA_MODE, (), "ready", []),
    (mavlink.MAV_CMD_INJECT_FAILURE, (4, 1, 0), "ready", [0]),
    (mavlink.MAV_CMD_RUN_PREARM_CHECKS, (), "ready", [0]),
    (mavlink.MAV_CMD_GET_HOME_POSITION, (), "ready", [0]),
    (mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, (1,), "ready", [0]),
    (mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, (30, 20000), "ready", [0]),
    (mavlink.MAV_CMD_GET_MESSAGE_INTERVAL, (30,), "ready", [0]),
    (mavlink.MAV_CMD_REQUEST_MESSAGE, (148,), "ready", [0]),
    (mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, (NAN, 20000), "ready", [2]),
]

ARDUPILOT_TABLE = [
    (31999, (), "ready", [3]),
    (65535, (), "ready", [3]),
    (MODE, (1, 5), "ready", [0]),
    (MODE, (1, 99), "ready", [4]),
    (MODE, (1, 14), "ready", [4]),
    (MODE, (0, 5), "ready", [2]),
    (MODE, (NAN, 5), "ready", [2]),
    (ARM, (1,), "ready", [0]),
    (ARM, (1,), "booting", [4]),
    (ARM, (1, 21196), "booting", [4]),
    (ARM, (1,), "armed", [0]),
    (ARM, (0,), "ready", [0]),
    (ARM, (2,), "ready", [3]),
    (ARM, (0.5,), "ready", [3]),
    (ARM, (0,), "flying", [4]),
    (ARM, (0, 21196), "flying", [0]),
    (TAKEOFF, (0, 0, 0, 0, 0, 0, 10), "ready", [4]),
    (TAKEOFF, (0, 0, 0, 0, 0, 0, 10), "armed", [0]),
    (TAKEOFF, (0, 0, 0, 0, 0, 0, 10), "flying", [4]),
    (TAKEOFF, (0, 0, 0, 0, 0, 0, 0), "armed", [4]),
    (TAKEOFF, (0, 0, 0, 0, 0, 0, -5), "armed", [4]),
    (TAKEOFF, (0, 0, 0, 0, 0, 0, NAN), "armed", [4]),
    (LAND, (), "flying", [0]),
    (RTL, (), "flying", [0]),
    (mavlink.MAV_CMD_NAV_LOITER_UNLIM, (), "flying", [0]),
    (mavlink.MAV_CMD_NAV_WAYPOINT, (), "ready", [3]),
    (mavlink.MAV_CMD_DO_JUMP, (), "ready", [3]),
    (mavlink.MAV_CMD_DO_ORBIT, (), "flying", [3]),
    (mavlink.MAV_CMD_DO_CONTROL_VIDEO, (), "ready", [3]),
    (mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN, (), "ready", [3]),
    (mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION, (), "ready", [3]),
    (mavlink.MAV_CMD_DO_LAND_START, (), "ready", [4]),
    (mavlink.MAV_CMD_DO_PARACHUTE, (0,), "flying", [0]),
    (mavlink.MAV_CMD_DO_REPOSITION, (-1, 1, 0, 0, 47.4, 8.5, 10), "flying", [3]),
    (mavlink.MAV_CMD_DO_CHANGE_SPEED, (1, 5, -1), "flying", [0]),
    (mavlink.MAV_CMD_CONDITION_YAW, (90, 30, 1, 0), "flying", [0]),
    (mavlink.MAV_CMD_CONDITION_YAW, (500, 30, 1, 0), "flying", [4]),
    (mavlink.MAV_CMD_MISSION_START, (0, 0), "ready", [0]),
    (mavlink.MAV_CMD_MISSION_START, (1, 0), "ready", [2]),
    (mavlink.MAV_CMD_DO_SET_HOME, (1,), "ready", [0]),
    (mavlink.MAV_CMD_DO_SET_HOME, (0,), "ready", [0]),
    (mavlink.MAV_CMD_DO_SET_HOME, (0, 0, 0, 0, 95, 8.5, 10), "ready", [4]),
    (mavlink.MAV_CMD_GUIDED_CHANGE_SPEED, (), "ready", [3]),
    (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, (0,), "flying", [0]),
    (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, (7,), "flying", [2]),
    (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, (0,), "ready", [4]),
    (mavlink.MAV_CMD_DO_SET_SERVO, (9, 1500), "ready", [0]),
    (mavlink.MAV_CMD_DO_SET_SERVO, (99, 1500), "ready", [4]),
    (mavlink.MAV_CMD_DO_FENCE_ENABLE, (1,), "ready", [0]),
    (mavlink.MAV_CMD_RUN_PREARM_CHECKS, (), "ready", [0]),
    (mavlink.MAV_CMD_GET_HOME_POSITION, (), "ready", [0]),
    (mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, (1,), "ready", [0]),
    (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (77,), "ready", [2]),
    (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (-1,), "ready", [2]),
    (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (0,), "ready", [0]),
]


@pytest.mark.parametrize(("command", "parameters", "state", "acks"), PX4_TABLE)
def test_px4_results(command: int, parameters: tuple[float, ...], state: str, acks: list[int]) -> None:
    assert rig_of("px4", state).long(command, *parameters) == acks


@pytest.mark.parametrize(("command", "parameters", "state", "acks"), ARDUPILOT_TABLE)
def test_ardupilot_results(command: int, parameters: tuple[float, ...], state: str, acks: list[int]) -> None:
    rig = rig_of("ardupilot", state)
    rig.upload(rig.waypoint(5.0, 0.0))
    assert rig.long(command, *parameters) == acks


@pytest.mark.parametrize(
    ("frame", "latitude", "flags", "state", "acks"),
    [
        (0, 473978000, 1, "ready", [0]),
        (3, 473978000, 1, "flying", [0]),
        (5, 473978000, 1, "flying", [0]),
        (6, 473978000, 1, "flying", [0]),
        (6, 473978000, 0, "flying", [0]),  # in GUIDED already
        (6, 950000000, 1, "flying", [2]),
        (1, 473978000, 1, "flying", [2]),
    ],
)
def test_ardupilot_reposition(frame: int, latitude: int, flags: int, state: str, acks: list[int]) -> None:
    rig = rig_of("ardupilot", state)
    assert (
        rig.int(mavlink.MAV_CMD_DO_REPOSITION, -1, flags, 0, 0, latitude, HERE[1], 20.0, frame=frame) == acks
    )
    if frame == 1:
        assert rig.channel.texts() == []  # nothing was received on this channel
    rig.handle(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    rig.int(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, 0, latitude, HERE[1], 20.0, frame=1)
    assert rig.channel.texts() == ["Unknown mavlink coordinate frame 1"]


def test_ardupilot_reposition_needs_the_flag_in_other_modes() -> None:
    rig = rig_of("ardupilot", "flying")
    rig.commander.set_mode(FlightMode.HOLD)
    assert rig.int(mavlink.MAV_CMD_DO_REPOSITION, -1, 0, 0, 0, *HERE, 20.0, frame=6) == [2]
    assert rig.int(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, 0, *HERE, 20.0, frame=6) == [0]
    assert rig.commander.mode is FlightMode.GUIDED


@pytest.mark.parametrize("frame", [0, 5, 6, 99])
def test_px4_reposition_flies_there(frame: int) -> None:
    rig = rig_of("px4", "flying")
    lat, lon, _ = rig.context.frame.geodetic_from_ned(12.0, 7.0, 0.0)  # type: ignore[union-attr]
    altitude_m = 489.0 + 15.0  # over the sea in every frame: PX4 doesn't look at it
    assert rig.int(
        mavlink.MAV_CMD_DO_REPOSITION,
        -1,
        1,
        0,
        NAN,
        round(lat * 1e7),
        round(lon * 1e7),
        altitude_m,
        frame=frame,
    ) == [0]
    rig.run(20.0)
    assert rig.context.nav[nav_layout.POS_NED_M] == pytest.approx((12.0, 7.0, -15.0), abs=0.1)


def test_px4_reposition_takes_off_when_armed_on_the_ground() -> None:
    rig = rig_of("px4", "armed")
    assert rig.int(mavlink.MAV_CMD_DO_REPOSITION, -1, 1, 0, NAN, *HERE, 489.0 + 10.0, frame=6) == [0]
    rig.run(20.0)
    assert rig.height_m == pytest.approx(10.0, abs=0.2)


def test_px4_takeoff_altitude_is_over_sea_level_and_may_be_commanded_first() -> None:
    rig = rig_of("px4", "ready")
    assert rig.long(TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 489.0 + 12.0) == [0]
    assert rig.long(ARM, 1) == [0]
    rig.run(20.0)
    assert rig.height_m == pytest.approx(12.0, abs=0.6)


def test_px4_takeoff_without_altitude_uses_the_parameter() -> None:
    rig = rig_of("px4", "ready")
    rig.set_parameter("MIS_TAKEOFF_ALT", 4.0)
    assert rig.long(MODE, 1, 4, 2) == [0, 0]
    assert rig.long(ARM, 1) == [0]
    rig.run(15.0)
    assert rig.height_m == pytest.approx(4.0, abs=0.6)


def test_px4_mission_start_changes_the_mode_and_arms() -> None:
    rig = rig_of("px4", "ready")
    assert rig.long(mavlink.MAV_CMD_MISSION_START, 0, 0) == [2]
    assert "Mission start denied! No valid mission\t" in rig.channel.texts()
    rig.upload(MissionItem(command=mavlink.MAV_CMD_NAV_TAKEOFF, frame=6, z=5.0), rig.waypoint(5.0, 0.0))
    rig.tick()
    assert rig.long(mavlink.MAV_CMD_MISSION_START, NAN) == [2]
    assert rig.long(mavlink.MAV_CMD_MISSION_START, 7) == [2]
    assert rig.long(mavlink.MAV_CMD_MISSION_START, 0) == [0]
    assert rig.commander.armed
    assert rig.commander.mode is FlightMode.MISSION


@pytest.mark.parametrize(
    ("flavour", "system", "component", "answered"),
    [
        ("px4", 1, 1, True),
        ("px4", 1, 0, True),
        ("px4", 1, 191, False),
        ("px4", 0, 0, False),
        ("px4", 2, 1, False),
        ("ardupilot", 1, 1, True),
        ("ardupilot", 0, 0, True),
        ("ardupilot", 1, 191, True),
        ("ardupilot", 2, 1, False),
    ],
)
def test_targets(flavour: str, system: int, component: int, answered: bool) -> None:
    rig = rig_of(flavour, "ready")
    assert rig.long(31999, system=system, component=component) == ([3] if answered else [])


def test_the_acknowledgement_names_its_receiver() -> None:
    rig = rig_of("px4", "ready")
    rig.long(mavlink.MAV_CMD_RUN_PREARM_CHECKS)
    ack = next(message for message in rig.channel.sent if message.get_msgId() == 77)
    assert (ack.command, ack.result, ack.target_system, ack.target_component) == (401, 0, 255, 190)


@pytest.mark.parametrize(
    ("base", "custom", "acks", "mode"),
    [
        (1, 0x05040000, [0], FlightMode.RETURN),
        (0, 0x05040000, [0], FlightMode.HOLD),
        (129, 0x00060000, [0], FlightMode.OFFBOARD),
        (1, 0x4D040000, [1], FlightMode.HOLD),
    ],
)
def test_px4_set_mode_message(base: int, custom: int, acks: list[int], mode: FlightMode) -> None:
    rig = rig_of("px4", "ready")
    assert rig.set_mode(base, custom) == acks
    assert rig.commander.mode is mode


def test_ardupilot_set_mode_message_is_not_acknowledged() -> None:
    rig = rig_of("ardupilot", "ready")
    rig.handle(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    assert rig.set_mode(1, 5) == []
    assert rig.commander.mode is FlightMode.HOLD
    assert rig.set_mode(1, 99) == []
    assert "No such mode 99" in rig.channel.texts()


def test_px4_texts_of_refused_commands() -> None:
    rig = rig_of("px4", "flying")
    rig.long(ARM, 0)
    assert rig.channel.texts() == ["Disarming denied: not landed\t"]
    rig.long(ARM, 2)
    assert rig.channel.texts() == ["Unsupported ARM_DISARM param\t"]
    rig.long(MODE, 1, 4, 77)
    assert rig.channel.texts() == ["Unsupported auto mode\t"]
    rig.long(MODE, 1, 4, 4)
    assert rig.channel.texts() == ["Switching to Mission is currently not available\t"]


def test_px4_texts_of_accepted_commands() -> None:
    rig = rig_of("px4", "flying")
    rig.long(RTL)
    assert rig.channel.texts()[0] == "Returning to launch\t"
    rig.long(LAND)
    assert rig.channel.texts() == ["Landing at current position\t"]
    rig.long(MODE, 1, 4, 5)
    assert "Returning to launch\t" not in rig.channel.texts()  # the text of the command, not of the mode


def test_ardupilot_pause_outside_guided_and_auto() -> None:
    rig = rig_of("ardupilot", "flying")
    rig.handle(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    rig.commander.set_mode(FlightMode.HOLD)
    assert rig.long(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0) == [4]
    assert "Failed to pause" in rig.channel.texts()


def test_ardupilot_yaw_turns_and_the_place_stays() -> None:
    rig = rig_of("ardupilot", "flying")
    rig.run(1.0)
    assert rig.long(mavlink.MAV_CMD_CONDITION_YAW, 90, 30, 1, 0) == [0]
    rig.run(8.0)
    assert rig.context.nav[nav_layout.YAW] == pytest.approx(math.pi / 2, abs=0.02)
    assert rig.long(mavlink.MAV_CMD_CONDITION_YAW, 45, 30, -1, 1) == [0]
    rig.run(8.0)
    assert rig.context.nav[nav_layout.YAW] == pytest.approx(math.pi / 4, abs=0.02)
    assert rig.context.nav[nav_layout.POS : nav_layout.POS + 2] == pytest.approx((0.0, 0.0), abs=0.1)


@pytest.mark.parametrize(
    ("parameters", "turned_deg", "rate_deg_s"),
    [((90, 10, -1, 0), -270.0, 10.0), ((60, 5, 1, 1), 60.0, 5.0), ((90, 0, 0, 0), 90.0, 60.0)],
)
def test_ardupilot_turns_at_the_rate_and_in_the_direction_of_the_command(
    parameters: tuple[float, ...], turned_deg: float, rate_deg_s: float
) -> None:
    rig = rig_of("ardupilot", "flying")
    rig.run(1.0)
    assert rig.long(mavlink.MAV_CMD_CONDITION_YAW, *parameters) == [0]
    yaws = []
    for _ in range(40 * 50):
        rig.tick()
        yaws.append(rig.context.nav[nav_layout.YAW])
    turned = np.degrees(np.unwrap([0.0, *yaws]))
    assert np.abs(np.diff(turned)).max() * 50.0 >= rate_deg_s - 0.5
    assert turned[-1] == pytest.approx(turned_deg, abs=1.0)
    assert np.abs(np.diff(turned)).max() * 50.0 <= rate_deg_s + 0.5


def test_ardupilot_position_setpoints_turn_at_their_yaw_rate() -> None:
    rig = rig_of("ardupilot", "flying")
    rig.run(1.0)
    mask = 0b0101_1111_1000  # positions and yaw rate count
    rig.handle(
        mavlink.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, 1, mask, 0.0, 0.0, -10.0, 0, 0, 0, 0, 0, 0, 0.0, 0.2
        )
    )
    before = rig.context.nav[nav_layout.YAW]
    rig.run(2.5)
    assert 0.3 < rig.context.nav[nav_layout.YAW] - before < 0.55


def test_ardupilot_starts_its_mission_when_the_throttle_is_raised() -> None:
    rig = ServiceRig("ardupilot")
    rig.upload(
        rig.waypoint(0.0, 0.0, 10.0, command=mavlink.MAV_CMD_NAV_TAKEOFF), rig.waypoint(20.0, 0.0, 10.0)
    )
    rig.commander.set_mode(FlightMode.GUIDED)
    assert rig.commander.arm().accepted
    rig.commander.set_mode(FlightMode.MISSION)

    def stick(throttle: int) -> None:
        rig.handle(mavlink.MAVLink_manual_control_message(1, 0, 0, throttle, 0, 0))

    for _ in range(100):
        stick(0)
        rig.tick()
    assert rig.height_m < 0.1
    for _ in range(100):
        stick(500)
        rig.tick()
    rig.run(6.0)
    assert rig.height_m > 5.0


def test_change_speed_lasts_until_the_next_mode() -> None:
    rig = rig_of("px4", "flying")
    rig.long(mavlink.MAV_CMD_DO_CHANGE_SPEED, 1, 2.5, -1)
    assert rig.context.parameters.cruise_speed_m_s == 2.5
    rig.commander.set_mode(FlightMode.RETURN)
    assert rig.context.parameters.cruise_speed_m_s == 5.0


def test_fence_switch_sets_the_parameter() -> None:
    rig = rig_of("ardupilot", "ready")
    assert rig.long(mavlink.MAV_CMD_DO_FENCE_ENABLE, 1) == [0]
    assert rig.store.get("FENCE_ENABLE") == 1


def test_failures_reach_the_hook() -> None:
    rig = rig_of("px4", "ready")
    rig.long(mavlink.MAV_CMD_INJECT_FAILURE, 4, 1, 0)
    assert rig.failures == [(4, 1, 0)]


def test_ardupilot_has_no_command_for_failures() -> None:
    rig = rig_of("ardupilot", "ready")
    assert rig.long(mavlink.MAV_CMD_INJECT_FAILURE, 4, 1, 0) == [3]
    assert rig.failures == []


def test_cancel_is_tolerated() -> None:
    if not hasattr(mavlink, "MAVLink_command_cancel_message"):
        pytest.skip("this release of the dialect has no COMMAND_CANCEL")
    rig = rig_of("px4", "ready")
    rig.handle(mavlink.MAVLink_command_cancel_message(1, 1, 22))
    assert rig.channel.sent == []


COMMANDS = sorted(
    {row[0] for row in PX4_TABLE + ARDUPILOT_TABLE} | {2510, 31010, 252, 186, 530, 43001, 84, 205}
)
ANYTHING = st.one_of(
    st.floats(width=32, allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, 1.0, -1.0, 2.0, 3.0, 6.0, 21196.0, 1e30, -1e30, NAN, math.inf, -math.inf]),
)
RIGS: dict[tuple[str, str], Callable[[], ServiceRig]] = {
    (flavour, state): (lambda flavour=flavour, state=state: rig_of(flavour, state))
    for flavour in ("px4", "ardupilot")
    for state in ("ready", "flying")
}


def sane(rig: ServiceRig) -> None:
    """Whatever was requested, the control setpoint is usable and home is a place."""
    setpoint = rig.context.setpoint
    assert setpoint[sp.LEVEL] in (sp.OFF, sp.IDLE, sp.RATES, sp.ATTITUDE, sp.TRAJECTORY)
    assert not any(math.isinf(value) for value in setpoint)
    if setpoint[sp.LEVEL] in (sp.RATES,):
        assert 0.0 <= setpoint[sp.THRUST] <= 1.0


@pytest.mark.parametrize("place", list(RIGS))
@pytest.mark.sampled(2)
@settings(max_examples=60, deadline=None)
@given(
    calls=st.lists(
        st.tuples(
            st.one_of(st.sampled_from(COMMANDS), st.integers(0, 65535)),
            st.lists(ANYTHING, min_size=4, max_size=4),
            st.integers(-(2**31), 2**31 - 1),
            st.integers(-(2**31), 2**31 - 1),
            ANYTHING,
            st.integers(0, 255),
            st.booleans(),
        ),
        max_size=6,
    )
)
def test_no_command_ever_raises(place: tuple[str, str], calls: list[tuple]) -> None:
    rig = RIGS[place]()
    for command, parameters, x, y, z, frame, as_int in calls:
        if as_int:
            acks = rig.int(command, *parameters, x, y, z, frame=frame)  # type: ignore[call-arg]
        else:
            acks = rig.long(command, *parameters, float(x), float(y), z)
        assert len(acks) <= 2
        rig.run(0.1)
        sane(rig)


@pytest.mark.parametrize(
    ("value", "number"),
    [
        (2.5, 3),
        (2.49, 2),
        (-2.5, -3),
        (-2.49, -2),
        (0.5, 1),
        (-0.5, -1),
        (0.0, 0),
        (math.nan, 7),
        (-math.inf, 7),
    ],
)
def test_whole_numbers_are_rounded_half_away_from_zero(value: float, number: int) -> None:
    assert whole(value, 7) == number


@pytest.mark.parametrize(
    ("value", "mask"),
    [
        (0.0, 0),
        (1.0, 1),
        (5.0, 5),
        (4294967295.0, 4294967295),
        (4294967296.0, 0),
        (-1.0, 0),
        (math.nan, 0),
        (math.inf, 0),
    ],
)
def test_bit_masks(value: float, mask: int) -> None:
    assert flags(value) == mask


@pytest.mark.parametrize(
    ("frame", "scale"),
    [
        (mavlink.MAV_FRAME_GLOBAL, 1e-7),
        (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, 1e-7),
        (mavlink.MAV_FRAME_GLOBAL_TERRAIN_ALT_INT, 1e-7),
        (mavlink.MAV_FRAME_MISSION, 1e-7),
        (mavlink.MAV_FRAME_LOCAL_NED, 1e-4),
        (mavlink.MAV_FRAME_LOCAL_ENU, 1e-4),
        (mavlink.MAV_FRAME_LOCAL_OFFSET_NED, 1e-4),
        (mavlink.MAV_FRAME_BODY_NED, 1e-4),
        (mavlink.MAV_FRAME_BODY_OFFSET_NED, 1e-4),
        (mavlink.MAV_FRAME_BODY_FRD, 1e-4),
        (mavlink.MAV_FRAME_LOCAL_FRD, 1e-4),
        (mavlink.MAV_FRAME_LOCAL_FLU, 1e-4),
    ],
)
def test_integer_positions_are_scaled_by_their_frame(frame: int, scale: float) -> None:
    """COMMAND_INT (MAVLink): degrees times 1e7, or metres times 1e4 in local frames; 2^31 - 1: not set."""
    message = mavlink.MAVLink_command_int_message(
        1, 1, frame, 192, 0, 0, 1.0, 2.0, 3.0, 4.0, 300_000_000, -450_000_000, 12.5
    )
    command = command_from_message(message)
    assert (command.id, command.frame, command.is_int) == (192, frame, True)
    assert (command.p1, command.p2, command.p3, command.p4) == (1.0, 2.0, 3.0, 4.0)
    assert (command.x, command.y) == pytest.approx((3e8 * scale, -4.5e8 * scale))
    assert command.z == 12.5
    message.x = message.y = 0x7FFFFFFF
    unset = command_from_message(message)
    assert math.isnan(unset.x) and math.isnan(unset.y)


def test_long_commands_carry_their_values_as_they_are() -> None:
    message = mavlink.MAVLink_command_long_message(1, 1, 192, 0, 1.0, 2.0, 3.0, 4.0, 5.5, 6.5, 7.5)
    command = command_from_message(message)
    assert tuple(command) == (192, 1.0, 2.0, 3.0, 4.0, 5.5, 6.5, 7.5, None)
    assert not command.is_int


@pytest.mark.parametrize(
    ("x", "y", "valid"),
    [
        (0.0, 0.0, True),
        (90.0, 180.0, True),
        (-90.0, -180.0, True),
        (90.01, 0.0, False),
        (-90.01, 0.0, False),
        (0.0, 180.01, False),
        (0.0, -180.01, False),
        (math.nan, 500.0, True),
        (500.0, math.nan, True),
    ],
)
def test_positions_of_commands_are_on_earth_or_not_set(x: float, y: float, valid: bool) -> None:
    assert on_earth(Command(192, 0.0, 0.0, 0.0, 0.0, x, y, 0.0, None)) is valid


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_an_acknowledgement_names_the_command_and_its_client(flavour: str) -> None:
    """COMMAND_ACK: progress and result_param2 are 0 where the command does not define them."""
    rig = ServiceRig(flavour)
    for command in (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 31_999):  # one that is known, one that is not
        rig.long(command, 0.0)
        acks = [sent for sent in rig.channel.sent if sent.get_msgId() == mavlink.MAVLINK_MSG_ID_COMMAND_ACK]
        assert acks
        for ack in acks:
            assert (ack.command, ack.progress, ack.result_param2) == (command, 0, 0)
            assert (ack.target_system, ack.target_component) == (255, 190)
