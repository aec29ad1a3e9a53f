"""Camera protocol v2 on the wire, beyond what the first components' test covers."""

import math

import pytest

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.payload import CAMERA_COMPONENT, GIMBAL_COMPONENT, CameraComponent
from autopilot_bridge.payload.camera_video import VideoStream
from flightsim.payload import Camera
from tests.payload.test_components import HOME, SYSTEM, World
from tests.rotations import pitch_rad, yaw_rad

START = dialect.MAV_CMD_IMAGE_START_CAPTURE
ACCEPTED, DENIED, FAILED = dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_DENIED, dialect.MAV_RESULT_FAILED
AUTOPILOT = (SYSTEM, 1)


@pytest.fixture
def world() -> World:
    return World()


def say(world: World, command: int, *values: float, sender=(255, 190)) -> int | None:
    return world.command(CAMERA_COMPONENT, command, *values, sender=sender)


def place(world: World, *, vx: float = 0.0, boot_ms: int = 0) -> None:
    world.deliver(
        dialect.MAVLink_global_position_int_message(
            boot_ms,
            round(HOME.lat_deg * 1e7),
            round(HOME.lon_deg * 1e7),
            580_000,
            100_000,
            round(100 * vx),
            0,
            0,
            0,
        ),
        sender=AUTOPILOT,
    )


def photos(world: World) -> list:
    return world.messages(dialect.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED)


def settings(world: World):
    return world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_SETTINGS)


def test_a_photo_says_where_and_when_by_what_the_vehicle_reported(world):
    world.run(2.0)
    assert say(world, START, 0, 0, 1) == ACCEPTED
    unplaced = photos(world)[-1]
    assert (unplaced.lat, unplaced.lon, unplaced.time_utc) == (0, 0, 0)
    place(world)
    world.deliver(dialect.MAVLink_system_time_message(1_700_000_000_000_000, 0), sender=AUTOPILOT)
    world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -30.0, 20.0)
    world.run(2.0)
    place(world)
    assert say(world, START, 0, 0, 1) == ACCEPTED
    photo = photos(world)[-1]
    assert (photo.lat, photo.lon) == (round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7))
    assert (photo.alt, photo.relative_alt, photo.image_index, photo.capture_result) == (
        580_000,
        100_000,
        1,
        1,
    )
    assert photo.time_utc == 1_700_000_000_000_000 + 2_000_000
    assert math.degrees(pitch_rad(photo.q)) == pytest.approx(-30.0, abs=1.5)
    assert math.degrees(yaw_rad(photo.q)) == pytest.approx(20.0, abs=5)


def test_an_old_position_is_none(world):
    place(world)
    world.run(5.0)
    say(world, START, 0, 0, 1)
    assert (photos(world)[-1].lat, photos(world)[-1].alt) == (0, 0)


def test_others_positions_are_not_ours(world):
    world.deliver(
        dialect.MAVLink_global_position_int_message(0, 10, 20, 30, 40, 0, 0, 0, 0), sender=(SYSTEM + 1, 1)
    )
    say(world, START, 0, 0, 1)
    assert photos(world)[-1].lat == 0


def test_a_command_sent_again_takes_no_second_photo(world):
    for _ in range(3):
        assert say(world, START, 0, 0, 1, 7) == ACCEPTED
    assert len(photos(world)) == 1
    assert say(world, START, 0, 0, 1, 8) == ACCEPTED
    assert say(world, START, 0, 0, 1, 8, sender=(254, 190)) == ACCEPTED  # its eighth, of another component
    assert len(photos(world)) == 3
    world.run(5.0)
    assert say(world, START, 0, 0, 1, 8, sender=(254, 190)) == ACCEPTED  # he has started anew
    assert len(photos(world)) == 4


def test_what_was_lost_is_sent_again(world):
    for sequence in (1, 2, 3):
        say(world, START, 0, 0, 1, sequence)
    request = dialect.MAV_CMD_REQUEST_MESSAGE
    number = dialect.MAVLINK_MSG_ID_CAMERA_IMAGE_CAPTURED
    assert say(world, request, number, 1) == ACCEPTED
    assert [photo.image_index for photo in photos(world)] == [0, 1, 2, 1]
    first, again = photos(world)[1], photos(world)[3]
    assert first.to_dict() == again.to_dict()
    assert say(world, request, number, 3) == DENIED
    assert say(world, dialect.MAV_CMD_REQUEST_CAMERA_IMAGE_CAPTURE, 2) == ACCEPTED
    assert photos(world)[-1].image_index == 2


