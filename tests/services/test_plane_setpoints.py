"""Streamed setpoints of aircraft: type masks, heights, what is left to the autopilot."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import all as mavlink

from autopilot_bridge.commander.modes import FlightMode
from autopilot_bridge.control.fixed_wing import setpoint as sp
from autopilot_bridge.flight.task import OffboardKind
from flightsim.foundation.rotations import quaternion_from_euler
from tests.services.command_rig import NAN
from tests.services.plane_rig import PlaneRig

ROLL, PITCH = math.radians(25.0), math.radians(5.0)


def attitude(mask: int, *, roll: float = ROLL, pitch: float = PITCH, thrust: float = 0.9, q=None):
    if q is None:
        q = np.zeros(4)
        quaternion_from_euler(roll, pitch, 1.0, q)
    return mavlink.MAVLink_set_attitude_target_message(0, 1, 1, mask, list(q), 0.0, 0.0, 0.0, thrust)


def local(frame: int, z: float, mask: int = 0x0DF8):
    return mavlink.MAVLink_set_position_target_local_ned_message(
        0, 1, 1, frame, mask, 50.0, 60.0, z, 0, 0, 0, 0, 0, 0, 0, 0
    )


def global_(frame: int, alt: float, mask: int = 0x0DF8):
    return mavlink.MAVLink_set_position_target_global_int_message(
        0, 1, 1, frame, mask, 473978000, 85457000, alt, 0, 0, 0, 0, 0, 0, 0, 0
    )


def guided() -> PlaneRig:
    rig = PlaneRig("ardupilot").fly()
    rig.channel.sent.clear()
    return rig


@pytest.mark.parametrize(
    ("mask", "roll", "pitch", "throttle"),
    [
        (0x47, True, True, False),  # attitude; throttle left to the energy control
        (0x07, True, True, True),
        (0x00, True, True, True),
        (0xC6, True, False, False),  # roll alone
        (0xC5, False, True, False),
        (0x87, False, False, True),
        (0xC4, True, True, False),
        (0xC7, False, False, False),
    ],
)
def test_arduplane_takes_what_the_mask_leaves(mask: int, roll: bool, pitch: bool, throttle: bool) -> None:
    rig = guided()
    before = rig.context.setpoint[sp.ROLL_RAD]
    assert math.isnan(before)
    assert rig.handle(attitude(mask))
    rig.tick()
    setpoint = rig.context.setpoint
    for place, given_, value in (
        (sp.ROLL_RAD, roll, ROLL),
        (sp.PITCH_RAD, pitch, PITCH),
        (sp.THROTTLE, throttle, 0.9),
    ):
        assert math.isnan(setpoint[place]) is not given_
        if given_:
            assert setpoint[place] == pytest.approx(value, rel=1e-5)


def test_arduplane_attitudes_end_after_three_seconds_without_another() -> None:
    rig = guided()
    for _ in range(10):
        rig.handle(attitude(0x47))
        rig.run(0.2)
    assert rig.commander.setpoints.thrust_setpoints
    rig.run(2.5)
    assert rig.context.setpoint[sp.ROLL_RAD] == pytest.approx(ROLL, rel=1e-5)
    rig.run(0.8)
    assert math.isnan(rig.context.setpoint[sp.ROLL_RAD])


@pytest.mark.parametrize("mode", [FlightMode.HOLD, FlightMode.FBWA, FlightMode.RETURN])
def test_arduplane_listens_in_guided_only(mode: FlightMode) -> None:
    rig = PlaneRig("ardupilot").fly(mode)
    for message in (attitude(0x07), local(7, -30.0), global_(6, 200.0)):
        assert rig.handle(message)
    rig.tick()
    assert rig.commander.mode is mode
    assert rig.context.setpoint[sp.PITCH_RAD] != pytest.approx(PITCH, rel=1e-5)
    assert "Change alt" not in " ".join(rig.channel.texts())


def test_arduplane_frame_7_steps_the_height() -> None:
    rig = guided()
    rig.handle(local(7, -20.0))
    rig.run(0.1)
    assert rig.context.setpoint[sp.DOWN_M] == pytest.approx(-120.0)
    rig.handle(local(7, 5.0))
    rig.run(0.1)
    assert rig.context.setpoint[sp.DOWN_M] == pytest.approx(-115.0)
    assert [text for text in rig.texts() if text.startswith("Change alt")] == [
        "Change alt to 120.0",
        "Change alt to 115.0",
    ]
    assert rig.centre()[0:2] == pytest.approx((0.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("frame", [1, 8, 9, 20, 99])
def test_arduplane_ignores_other_local_frames(frame: int) -> None:
    rig = guided()
    rig.handle(local(frame, -20.0))
    rig.run(0.1)
    assert rig.context.setpoint[sp.DOWN_M] == pytest.approx(-100.0)


@pytest.mark.parametrize(
    ("frame", "alt", "down_m"),
    [(6, 130.0, -130.0), (3, 130.0, -130.0), (5, 489.0 + 80.0, -80.0), (0, 569.0, -80.0), (99, 50.0, -100.0)],
)
def test_arduplane_takes_the_altitude_of_global_targets(frame: int, alt: float, down_m: float) -> None:
    rig = guided()
    rig.handle(global_(frame, alt))
    rig.run(0.1)
    assert rig.context.setpoint[sp.DOWN_M] == pytest.approx(down_m)
    assert rig.centre()[0:2] == pytest.approx((0.0, 0.0), abs=1e-6)  # the place isn't used


def test_bad_numbers_change_nothing() -> None:
    rig = guided()
    for message in (
        attitude(0x07, q=(NAN, 0.0, 0.0, 0.0)),
        attitude(0x47, q=(0.0, 0.0, 0.0, 0.0)),
        attitude(0x87, thrust=NAN),
        local(7, NAN),
        global_(6, NAN),
    ):
        assert rig.handle(message)
    rig.run(0.1)
    assert math.isnan(rig.context.setpoint[sp.ROLL_RAD])
    assert rig.context.setpoint[sp.DOWN_M] == pytest.approx(-100.0)


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(
    mask=st.integers(0, 255),
    numbers=st.lists(st.floats(width=32), min_size=5, max_size=5),
    frame=st.integers(0, 255),
)
def test_nothing_a_client_sends_raises(mask: int, numbers: list[float], frame: int) -> None:
    rig = guided()
    rig.handle(attitude(mask, q=numbers[:4], thrust=numbers[4]))
    rig.handle(local(frame, numbers[0], mask))
    rig.handle(global_(frame, numbers[1], mask))
    rig.run(0.06)
    roll = rig.context.setpoint[sp.ROLL_RAD]
    assert math.isnan(roll) or abs(roll) <= rig.context.fixed_wing.bank_max_rad + 1e-9


PX4_SETPOINTS = [
    (lambda: local(1, -110.0), OffboardKind.TRAJECTORY),
    (lambda: local(1, NAN, 0x0DC7), OffboardKind.TRAJECTORY),
    (lambda: global_(6, 120.0), OffboardKind.TRAJECTORY),
    (lambda: global_(5, 600.0), OffboardKind.TRAJECTORY),
    (lambda: attitude(0x07), OffboardKind.ATTITUDE),
    (lambda: attitude(0x80), OffboardKind.RATES),
]


@pytest.mark.parametrize(("make", "kind"), PX4_SETPOINTS)
def test_px4_counts_positions_global_places_attitudes_and_rates(make, kind: OffboardKind) -> None:
    rig = PlaneRig("px4").fly()
    rig.handle(make())
    assert rig.commander.setpoints.offboard.kind is kind
    assert rig.commander.setpoints.age_s(rig.time_us) < 0.1
    assert rig.long(mavlink.MAV_CMD_DO_SET_MODE, 1, 6) == [0, 0]
    rig.tick()
    assert rig.commander.mode is FlightMode.OFFBOARD
