"""The pose of a vehicle at an exposure, and the place that its camera sees."""

import math

import pytest

from autopilot_bridge.mavlink import definition
from autopilot_bridge.mavlink.camera_scan import CameraScan, camera_scan_message, read_camera_scan
from estimators.messages import message_class
from estimators.vision import VehiclePose, VehicleTrack, ground_place
from flightsim.foundation.vectors import from_euler

SCAN = CameraScan(
    number=3,
    time_us=1_234_567,
    detections=0,
    width_px=1280,
    height_px=720,
    focal_px=900.0,
    distortion=(0.1, 0.0, 0.0, 0.0, 0.0),
    mount_rad=(0.0, -0.5 * math.pi, 0.0),
    position_frd_m=(0.0, 0.0, 0.0),
)


def message(name, **values):
    made = message_class(definition(name))
    return made._make(
        {"src_system": 1, "src_component": 1}.get(field, values.get(field, 0)) for field in made._fields
    )


def track_of(*times_ms):
    track = VehicleTrack()
    for t in times_ms:
        track.handle(message("ATTITUDE", time_boot_ms=t, roll=0.001 * t, pitch=0.0, yaw=0.0))
        track.place(1000 * t, (0.01 * t, 0.0, -10.0))
    return track


def test_a_pose_is_between_the_messages_around_it():
    pose = track_of(100, 200, 300).at(250_000)
    assert pose.pos_ned_m == pytest.approx((2.5, 0.0, -10.0))
    assert pose.q_ned_from_frd == pytest.approx(from_euler(0.25, 0.0, 0.0), abs=1e-4)


def test_a_frame_without_attitude_near_its_time_has_no_pose():
    track = track_of(1000, 1100)
    assert track.at(1_250_000) is not None
    assert track.at(1_300_000) is None
    assert track.at(700_000) is None
    assert VehicleTrack().at(0) is None


def test_a_vehicle_that_boots_again_has_a_new_track():
    track = track_of(100_000, 100_100, 50, 150)
    assert track.at(100_000).pos_ned_m[0] == pytest.approx(1.0)
    assert track.at(100_000_000) is None


def test_values_that_are_not_finite_are_ignored():
    track = track_of(100, 200)
    track.handle(message("ATTITUDE", time_boot_ms=210, roll=math.nan))
    assert track.at(205_000).q_ned_from_frd == pytest.approx(from_euler(0.2, 0.0, 0.0))


def test_a_camera_that_looks_down_sees_what_is_below():
    pose = VehiclePose(q_ned_from_frd=from_euler(0.0, 0.0, 0.0), pos_ned_m=(5.0, 7.0, -10.0))
    assert ground_place(pose, SCAN, 0.0, 0.0) == pytest.approx((5.0, 7.0))
    assert ground_place(pose, SCAN, math.atan(0.2), math.atan(-0.3)) == pytest.approx((8.0, 9.0))
    east = VehiclePose(q_ned_from_frd=from_euler(0.0, 0.0, 0.5 * math.pi), pos_ned_m=(5.0, 7.0, -10.0))
    assert ground_place(east, SCAN, math.atan(0.2), 0.0) == pytest.approx((3.0, 7.0))
    rolled = VehiclePose(q_ned_from_frd=from_euler(0.1, 0.0, 0.0), pos_ned_m=(0.0, 0.0, -10.0))
    assert ground_place(rolled, SCAN, 0.0, 0.0) == pytest.approx((0.0, -10.0 * math.tan(0.1)))
    over = VehiclePose(q_ned_from_frd=from_euler(3.0, 0.0, 0.0), pos_ned_m=(0.0, 0.0, -10.0))
    assert ground_place(over, SCAN, 0.0, 0.0) is None


def test_the_message_of_a_scan_is_read_back():
    sent = camera_scan_message(SCAN)
    found = read_camera_scan(sent.payload_type, sent.payload_length, sent.payload)
    assert found.number == 3 and found.time_us == 1_234_567 and found.detections == 0
    assert found.focal_px == 900.0 and found.mount_rad == pytest.approx(SCAN.mount_rad)
    assert found.distortion == pytest.approx(SCAN.distortion)


@pytest.mark.parametrize("place, value", [(0, 2), (1, 9), (16, 0), (23, 255), (3, None)])
def test_a_malformed_scan_is_no_scan(place, value):
    sent = camera_scan_message(SCAN)
    payload, length = list(sent.payload), sent.payload_length
    if value is None:
        length -= 1
    elif place == 16:
        payload[16] = payload[17] = 0
    elif place == 23:
        payload[20:24] = (0, 0, 192, 127)  # NaN
    else:
        payload[place] = value
    assert read_camera_scan(sent.payload_type, length, payload) is None
    assert read_camera_scan(0xF516, sent.payload_length, sent.payload) is None