def test_a_single_photo_leaves_a_series_alone(world):
    assert say(world, START, 0, 0.5, 4) == ACCEPTED
    world.run(0.7)
    assert say(world, START, 0, 0, 1) == ACCEPTED
    world.run(3.0)
    assert [photo.image_index for photo in photos(world)] == list(range(5))
    status = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS)
    assert (status.image_status, status.image_interval, status.image_count) == (0, 0.0, 5)


def test_photos_by_distance(world):
    assert say(world, dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST, 10.0, 0, 1) == ACCEPTED
    assert len(photos(world)) == 1  # one at once
    for step in range(100):  # 10 s at 6 m/s
        world.run(0.1)
        place(world, vx=6.0, boot_ms=100 * step)
    assert len(photos(world)) == 1 + 5  # 59.4 m from the first message on
    assert say(world, dialect.MAV_CMD_DO_TRIGGER_CONTROL, 0, -1, -1) == ACCEPTED
    for _ in range(50):
        world.run(0.1)
        place(world, vx=6.0)
    assert len(photos(world)) == 6
    assert say(world, dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST, math.nan) == DENIED
    assert say(world, dialect.MAV_CMD_DO_SET_CAM_TRIGG_DIST, 0.0) == ACCEPTED


def test_photos_by_time_pause_and_go_on(world):
    assert say(world, dialect.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL, 500.0) == ACCEPTED
    world.run(1.9)
    assert len(photos(world)) == 4
    assert say(world, dialect.MAV_CMD_DO_TRIGGER_CONTROL, -1, -1, 1) == ACCEPTED
    world.run(2.0)
    assert len(photos(world)) == 4
    assert say(world, dialect.MAV_CMD_DO_TRIGGER_CONTROL, -1, -1, 0) == ACCEPTED
    world.run(0.1)
    assert len(photos(world)) > 4
    assert say(world, dialect.MAV_CMD_DO_TRIGGER_CONTROL, 5, 0, 0) == DENIED


def test_the_old_shutter_command(world):
    assert say(world, dialect.MAV_CMD_DO_DIGICAM_CONTROL, 0, 0, 0, 0, 1) == ACCEPTED
    assert say(world, dialect.MAV_CMD_DO_DIGICAM_CONTROL) == ACCEPTED  # nothing is requested
    assert len(photos(world)) == 1


def test_videos(world):
    start, stop = dialect.MAV_CMD_VIDEO_START_CAPTURE, dialect.MAV_CMD_VIDEO_STOP_CAPTURE
    assert say(world, start, 0, 2.0) == ACCEPTED
    before = len(world.messages(dialect.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS))
    world.run(5.0)
    reported = world.messages(dialect.MAVLINK_MSG_ID_CAMERA_CAPTURE_STATUS)[before:]
    assert len(reported) == 10
    assert [status.recording_time_ms for status in reported] == [500 * n for n in range(1, 11)]
    assert {status.video_status for status in reported} == {1}
    assert say(world, start, 0, 0) == dialect.MAV_RESULT_TEMPORARILY_REJECTED
    assert say(world, dialect.MAV_CMD_STORAGE_FORMAT, 1, 1, 1) == dialect.MAV_RESULT_TEMPORARILY_REJECTED
    assert say(world, stop) == ACCEPTED
    assert say(world, stop) == ACCEPTED
    storage = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_STORAGE_INFORMATION)
    assert storage.used_capacity == pytest.approx(5.0)
    assert say(world, dialect.MAV_CMD_STORAGE_FORMAT, 1, 1, 1) == ACCEPTED
    assert say(world, start, 9) == DENIED
    assert say(world, start, 0, math.nan) == DENIED


