"""Streamed setpoints: type masks and frames, which count, which stop, which are ignored; sticks; texts."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.control.multicopter import setpoint as sp
from autopilot_bridge.flight.task import GuidedKind, OffboardKind
from autopilot_bridge.navigation import layout as nav_layout
from tests.services.command_rig import NAN, ServiceRig

POSITION_ONLY = 0x0DF8
VELOCITY_ONLY = 0x0DC7
ACCELERATION_ONLY = 0x0C3F
POSITION_VELOCITY_ACCELERATION = 0x0C00
VELOCITY_AND_YAW_RATE = 0x05C7
NOTHING = 0xFFFF


def local(
    frame: int,
    mask: int,
    *,
    pos=(1.0, 2.0, -12.0),
    vel=(1.0, 0.5, 0.0),
    acc=(0.1, 0.0, 0.0),
    yaw=0.5,
    rate=0.1,
):
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, frame, mask, *pos, *vel, *acc, yaw, rate
    )


def global_(frame: int, mask: int, *, lat=473978000, lon=85457000, alt=20.0, vel=(1.0, 0.5, 0.0)):
    return mavlink.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, mask, lat, lon, alt, *vel, 0.0, 0.0, 0.0, 0.0, 0.0
    )


def attitude(mask: int, *, q=(1.0, 0.0, 0.0, 0.0), rates=(0.1, 0.0, 0.2), thrust=0.5):
    return mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, q, *rates, thrust)


def counted(rig: ServiceRig) -> bool:
    return rig.commander.setpoints.age_s(rig.time_us) < 1.0


PX4_LOCAL = [
    # frame, mask, fields, counts
    (1, POSITION_ONLY, {}, True),
    (1, VELOCITY_ONLY, {}, True),
    (1, ACCELERATION_ONLY, {}, True),
    (1, POSITION_VELOCITY_ACCELERATION, {}, True),
    (1, 0, {}, True),
    (1, VELOCITY_AND_YAW_RATE, {}, True),
    (8, VELOCITY_ONLY, {}, True),
    (8, POSITION_ONLY, {}, False),
    (7, POSITION_ONLY, {}, False),
    (9, VELOCITY_ONLY, {}, False),
    (1, NOTHING, {}, False),
    (1, POSITION_ONLY, {"pos": (NAN, NAN, NAN)}, False),
    (1, VELOCITY_ONLY, {"vel": (math.inf, math.inf, -math.inf)}, False),
    (1, POSITION_ONLY, {"pos": (1e30, 1e30, 1e30)}, False),
    # bit 9, of forces, counts only where accelerations are used
    (1, POSITION_ONLY | 512, {}, True),
    (1, 4088, {}, True),
    (1, 4039, {}, True),
    (1, ACCELERATION_ONLY | 512, {}, False),
    (1, 512, {}, False),
    (8, 4039, {}, True),
    (8, ACCELERATION_ONLY | 512, {}, False),
    # in the body frame a position is not used, and vectors are used whole
    (8, 0, {}, True),
    (8, VELOCITY_ONLY | 8, {}, False),
]


@pytest.mark.parametrize(("frame", "mask", "fields", "counts"), PX4_LOCAL)
def test_px4_local_setpoints_that_count(frame: int, mask: int, fields: dict, counts: bool) -> None:
    rig = ServiceRig("px4")
    assert rig.handle(local(frame, mask, **fields))
    assert counted(rig) == counts


@pytest.mark.parametrize(("frame", "counts"), [(5, True), (6, True), (0, False), (3, False), (11, False)])
def test_px4_global_setpoints_that_count(frame: int, counts: bool) -> None:
    rig = ServiceRig("px4")
    assert rig.handle(global_(frame, POSITION_ONLY))
    assert counted(rig) == counts


@pytest.mark.parametrize(
    ("mask", "counts"), [(VELOCITY_ONLY, True), (POSITION_ONLY | 1, False), (4088, True)]
)
def test_px4_frame_of_a_global_setpoint_is_that_of_its_position(mask: int, counts: bool) -> None:
    rig = ServiceRig("px4")
    rig.handle(global_(5 if mask == 4088 else 0, mask))
    assert counted(rig) == counts


def offboard(rig: ServiceRig, message, seconds: float) -> None:
    for _ in range(round(seconds * 50)):
        rig.handle(message)
        if rig.commander.mode is not FlightMode.OFFBOARD:
            rig.commander.set_mode(FlightMode.OFFBOARD)
        rig.tick()


def test_px4_position_setpoint_reaches_the_control_laws() -> None:
    rig = ServiceRig("px4").fly()
    offboard(rig, local(1, 0x0800), 0.5)
    assert rig.commander.mode is FlightMode.OFFBOARD
    setpoint = rig.context.setpoint
    assert setpoint[sp.LEVEL] == sp.TRAJECTORY
    assert setpoint[sp.POS_NED_M] == pytest.approx((1.0, 2.0, -12.0))
    assert setpoint[sp.VEL_NED_M_S] == pytest.approx((1.0, 0.5, 0.0))
    assert setpoint[sp.ACC_NED_M_S2] == pytest.approx((0.1, 0.0, 0.0))
    assert setpoint[sp.YAW_RAD] == pytest.approx(0.5)


def test_px4_single_components_are_ignored_one_by_one() -> None:
    rig = ServiceRig("px4").fly()
    offboard(rig, local(1, 0x0DFF & ~4 & ~8), 0.3)  # height and north speed
    setpoint = rig.context.setpoint
    assert math.isnan(setpoint[sp.POS]) and math.isnan(setpoint[sp.VEL + 1])
    assert (setpoint[sp.POS + 2], setpoint[sp.VEL]) == pytest.approx((-12.0, 1.0))


def test_px4_body_velocity_turns_with_the_heading() -> None:
    rig = ServiceRig("px4").fly()
    for _ in range(5):
        rig.context.nav[nav_layout.YAW] = math.pi / 2
        offboard(rig, local(8, VELOCITY_ONLY, vel=(3.0, 1.0, -0.5)), 0.02)
    assert rig.context.setpoint[sp.VEL_NED_M_S] == pytest.approx((-1.0, 3.0, -0.5), abs=1e-6)


@pytest.mark.parametrize(("frame", "altitude_m"), [(5, 509.0), (6, 20.0)])
def test_px4_global_position(frame: int, altitude_m: float) -> None:
    rig = ServiceRig("px4").fly()
    lat, lon, _ = rig.context.frame.geodetic_from_ned(8.0, -6.0, 0.0)  # type: ignore[union-attr]
    message = global_(frame, POSITION_ONLY, lat=round(lat * 1e7), lon=round(lon * 1e7), alt=altitude_m)
    offboard(rig, message, 0.2)
    assert rig.context.setpoint[sp.POS_NED_M] == pytest.approx((8.0, -6.0, -20.0), abs=0.02)


PX4_ATTITUDE = [
    (0x07, {}, OffboardKind.ATTITUDE),
    (0x00, {}, OffboardKind.ATTITUDE),
    (0x80, {}, OffboardKind.RATES),
    (0x40, {}, OffboardKind.NONE),  # no thrust
    (0x87, {}, OffboardKind.NONE),  # nothing
    (0x07, {"q": (0.0, 0.0, 0.0, 0.0)}, OffboardKind.NONE),
    (0x07, {"q": (NAN, 0.0, 0.0, 0.0)}, OffboardKind.NONE),
    (0x07, {"thrust": NAN}, OffboardKind.NONE),
    (0x80, {"rates": (math.inf, 0.0, 0.0)}, OffboardKind.NONE),
]


@pytest.mark.parametrize(("mask", "fields", "kind"), PX4_ATTITUDE)
def test_px4_attitude_targets(mask: int, fields: dict, kind: OffboardKind) -> None:
    rig = ServiceRig("px4")
    assert rig.handle(attitude(mask, **fields))
    assert rig.commander.setpoints.offboard.kind is kind
    assert counted(rig) == (kind is not OffboardKind.NONE)
    assert rig.commander.setpoints.attitude_setpoints == (kind is OffboardKind.ATTITUDE)


def test_thrust_and_quaternion_arrive_within_their_range() -> None:
    rig = ServiceRig("px4").fly()
    offboard(rig, attitude(0x07, q=(1.02, 0.0, 0.0, 0.0), thrust=7.0), 0.2)
    assert rig.context.setpoint[sp.LEVEL] == sp.ATTITUDE
    assert rig.context.setpoint[sp.THRUST] == 1.0
    assert rig.context.setpoint[sp.Q_NED_FROM_FRD] == pytest.approx((1.0, 0.0, 0.0, 0.0))


ARDUPILOT_LOCAL = [
    (1, POSITION_ONLY, GuidedKind.POSITION),
    (7, POSITION_ONLY, GuidedKind.POSITION),
    (8, POSITION_ONLY, GuidedKind.POSITION),
    (9, POSITION_ONLY, GuidedKind.POSITION),
    (1, VELOCITY_ONLY, GuidedKind.VELOCITY),
    (8, VELOCITY_ONLY, GuidedKind.VELOCITY),
    (1, ACCELERATION_ONLY, GuidedKind.ACCELERATION),
    (1, POSITION_VELOCITY_ACCELERATION, GuidedKind.TRAJECTORY),
    (20, VELOCITY_ONLY, GuidedKind.HOLD),
    (12, VELOCITY_ONLY, GuidedKind.HOLD),
    (1, NOTHING, GuidedKind.HOLD),
    (1, 0x0DFF, GuidedKind.HOLD),
    (1, 4088, GuidedKind.POSITION),
    (1, 4039, GuidedKind.VELOCITY),
    (
        1,
        POSITION_ONLY & ~(64 | 128 | 256),
        GuidedKind.HOLD,
    ),  # a position with an acceleration, but no velocity
]


@pytest.mark.parametrize(("frame", "mask", "kind"), ARDUPILOT_LOCAL)
def test_ardupilot_local_targets(frame: int, mask: int, kind: GuidedKind) -> None:
    rig = ServiceRig("ardupilot").fly()
    rig.handle(local(1, VELOCITY_ONLY))
    rig.handle(local(frame, mask))
    assert rig.commander.setpoints.guided.kind is kind
    rig.run(0.5)
    assert rig.commander.airborne


@pytest.mark.parametrize("mask", [ACCELERATION_ONLY | 512, 512, POSITION_VELOCITY_ACCELERATION | 512])
def test_ardupilot_ignores_forces_and_keeps_the_target(mask: int) -> None:
    rig = ServiceRig("ardupilot").fly()
    rig.handle(local(1, POSITION_ONLY))
    rig.handle(local(1, mask))
    assert rig.commander.setpoints.guided.kind is GuidedKind.POSITION


@pytest.mark.parametrize("frame", [1, 8, 9])
def test_ardupilot_yaw_is_that_of_the_frame(frame: int) -> None:
    """In both body frames it is relative to the nose."""
    rig = ServiceRig("ardupilot").fly()
    rig.context.nav[nav_layout.YAW] = 1.0
    rig.handle(local(frame, VELOCITY_ONLY & ~1024, yaw=0.5))
    assert rig.commander.setpoints.guided._yaw_rad == pytest.approx(0.5 if frame == 1 else 1.5)


@pytest.mark.parametrize("fields", [{"vel": (NAN, 0.0, 0.0)}, {"vel": (1e9, 0.0, 0.0)}])
def test_ardupilot_ignores_unusable_numbers(fields: dict) -> None:
    rig = ServiceRig("ardupilot").fly()
    rig.handle(local(1, VELOCITY_ONLY, **fields))
    assert rig.commander.setpoints.guided.kind is GuidedKind.HOLD


def test_ardupilot_listens_in_guided_and_in_the_air_only() -> None:
    rig = ServiceRig("ardupilot")
    rig.commander.set_mode(FlightMode.GUIDED)
    rig.commander.arm()
    rig.handle(local(1, POSITION_ONLY))
    rig.run(3.0)
    assert rig.height_m == 0.0
    rig = ServiceRig("ardupilot").fly()
    rig.commander.set_mode(FlightMode.HOLD)
    rig.handle(local(1, VELOCITY_ONLY))
    rig.run(1.0)
    assert rig.context.nav[nav_layout.POS] == pytest.approx(0.0, abs=0.05)


def test_ardupilot_offset_frame_starts_from_here() -> None:
    rig = ServiceRig("ardupilot").fly()
    rig.handle(local(1, POSITION_ONLY, pos=(10.0, 0.0, -10.0)))
    rig.run(12.0)
    rig.handle(local(7, POSITION_ONLY, pos=(5.0, 5.0, -2.0)))
    rig.run(12.0)
    assert rig.context.nav[nav_layout.POS_NED_M] == pytest.approx((15.0, 5.0, -12.0), abs=0.3)


def test_ardupilot_velocity_ends_after_the_time_out() -> None:
    rig = ServiceRig("ardupilot").fly()
    for _ in range(100):
        rig.handle(local(1, VELOCITY_ONLY, vel=(2.0, 0.0, 0.0)))
        rig.tick()
    before_m = float(rig.context.nav[nav_layout.POS])
    rig.run(2.9)
    assert float(rig.context.nav[nav_layout.POS]) - before_m == pytest.approx(2.0 * 2.9, abs=0.6)
    rig.run(4.0)
    stopped_m = float(rig.context.nav[nav_layout.POS])
    rig.run(1.0)
    assert float(rig.context.nav[nav_layout.POS]) == pytest.approx(stopped_m, abs=0.05)
    assert rig.commander.mode is FlightMode.GUIDED


@pytest.mark.parametrize(
    ("frame", "altitude_m", "kind"),
    [
        (0, 509.0, GuidedKind.POSITION),
        (3, 20.0, GuidedKind.POSITION),
        (5, 509.0, GuidedKind.POSITION),
        (6, 20.0, GuidedKind.POSITION),
        (1, 20.0, GuidedKind.HOLD),
    ],
)
def test_ardupilot_global_targets(frame: int, altitude_m: float, kind: GuidedKind) -> None:
    rig = ServiceRig("ardupilot").fly()
    rig.handle(global_(frame, POSITION_ONLY, lat=473978000, lon=85456000, alt=altitude_m))
    assert rig.commander.setpoints.guided.kind is kind
    if kind is GuidedKind.POSITION:
        rig.run(20.0)
        assert rig.height_m == pytest.approx(20.0, abs=0.3)


@pytest.mark.parametrize(
    ("mask", "fields", "kind"),
    [
        (0x07, {}, GuidedKind.ATTITUDE),
        (0x47, {}, GuidedKind.HOLD),
        (0x07, {"q": (2.0, 0.0, 0.0, 0.0)}, GuidedKind.HOLD),
        (0x80, {}, GuidedKind.HOLD),
        (0x03, {}, GuidedKind.HOLD),  # one body rate without the others
        (0x00, {}, GuidedKind.ATTITUDE),
    ],
)
def test_ardupilot_attitude_targets(mask: int, fields: dict, kind: GuidedKind) -> None:
    rig = ServiceRig("ardupilot").fly()
    rig.handle(attitude(mask, **fields))
    assert rig.commander.setpoints.guided.kind is kind


def test_a_guided_target_takes_over_from_the_takeoff() -> None:
    rig = ServiceRig("ardupilot")
    rig.commander.set_mode(FlightMode.GUIDED)
    rig.commander.arm()
    assert rig.long(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 10) == [0]
    rig.run_until(lambda: rig.height_m > 5.0, 20.0)
    rig.handle(local(1, POSITION_ONLY, pos=(20.0, 0.0, -8.0)))
    rig.run(15.0)
    assert rig.context.nav[nav_layout.POS_NED_M] == pytest.approx((20.0, 0.0, -8.0), abs=0.3)


# sticks and ground stations


def test_manual_control_moves_the_sticks() -> None:
    rig = ServiceRig("px4")
    rig.handle(mavlink.MAVLink_manual_control_message(1, 500, -250, 750, 100, 0))
    rig.tick()
    sticks = rig.context.sticks
    assert sticks.valid
    assert (sticks.pitch, sticks.roll, sticks.throttle, sticks.yaw) == pytest.approx((0.5, -0.25, 0.5, 0.1))
    rig.run(1.0)
    assert not rig.context.sticks.valid


@pytest.mark.parametrize("target", [2, 77])
def test_sticks_for_others_are_left_alone(target: int) -> None:
    rig = ServiceRig("px4")
    rig.handle(mavlink.MAVLink_manual_control_message(target, 500, 0, 500, 0, 0))
    rig.tick()
    assert not rig.context.sticks.valid


def test_rc_override() -> None:
    rig = ServiceRig("ardupilot")
    assert rig.context.sticks.valid and rig.context.sticks.throttle == -1.0  # the radio at rest
    rig.handle(mavlink.MAVLink_rc_channels_override_message(1, 1, 1750, 1250, 1500, 65535, 0, 0, 0, 0))
    rig.tick()
    sticks = rig.context.sticks
    assert (sticks.roll, sticks.pitch, sticks.throttle) == pytest.approx((0.5, 0.5, 0.0))
    rig.handle(mavlink.MAVLink_rc_channels_override_message(1, 1, 0, 0, 0, 0, 0, 0, 0, 0))
    rig.tick()
    assert rig.context.sticks.throttle == -1.0


def test_ground_station_heartbeats() -> None:
    rig = ServiceRig("px4")
    rig.handle(mavlink.MAVLink_heartbeat_message(18, 8, 0, 0, 0, 3))  # an onboard computer
    assert rig.commander.pilot.gcs_age_s(rig.time_us) == math.inf
    rig.handle(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    assert rig.commander.pilot.gcs_age_s(rig.time_us) == 0.0


# texts


def test_long_texts_come_in_chunks() -> None:
    rig = ServiceRig("px4")
    rig.status.announce(2, "Arming denied: Resolve system health failures first")
    rig.status.announce(6, "x" * 50)
    rig.status.announce(6, "y" * 100)
    parts = [
        (m.id, m.chunk_seq, m.text.encode() if isinstance(m.text, str) else m.text) for m in rig.channel.sent
    ]
    assert parts[0][:2] == (1, 0) and parts[1][:2] == (1, 1)
    assert b"".join(part[2] for part in parts[:2]) == b"Arming denied: Resolve system health failures first"
    assert parts[2] == (0, 0, b"x" * 50)
    assert [part[:2] for part in parts[3:]] == [(2, 0), (2, 1), (2, 2)]
    assert parts[-1][2] == b""


def test_ardupilot_is_silent_until_a_client_sends() -> None:
    rig = ServiceRig("ardupilot")
    rig.status.announce(6, "not received")
    assert rig.channel.sent == []
    rig.handle(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 0, 3))
    rig.status.banner(rig.channel)
    assert rig.channel.texts()[0] == "ArduCopter V4.6.3 (3fc7011a)"


NUMBER = st.one_of(
    st.floats(width=32, allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, 1.0, -1.0, 1e30, -1e30, NAN, math.inf, -math.inf]),
)
TRIPLE = st.tuples(NUMBER, NUMBER, NUMBER)


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
@settings(max_examples=150, deadline=None)
@given(
    kind=st.sampled_from(["local", "global", "attitude"]),
    frame=st.integers(0, 25),
    mask=st.integers(0, 0xFFFF),
    triples=st.tuples(TRIPLE, TRIPLE, TRIPLE),
    scalars=st.tuples(NUMBER, NUMBER),
    place=st.tuples(st.integers(-(2**31), 2**31 - 1), st.integers(-(2**31), 2**31 - 1)),
)
@pytest.mark.sampled(1)
def test_no_setpoint_ever_reaches_the_control_laws_broken(
    flavour: str, kind: str, frame: int, mask: int, triples: tuple, scalars: tuple, place: tuple
) -> None:
    rig = ServiceRig(flavour).fly()
    pos, vel, acc = triples
    if kind == "local":
        message = local(frame, mask, pos=pos, vel=vel, acc=acc, yaw=scalars[0], rate=scalars[1])
    elif kind == "global":
        message = global_(frame, mask, lat=place[0], lon=place[1], alt=scalars[0], vel=vel)
    else:
        message = attitude(mask & 0xFF, q=(*pos, scalars[0]), rates=vel, thrust=scalars[1])
    rig.handle(message)
    rig.commander.set_mode(FlightMode.OFFBOARD)
    rig.run(0.06)
    setpoint = rig.context.setpoint
    assert not np.isinf(setpoint).any()
    assert np.nanmax(np.abs(setpoint)) <= 1e7
    if setpoint[sp.LEVEL] == sp.ATTITUDE:
        assert np.linalg.norm(setpoint[sp.Q_NED_FROM_FRD]) == pytest.approx(1.0)
    if setpoint[sp.LEVEL] == sp.RATES:
        assert np.isfinite(setpoint[sp.RATES_FRD_RAD_S]).all() and 0.0 <= setpoint[sp.THRUST] <= 1.0


@pytest.mark.parametrize(
    ("message", "text"),
    [
        (local(7, POSITION_ONLY), "SET_POSITION_TARGET_LOCAL_NED coordinate frame 7 unsupported"),
        (local(1, NOTHING), "SET_POSITION_TARGET_LOCAL_NED invalid"),
        (local(1, ACCELERATION_ONLY | 512), "SET_POSITION_TARGET_LOCAL_NED force not supported"),
        (global_(0, POSITION_ONLY), "SET_POSITION_TARGET_GLOBAL_INT invalid coordinate frame 0"),
        (global_(5, ACCELERATION_ONLY | 512), "SET_POSITION_TARGET_GLOBAL_INT force not supported"),
        (global_(5, NOTHING), None),
        (local(1, 4088), None),
    ],
)
def test_px4_reports_a_setpoint_that_it_does_not_use(message: object, text: str | None) -> None:
    rig = ServiceRig("px4")
    rig.handle(message)
    rig.tick()
    assert [t.rstrip("\t") for t in rig.texts() if "SET_POSITION" in t] == ([] if text is None else [text])
