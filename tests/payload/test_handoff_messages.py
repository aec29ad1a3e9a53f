"""Moving points, track reports and decisions on the wire: golden bytes, round trips, malformed payloads."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from autopilot_bridge.mavlink.handoff_messages import (
    HANDOFF_DECISION_PAYLOAD,
    TRACK_DESIGNATION_PAYLOAD,
    TRACK_REPORT_PAYLOAD,
    HandoffDecision,
    ReportedTrack,
    TrackDesignation,
    decision_message,
    designation_message,
    read_decision,
    read_designation,
    read_track_report,
    track_report_messages,
)
from autopilot_bridge.mavlink.moving_points import (
    MOVING_POINTS_PAYLOAD,
    moving_points_messages,
    read_moving_points,
)

READERS = {
    MOVING_POINTS_PAYLOAD: read_moving_points,
    TRACK_REPORT_PAYLOAD: read_track_report,
    HANDOFF_DECISION_PAYLOAD: read_decision,
    TRACK_DESIGNATION_PAYLOAD: read_designation,
}
TRACK = ReportedTrack(
    number=5,
    place_m=(100.5, -20.25),
    velocity_m_s=(1.5, -0.5),
    covariance_m2=(4.0, 1.0, 2.0),
    velocity_sigma_m_s=0.25,
)
TRACK_BYTES = struct.pack("<H8f", 5, 100.5, -20.25, 1.5, -0.5, 4.0, 1.0, 2.0, 0.25)


def read(message):
    return READERS[message.payload_type](message.payload_type, message.payload_length, message.payload)


def sent(message):
    return bytes(message.payload[: message.payload_length])


def report(tracks, **changes):
    values = {"system": 2, "report": 1, "time_us": 5_000_000, "target": 5, "identity": 0.75}
    return track_report_messages(**{**values, "released": False, **changes}, tracks=tracks)


def decision(**changes):
    values = {"system": 1, "number": 3, "time_us": 7, "decided": True, "target": 9, "probability": 0.5}
    return decision_message(HandoffDecision(**{**values, "track": TRACK, **changes}))


def test_golden_bytes_of_moving_points():
    (message,) = moving_points_messages(0x01020304, 0x1112131415161718, [(0.5, -0.25)], 0.125)
    head = bytes.fromhex("01010001" + "04030201" + "1817161514131211")
    assert sent(message) == head + struct.pack("<fff", 0.125, 0.5, -0.25)
    assert read(message).points == ((0.5, -0.25),) and read(message).last
    (empty,) = moving_points_messages(7, 8, [], 0.125)
    assert read(empty).total == 0 and read(empty).last  # the end of a frame in which nothing moves


def test_golden_bytes_of_a_report_and_a_decision():
    (message,) = report([TRACK], released=True)
    head = bytes.fromhex("01010001" + "01000000") + struct.pack("<QfHBB", 5_000_000, 0.75, 5, 1, 2)
    assert sent(message) == head + TRACK_BYTES
    message = decision()
    assert sent(message) == struct.pack("<BBBBHIQf", 1, 1, 1, 0, 9, 3, 7, 0.5) + TRACK_BYTES
    assert read(message) == HandoffDecision(
        system=1, number=3, time_us=7, decided=True, target=9, probability=0.5, track=TRACK
    )


def test_golden_bytes_of_a_designation():
    message = designation_message(TrackDesignation(system=2, track=0x0304))
    assert sent(message) == bytes.fromhex("01020403")
    assert read(message) == TrackDesignation(system=2, track=0x0304)
    assert read(designation_message(TrackDesignation(system=2, track=0))) is None
    assert read(designation_message(TrackDesignation(system=0, track=1))) is None


@given(
    st.lists(st.tuples(st.floats(-20.0, 20.0, width=32), st.floats(-20.0, 20.0, width=32)), max_size=60),
    st.integers(0, 2**32 - 1),
    st.integers(0, 2**63),
)
def test_scans_of_any_size_are_read_as_they_were_sent(points, scan, time_us):
    found = [read(message) for message in moving_points_messages(scan, time_us, points, 0.5)]
    assert [point for part in found for point in part.points] == points
    assert all((part.scan, part.time_us, part.total) == (scan, time_us, len(points)) for part in found)
    assert [part.last for part in found] == [False] * (len(found) - 1) + [True]


@pytest.mark.parametrize("count", [0, 1, 3, 4, 8])
def test_reports_of_any_size_are_read_as_they_were_sent(count):
    found = [read(message) for message in report([TRACK] * count)]
    assert sum(len(part.tracks) for part in found) == count == found[-1].total
    assert [part.last for part in found] == [False] * (len(found) - 1) + [True]
    assert all(track == TRACK for part in found for track in part.tracks)


@pytest.mark.parametrize(
    "changes",
    [
        {"place_m": (math.nan, 0.0)},
        {"velocity_m_s": (math.inf, 0.0)},
        {"covariance_m2": (1.0, 2.0, 1.0)},
        {"covariance_m2": (-1.0, 0.0, 1.0)},
        {"velocity_sigma_m_s": 0.0},
        {"number": 0},
        {"place_m": (1e6, 0.0)},
    ],
)
def test_tracks_that_are_not_possible_are_not_read(changes):
    from dataclasses import replace

    track = replace(TRACK, **changes)
    assert read(decision(track=track)) is None
    assert [read(message) for message in report([track])] == [None]


def test_probabilities_that_are_not_possible_are_not_read():
    assert read(decision(system=0)) is None and read(report([TRACK], system=0)[0]) is None
    assert read(decision(probability=1.5)) is None and read(decision(probability=math.nan)) is None
    assert read(report([TRACK], identity=-0.1)[0]) is None
    assert read(moving_points_messages(0, 0, [(0.1, 0.1)], 0.0)[0]) is None
    assert read(moving_points_messages(0, 0, [(math.nan, 0.1)], 0.1)[0]) is None


@given(st.integers(0, 255), st.binary(min_size=128, max_size=128))
def test_any_payload_is_read_or_ignored(length, payload):
    for kind, reader in READERS.items():
        assert reader(kind ^ 1, length, payload) is None
        for version in (b"", b"\x01"):
            found = reader(kind, length, version + payload[len(version) :])
            assert found is None or hasattr(found, "time_us") or found.track