def test_a_full_card_takes_no_more(world):
    camera = world.station.get(CameraComponent)
    camera.storage.used_mib = 32_768.0 - 9.0
    assert say(world, START, 0, 0.2, 0) == ACCEPTED
    world.run(2.0)
    assert len(photos(world)) == 2
    assert say(world, START, 0, 0, 1) == FAILED
    assert say(world, dialect.MAV_CMD_VIDEO_START_CAPTURE) == FAILED
    assert say(world, dialect.MAV_CMD_STORAGE_FORMAT, 1, 1, 0) == ACCEPTED
    assert say(world, START, 0, 0, 1) == ACCEPTED
    assert photos(world)[-1].image_index == 2


def test_zoom_narrows_what_is_seen(world):
    zoom = dialect.MAV_CMD_SET_CAMERA_ZOOM
    information = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION)
    assert say(world, zoom, dialect.ZOOM_TYPE_RANGE, 100.0) == ACCEPTED
    assert settings(world).zoomLevel == pytest.approx(100.0)
    long = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION)
    assert long.focal_length == pytest.approx(6.0 * information.focal_length)
    fov = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_FOV_STATUS)
    assert fov.hfov == pytest.approx(math.degrees(2 * math.atan(math.tan(math.radians(30)) / 6)), rel=1e-4)
    assert say(world, zoom, dialect.ZOOM_TYPE_FOCAL_LENGTH, 2.0 * information.focal_length) == ACCEPTED
    assert settings(world).zoomLevel == pytest.approx(20.0)
    assert say(world, zoom, dialect.ZOOM_TYPE_HORIZONTAL_FOV, 60.0) == ACCEPTED
    assert settings(world).zoomLevel == pytest.approx(0.0, abs=1e-3)
    assert say(world, zoom, dialect.ZOOM_TYPE_STEP, 1.0) == ACCEPTED
    assert settings(world).zoomLevel == pytest.approx(5.0)
    assert say(world, zoom, dialect.ZOOM_TYPE_CONTINUOUS, 1.0) == ACCEPTED
    world.run(1.0)
    part = settings(world).zoomLevel
    assert 5.0 < part < 60.0
    world.run(5.0)
    assert settings(world).zoomLevel == pytest.approx(100.0)
    for kind, value in (
        (2, 101.0),
        (2, -1.0),
        (3, 1.0),
        (4, 0.0),
        (4, 90.0),
        (9, 1.0),
        (1, 2.0),
        (2, math.nan),
    ):
        assert say(world, zoom, kind, value) == DENIED
    assert settings(world).zoomLevel == pytest.approx(100.0)


def test_focus_and_reset(world):
    focus = dialect.MAV_CMD_SET_CAMERA_FOCUS
    assert math.isnan(settings(world).focusLevel)  # automatic
    assert say(world, focus, dialect.FOCUS_TYPE_METERS, 5.0) == ACCEPTED
    assert settings(world).focusLevel == pytest.approx(90.0)
    assert say(world, focus, dialect.FOCUS_TYPE_RANGE, 0.0) == ACCEPTED
    assert world.payload.get(Camera).focus_distance_m == pytest.approx(0.5)
    assert say(world, focus, dialect.FOCUS_TYPE_CONTINUOUS, 1.0) == ACCEPTED
    world.run(6.0)
    assert settings(world).focusLevel == pytest.approx(100.0)
    assert say(world, focus, dialect.FOCUS_TYPE_METERS, 0.1) == DENIED
    world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -90.0)
    world.run(3.0)
    assert say(world, focus, dialect.FOCUS_TYPE_AUTO_SINGLE) == ACCEPTED
    assert world.payload.get(Camera).focus_distance_m == pytest.approx(100.0, rel=0.02)
    say(world, dialect.MAV_CMD_SET_CAMERA_MODE, 0, dialect.CAMERA_MODE_VIDEO)
    say(world, dialect.MAV_CMD_SET_CAMERA_ZOOM, dialect.ZOOM_TYPE_RANGE, 40.0)
    assert (settings(world).mode_id, settings(world).zoomLevel) == (
        dialect.CAMERA_MODE_VIDEO,
        pytest.approx(40.0),
    )
    assert say(world, dialect.MAV_CMD_RESET_CAMERA_SETTINGS, 1) == ACCEPTED
    assert (settings(world).mode_id, settings(world).zoomLevel) == (dialect.CAMERA_MODE_IMAGE, 0.0)
    assert math.isnan(settings(world).focusLevel)


