"""Whatever comes in on the bus, the components answer on, within bounds of time and memory."""

import math

import pytest

from autopilot_bridge.mavlink import FrameParser, dialect
from autopilot_bridge.payload import CAMERA_COMPONENT, GIMBAL_COMPONENT, CameraComponent, GimbalComponent
from autopilot_bridge.payload.camera_video import VideoStream
from flightsim.payload import Camera, Gimbal
from tests.payload.test_components import SYSTEM, World
from tests.system.hostile import commands, valid_frames

COMPONENTS = (0, 1, CAMERA_COMPONENT, GIMBAL_COMPONENT)


def campaign(seed: int, count: int) -> World:
    world = World()
    world.station.get(CameraComponent).stream = VideoStream("rtsp://127.0.0.1:1/camera1", 640, 360, 20.0, 1)
    hostile = [
        *valid_frames(seed, count, target=SYSTEM, components=COMPONENTS),
        *valid_frames(seed + 1, count // 4, target=SYSTEM, sender=SYSTEM, components=COMPONENTS),
        *commands(seed + 2, count, target=SYSTEM, without=(), components=COMPONENTS),
    ]
    for number, frame in enumerate(hostile):
        world.station.receive(frame)
        if number % 20 == 0:
            world.run(0.02)
        if len(world.frames) > 10_000:
            world.frames.clear()
    assert world.station.parser.counters.frames > 2 * count
    return world


def still_works(world: World) -> None:
    world.frames.clear()
    camera, gimbal = world.station.get(CameraComponent), world.station.get(GimbalComponent)
    assert len(camera.storage.log) <= 20_000
    assert math.isfinite(world.payload.get(Camera).zoom) and 1.0 <= world.payload.get(Camera).zoom <= 6.0
    control = dialect.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE
    assert world.command(GIMBAL_COMPONENT, control, 255, 190, 0, 0) == dialect.MAV_RESULT_ACCEPTED
    assert gimbal.control.primary == (255, 190)
    pitchyaw = dialect.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW
    assert world.command(GIMBAL_COMPONENT, pitchyaw, -30.0, 0.0, math.nan, math.nan, 12) == 0
    world.command(CAMERA_COMPONENT, dialect.MAV_CMD_VIDEO_STOP_CAPTURE)
    world.command(CAMERA_COMPONENT, dialect.MAV_CMD_IMAGE_STOP_CAPTURE)
    for number in (dialect.MAV_CMD_STORAGE_FORMAT, dialect.MAV_CMD_RESET_CAMERA_SETTINGS):
        assert world.command(CAMERA_COMPONENT, number, 1, 1, 1) == dialect.MAV_RESULT_ACCEPTED
    assert (
        world.command(CAMERA_COMPONENT, dialect.MAV_CMD_IMAGE_START_CAPTURE, 0, 0, 1)
        == dialect.MAV_RESULT_ACCEPTED
    )
    world.run(3.0)
    q = world.payload.get(Gimbal).measured_q_heading_from_gimbal
    assert all(map(math.isfinite, q))
    w, x, y, z = q
    assert math.degrees(math.asin(2.0 * (w * y - z * x))) == pytest.approx(-30.0, abs=1.5)
    beats = [f for f in world.frames if f.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT]
    assert len(beats) == 3 * 3


@pytest.mark.parametrize("seed", [1, 2])
def test_every_message_and_every_command_with_any_values(seed):
    still_works(campaign(seed, 3000))


@pytest.mark.slow
def test_a_long_campaign():
    still_works(campaign(100, 200_000))


def test_what_they_say_can_be_read():
    world = World()
    said = bytearray()
    world.station.get(CameraComponent)._send = said.extend
    for frame in commands(5, 3000, target=SYSTEM, without=(), components=(CAMERA_COMPONENT,)):
        world.station.receive(frame)
    world.run(0.5)
    parser = FrameParser()
    frames = parser.feed(bytes(said))
    assert len(frames) > 3000
    assert parser.counters.bytes_junk == 0
