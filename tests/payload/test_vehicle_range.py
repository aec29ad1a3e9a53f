"""Ranges between vehicles on the wire: golden bytes, round trips, malformed payloads, two vehicles."""

import math
import struct

from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.mavlink import FrameParser, decode
from autopilot_bridge.mavlink.vehicle_range import (
    VEHICLE_RANGE_PAYLOAD,
    VehicleRange,
    range_message,
    read_range_payload,
)
from autopilot_bridge.payload import RANGE_RADIO_COMPONENT
from autopilot_bridge.sitl import Sitl
from flightsim.payload import PayloadParameters, RangeRadioParameters
from flightsim.world_spec import VehicleSpec, WorldSpec


def read(message):
    return read_range_payload(message.payload_type, message.payload_length, message.payload)


def test_golden_bytes():
    message = range_message(
        VehicleRange(to_system=7, number=0x0203, time_us=0x1112131415161718, range_m=1.5, sigma_m=-0.25)
    )
    expected = bytes.fromhex("01070302") + struct.pack("<f", -0.25) + bytes.fromhex("1817161514131211")
    assert bytes(message.payload[: message.payload_length]) == expected + struct.pack("<f", 1.5)
    assert message.payload_type == VEHICLE_RANGE_PAYLOAD >= 32768
    assert read(message) is None  # a negative standard deviation


@given(
    st.integers(1, 255),
    st.integers(0, 65535),
    st.integers(0, 2**63),
    st.floats(0.0, 1e5, width=32),
    st.floats(0.125, 1e3, width=32),
)
def test_what_is_sent_is_read(system, number, time_us, range_m, sigma_m):
    sent = VehicleRange(to_system=system, number=number, time_us=time_us, range_m=range_m, sigma_m=sigma_m)
    assert read(range_message(sent)) == sent


@given(st.integers(0, 65535), st.integers(0, 255), st.binary(min_size=128, max_size=128))
def test_any_payload_is_read_or_ignored(payload_type, length, payload):
    for kind in (payload_type, VEHICLE_RANGE_PAYLOAD):
        found = read_range_payload(kind, length, payload)
        assert found is None or (
            math.isfinite(found.range_m) and found.range_m >= 0.0 and found.sigma_m > 0.0
        )


def test_two_vehicles_measure_each_other_and_a_third_without_a_radio_is_left_out():
    radio = PayloadParameters(range_radio=RangeRadioParameters(sigma_m=0.1, missing=0.0))
    vehicles = (
        VehicleSpec(payload=radio, offset_ne_m=(0.0, 0.0)),
        VehicleSpec(payload=radio, offset_ne_m=(30.0, 40.0), system_id=2),
        VehicleSpec(offset_ne_m=(60.0, 0.0), system_id=3),
    )
    sitl = Sitl(WorldSpec(vehicles=vehicles))
    links = [sitl.connect(index) for index in (0, 1)]
    frames, parsers = ([], []), (FrameParser(), FrameParser())
    for _ in range(250):
        sitl.advance()
        for link, parser, kept in zip(links, parsers, frames, strict=True):
            for _, data in link.receive():
                kept += parser.feed(data)
    for own, other, kept in ((1, 2, frames[0]), (2, 1, frames[1])):
        sent = [decode(f) for f in kept if (f.system_id, f.component_id) == (own, RANGE_RADIO_COMPONENT)]
        found = [read(message) for message in sent if message.get_type() == "TUNNEL"]
        assert len(found) == 10 and {one.to_system for one in found} == {other}
        assert all(abs(one.range_m - 50.0) < 1.0 for one in found)
        assert all(math.isclose(one.sigma_m, 0.1, rel_tol=1e-6) for one in found)