def test_flags_tell_what_there_is(world):
    flags = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION).flags
    assert not flags & dialect.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM
    number = dialect.MAVLINK_MSG_ID_VIDEO_STREAM_INFORMATION
    assert say(world, dialect.MAV_CMD_REQUEST_MESSAGE, number) == dialect.MAV_RESULT_UNSUPPORTED
    assert say(world, dialect.MAV_CMD_VIDEO_START_STREAMING) == dialect.MAV_RESULT_UNSUPPORTED
    world.station.get(CameraComponent).stream = VideoStream(
        "rtsp://127.0.0.1:8554/camera1", 640, 360, 20.0, 2_000_000
    )
    flags = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_INFORMATION).flags
    assert flags & dialect.CAMERA_CAP_FLAGS_HAS_VIDEO_STREAM
    stream = world.request(CAMERA_COMPONENT, number)
    assert (stream.stream_id, stream.count, stream.type) == (1, 1, dialect.VIDEO_STREAM_TYPE_RTSP)
    assert stream.uri == "rtsp://127.0.0.1:8554/camera1"
    assert say(world, dialect.MAV_CMD_VIDEO_STOP_STREAMING, 1) == ACCEPTED
    status = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_VIDEO_STREAM_STATUS)
    assert status.flags & dialect.VIDEO_STREAM_STATUS_FLAGS_RUNNING == 0
    assert say(world, dialect.MAV_CMD_REQUEST_MESSAGE, number, 2) == DENIED


def test_the_middle_of_the_picture_on_the_ground(world):
    world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -45.0)
    world.run(3.0)
    place(world)
    fov = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_FOV_STATUS)
    north_m = (fov.lat_image * 1e-7 - HOME.lat_deg) * 111_180.0
    assert north_m == pytest.approx(100.0, abs=4.0)
    assert fov.alt_image == 480_000
    world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, 10.0)
    world.run(3.0)
    place(world)
    assert (
        world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_FOV_STATUS).lat_image == 2**31 - 1
    )  # sky


def test_a_thing_is_followed_and_lost(world):
    world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, -45.0, 90.0)
    assert say(world, dialect.MAV_CMD_CAMERA_TRACK_POINT, 0.5, 0.5, 0.1) == FAILED  # nothing there yet
    world.run(4.0)
    place(world)
    for _ in range(20):  # a frame may miss it
        if say(world, dialect.MAV_CMD_CAMERA_TRACK_POINT, 0.5, 0.5, 0.1) == ACCEPTED:
            break
        world.run(0.1)
    status = world.messages(dialect.MAVLINK_MSG_ID_CAMERA_TRACKING_IMAGE_STATUS)[-1]
    assert (status.tracking_status & 1, status.tracking_mode) == (1, dialect.CAMERA_TRACKING_MODE_POINT)
    assert (status.point_x, status.point_y) == pytest.approx((0.5, 0.5), abs=0.06)
    geo = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_TRACKING_GEO_STATUS)
    assert (geo.lon * 1e-7 - HOME.lon_deg) * 75_370.0 == pytest.approx(100.0, abs=5.0)
    world.command(GIMBAL_COMPONENT, dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, 20.0, 0.0)
    world.run(0.6)
    coasting = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_TRACKING_IMAGE_STATUS)
    assert coasting.tracking_status == dialect.CAMERA_TRACKING_STATUS_FLAGS_ACTIVE | 8
    world.run(4.0)
    lost = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_TRACKING_IMAGE_STATUS)
    assert lost.tracking_status == dialect.CAMERA_TRACKING_STATUS_FLAGS_ERROR
    assert say(world, dialect.MAV_CMD_CAMERA_STOP_TRACKING) == ACCEPTED
    idle = world.request(CAMERA_COMPONENT, dialect.MAVLINK_MSG_ID_CAMERA_TRACKING_IMAGE_STATUS)
    assert idle.tracking_status == dialect.CAMERA_TRACKING_STATUS_FLAGS_IDLE
