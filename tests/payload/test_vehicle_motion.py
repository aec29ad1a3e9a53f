"""The motion of an aircraft on the wire: golden bytes, round trips, malformed payloads."""

import math
import struct
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode
from autopilot_bridge.mavlink.vehicle_motion import (
    VEHICLE_MOTION_PAYLOAD,
    VehicleMotion,
    motion_message,
    read_motion_payload,
)

MOTION = VehicleMotion(
    system=2,
    number=70_000,
    time_us=5_000_000,
    sums=(1234.5, -10.25, 3.0, -40.5),
    rates=(20.5, 0.25, -1.5, 0.125),
    heading_rad=1.5,
    height_m=150.5,
)


def read(message):
    return read_motion_payload(message.payload_type, message.payload_length, message.payload)


def test_bytes_are_as_documented():
    message = motion_message(MOTION)
    expected = struct.pack("<BBHQ", 1, 2, 70_000 % 65_536, 5_000_000)
    expected += struct.pack("<4d", 1234.5, -10.25, 3.0, -40.5)
    expected += struct.pack("<6f", 20.5, 0.25, -1.5, 0.125, 1.5, 150.5)
    assert message.payload_type == VEHICLE_MOTION_PAYLOAD == 0xF51E
    assert bytes(message.payload[: message.payload_length]) == expected and len(expected) == 68


def test_it_comes_through_a_frame_as_it_was_sent():
    unknown = replace(MOTION, number=7, heading_rad=math.nan)
    (frame,) = FrameParser().feed(FrameEncoder(2, 191).encode(motion_message(unknown)))
    found = read(decode(frame))
    assert math.isnan(found.heading_rad)
    assert replace(found, heading_rad=0.0) == replace(unknown, heading_rad=0.0)


@pytest.mark.parametrize(
    ("at", "form", "value"),
    [(0, "B", 2), (1, "B", 0), (12, "d", math.nan), (44, "f", math.inf), (60, "f", math.inf)],
)
def test_what_is_not_possible_is_refused(at, form, value):
    message = motion_message(MOTION)
    payload = bytearray(message.payload)
    struct.pack_into(f"<{form}", payload, at, value)
    assert read_motion_payload(VEHICLE_MOTION_PAYLOAD, message.payload_length, payload) is None


@given(st.integers(0, 65_535), st.integers(0, 255), st.binary(max_size=140))
def test_whatever_comes_it_never_raises(kind, length, payload):
    for payload_type in (kind, VEHICLE_MOTION_PAYLOAD):
        found = read_motion_payload(payload_type, length, payload)
        assert found is None or all(map(math.isfinite, found.sums + found.rates))
