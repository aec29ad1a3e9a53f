"""The compiled frames of the fastest messages are the encoder's own frames, byte for byte."""

import math
from typing import Any

import pytest

from autopilot_bridge.mavlink import FrameEncoder, FrameParser, decode, definition
from autopilot_bridge.navigation import layout
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.telemetry.motion import MESSAGES
from flightsim import interface
from flightsim.world_spec import WorldSpec


@pytest.fixture(scope="module")
def flying() -> Sitl:
    """A vehicle that has booted and knows where it is."""
    sitl = Sitl(WorldSpec(seed=3))
    while sitl.time_us < 8_000_000:
        sitl.advance()
    return sitl


def test_frames_equal_the_encoders(flying: Sitl) -> None:
    autopilot = flying.vehicles[0].autopilot
    motion = autopilot._streams._motion
    builders = motion.builders
    compiled, plain = FrameEncoder(7, 1), FrameEncoder(7, 1)
    compiled.sequence = plain.sequence = 253  # wraps on the way
    due = sum(motion.bits.values())
    frames, message_ids = motion.packet(due, compiled)
    expected = [
        plain.encode_payload(definition(name).message_id, builders[definition(name).message_id]())
        for name in MESSAGES
    ]
    assert frames == b"".join(expected)
    assert compiled.sequence == plain.sequence
    assert list(message_ids) == [frame.message_id for frame in FrameParser().feed(frames)]
    one = motion.bits[definition("GLOBAL_POSITION_INT").message_id]
    assert motion.packet(one, compiled)[1] == (33,)


def test_contents_are_the_navigation_state(flying: Sitl) -> None:
    autopilot = flying.vehicles[0].autopilot
    motion = autopilot._streams._motion
    autopilot._view.advance(flying.time_us)
    parsed = FrameParser().feed(motion.packet(sum(motion.bits.values()), FrameEncoder(7, 1))[0])
    messages: dict[str, Any] = {message.get_type(): message for message in map(decode, parsed)}
    state = autopilot.navigation.state
    assert messages["ATTITUDE"].roll == pytest.approx(state[25], abs=1e-6)
    assert messages["LOCAL_POSITION_NED"].z == pytest.approx(state[12], abs=1e-5)
    assert messages["ODOMETRY"].q == pytest.approx(state[0:4].tolist(), abs=1e-6)
    place = messages["GLOBAL_POSITION_INT"]
    lat_deg, lon_deg, alt_m = autopilot.context.frame.geodetic_from_ned(*state[10:13].tolist())
    assert (place.lat, place.lon) == (round(lat_deg * 1e7), round(lon_deg * 1e7))
    assert place.alt == pytest.approx(alt_m * 1e3, abs=1.0)
    assert messages["HIGHRES_IMU"].zacc == pytest.approx(-9.8, abs=0.3)


def test_highres_imu_marks_what_is_new_since_the_one_before(flying: Sitl) -> None:
    """PX4 1.16.1: 63 with the gyro's samples, the other groups where they have a new sample."""
    autopilot = flying.vehicles[0].autopilot
    motion = autopilot._streams._motion
    readings = motion._readings
    bit = motion.bits[definition("HIGHRES_IMU").message_id]
    before = readings.magnetometer.time_us, readings.airspeed.time_us, readings.airspeed.values.copy()

    def marks(step: int) -> Any:
        autopilot._view.advance(flying.time_us + step)
        (frame,) = FrameParser().feed(motion.packet(bit, FrameEncoder(7, 1))[0])
        return decode(frame)

    try:
        assert marks(1).diff_pressure == 0.0  # a multicopter has no pitot tube
        assert (marks(2).fields_updated, marks(3).fields_updated) == (0x3F, 0x3F)
        readings.magnetometer.time_us = readings.airspeed.time_us = flying.time_us + 4
        readings.airspeed.values[interface.AIRSPEED_DIFFERENTIAL_PRESSURE_PA] = 283.0
        found = marks(4)
        assert (found.fields_updated, found.diff_pressure) == (0x3F | 0x1C0 | 0x400, 283.0)
        assert marks(5).fields_updated == 0x3F
    finally:
        readings.magnetometer.time_us, readings.airspeed.time_us = before[:2]
        readings.airspeed.values[:] = before[2]
        autopilot._view.advance(flying.time_us)


def test_global_position_has_centimetres_per_second_and_centidegrees(flying: Sitl) -> None:
    """Units of common.xml: vx, vy, vz in cm/s (north, east, down), hdg in cdeg, relative_alt in mm up."""
    autopilot = flying.vehicles[0].autopilot
    motion, state = autopilot._streams._motion, autopilot.navigation.state
    before = state.copy()
    autopilot._view.advance(flying.time_us + 1)
    try:
        state[layout.VEL_NED_M_S] = 1.23, -4.56, 2.34
        state[layout.EULER_RAD] = 0.1, -0.2, math.radians(-30.0)
        state[layout.POS_NED_M] = 3.0, 4.0, autopilot.context.home_ned_m[2] - 17.5
        bit = motion.bits[definition("GLOBAL_POSITION_INT").message_id]
        (frame,) = FrameParser().feed(motion.packet(bit, FrameEncoder(7, 1))[0])
    finally:
        state[:] = before
        autopilot._view.advance(flying.time_us)
    place: Any = decode(frame)
    assert (place.vx, place.vy, place.vz) == (123, -456, 234)
    assert place.hdg == 33_000
    assert place.relative_alt == 17_500


def test_a_single_bit_makes_a_single_frame(flying: Sitl) -> None:
    motion = flying.vehicles[0].autopilot._streams._motion
    for message_id, bit in motion.bits.items():
        (frame,) = FrameParser().feed(motion.packet(bit, FrameEncoder(1, 1))[0])
        assert frame.message_id == message_id


def test_nothing_is_said_before_there_is_an_attitude() -> None:
    sitl = Sitl(WorldSpec())
    motion = sitl.vehicles[0].autopilot._streams._motion
    local = motion.bits[definition("LOCAL_POSITION_NED").message_id]
    frames = FrameParser().feed(motion.packet(sum(motion.bits.values()), FrameEncoder(1, 1))[0])
    assert [frame.message_id for frame in frames] == [definition("LOCAL_POSITION_NED").message_id]
    assert local
