"""Scans of the target sensor on the wire: golden bytes, round trips, malformed payloads."""

import math
import struct

from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.mavlink import FrameParser, decode
from autopilot_bridge.mavlink.target_scan import (
    MAX_DETECTIONS,
    TARGET_SCAN_PAYLOAD,
    ScanEnd,
    TargetDetection,
    read_scan_payload,
    scan_messages,
)
from autopilot_bridge.payload import TARGET_SENSOR_COMPONENT
from autopilot_bridge.sitl import Sitl
from flightsim.payload import GroundTargetParameters, PayloadParameters, Static, TargetSensorParameters
from flightsim.world_spec import VehicleSpec, WorldSpec


def read(message):
    return read_scan_payload(message.payload_type, message.payload_length, message.payload)


def test_golden_bytes():
    detection, end = scan_messages(0x01020304, 0x1112131415161718, [(1.5, -0.25)])
    head = bytes.fromhex("0101000004030201 1817161514131211")
    assert bytes(detection.payload[: detection.payload_length]) == head + struct.pack("<ff", 1.5, -0.25)
    assert bytes(end.payload[: end.payload_length]) == bytes.fromhex("0102010004030201 1817161514131211")
    assert detection.payload_type == end.payload_type == TARGET_SCAN_PAYLOAD >= 32768


@given(
    st.integers(0, 2**32 - 1),
    st.integers(0, 2**63),
    st.lists(st.tuples(st.floats(0.0, 1e4, width=32), st.floats(-3.0, 3.0, width=32)), max_size=5),
)
def test_what_is_sent_is_read(scan, time_us, detections):
    *found, end = [read(message) for message in scan_messages(scan, time_us, detections)]
    assert end == ScanEnd(scan=scan, time_us=time_us, detections=len(detections))
    assert [(d.number, d.range_m, d.bearing_rad) for d in found] == [
        (k, *place) for k, place in enumerate(detections)
    ]
    assert all((d.scan, d.time_us) == (scan, time_us) for d in found)


@given(st.integers(0, 65535), st.integers(0, 255), st.binary(min_size=128, max_size=128))
def test_any_payload_is_read_or_ignored(payload_type, length, payload):
    for kind in (payload_type, TARGET_SCAN_PAYLOAD):
        found = read_scan_payload(kind, length, payload)
        assert found is None or isinstance(found, TargetDetection | ScanEnd)


def test_impossible_values_are_ignored():
    (message, _) = scan_messages(1, 1, [(1.0, 0.0)])
    for range_m, bearing in ((math.nan, 0.0), (-1.0, 0.0), (math.inf, 0.0), (1.0, math.nan), (1.0, 7.0)):
        payload = bytes(message.payload[:16]) + struct.pack("<ff", range_m, bearing)
        assert read_scan_payload(TARGET_SCAN_PAYLOAD, 24, payload) is None
    assert read_scan_payload(TARGET_SCAN_PAYLOAD, 20, bytes(message.payload)) is None  # cut off
    assert read_scan_payload(0, 24, bytes(message.payload)) is None
    assert len(scan_messages(1, 1, [(1.0, 0.0)] * (MAX_DETECTIONS + 5))) == MAX_DETECTIONS + 1


def test_the_sitl_sends_each_scan_from_the_sensors_component():
    payload = PayloadParameters(target_sensor=TargetSensorParameters(gain=1.0, period_s=0.5))
    targets = tuple(
        GroundTargetParameters(motion=Static(north_m=north_m, east_m=0.0)) for north_m in (0.5, 1.0)
    )
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(system_id=3, payload=payload),), targets=targets))
    link, parser, frames = sitl.connect(0), FrameParser(), []
    for _ in range(750):
        sitl.advance()
        for _, data in link.receive():
            frames += parser.feed(data)
    found = [decode(f) for f in frames if (f.system_id, f.component_id) == (3, TARGET_SENSOR_COMPONENT)]
    assert "HEARTBEAT" in {message.get_type() for message in found}
    scans = [read(message) for message in found if message.get_type() == "TUNNEL"]
    ends = [part for part in scans if isinstance(part, ScanEnd)]
    assert [end.scan for end in ends] == list(range(6))
    assert sum(end.detections for end in ends) == len(scans) - len(ends) > 6
