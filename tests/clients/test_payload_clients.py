"""Camera and gimbal beside the autopilot, as MAVSDK's plugins and a mavutil script find and use them: on an
aircraft that is parked, and on a multicopter that hovers over a target.
"""

import asyncio
import math
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from typing import Any

import pytest
from pymavlink.dialects.v20 import all as mavlink

from tests.clients.mavutil_client import Client
from tests.clients.sitl_process import free_port, running_sitl
from tests.slow import slow

SPEEDUP = 8.0
CAMERA, GIMBAL = 100, 154
HEIGHT_M = 15.0
TARGET = "8,1"  # m; a gimbal that looks down by 60 degrees from that height has it in the picture


@pytest.fixture(scope="module", params=["px4", slow("ardupilot")])
def parked(request: pytest.FixtureRequest) -> Iterator[int]:
    """The port of an aircraft's link."""
    port = free_port()
    options = ("--model", "aerosonde", "--camera", "--video", "0")
    with running_sitl(request.param, [f"udpout:127.0.0.1:{port}"], speedup=SPEEDUP, options=options):
        yield port


@pytest.fixture(scope="module", params=[slow("px4"), "ardupilot"])
def hovering(request: pytest.FixtureRequest) -> Iterator[tuple[Client, int]]:
    """A mavutil client of a multicopter beside a target, and the port of the multicopter's other link."""
    port, other_port = free_port(), free_port()
    links = [f"udpout:127.0.0.1:{port}", f"udpout:127.0.0.1:{other_port}"]
    options = ("--camera", "--target", TARGET, "--video", "0")
    with running_sitl(request.param, links, speedup=SPEEDUP, options=options):
        client = Client(request.param, f"udpin:127.0.0.1:{port}", speedup=SPEEDUP)
        client.take_off(HEIGHT_M)
        yield client, other_port
        client.link.close()


async def use_gimbal(system: Any) -> None:
    from mavsdk.asyncio.plugins.gimbal import GimbalAsync
    from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
    from mavsdk.plugins.gimbal import Attitude, ControlMode, GimbalMode, SendMode

    from tests.clients.mavsdk_waiting import first

    gimbal = GimbalAsync(system)

    async def looks(what: str, found: Callable[[Attitude], bool]) -> None:
        await first(gimbal.subscribe_attitude(), found, what)

    async def has_control(mode: ControlMode) -> None:
        await first(gimbal.subscribe_control_status(), lambda s: s.control_mode == mode, f"control {mode}")

    found = await first(gimbal.subscribe_gimbal_list(), lambda known: known.gimbals, "gimbal")
    item = found.gimbals[0]
    assert (item.vendor_name, item.gimbal_device_id) == ("flightstack", GIMBAL)
    number = item.gimbal_id
    await gimbal.take_control(number, ControlMode.PRIMARY)
    await has_control(ControlMode.PRIMARY)
    await gimbal.set_angles(number, 0.0, -50.0, 30.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
    await looks(
        "angles",
        lambda a: (
            abs(a.euler_angle_forward.pitch_deg + 50.0) < 1.0
            and abs(a.euler_angle_forward.yaw_deg - 30.0) < 1.0
        ),
    )
    await gimbal.set_angular_rates(number, 0.0, 0.0, 10.0, GimbalMode.YAW_FOLLOW, SendMode.ONCE)
    await looks("turning", lambda a: a.euler_angle_forward.yaw_deg > 45.0)
    here = await first(
        TelemetryAsync(system).subscribe_position(), lambda p: abs(p.latitude_deg) > 1.0, "position"
    )
    # a point 100 m north and 100 m down; the frame that MAVSDK sends says that heights are over home
    north_deg = 100.0 / math.radians(6_371_000.0)
    await gimbal.set_roi_location(number, here.latitude_deg + north_deg, here.longitude_deg, -100.0)
    await looks(
        "region of interest",
        lambda a: abs(a.euler_angle_north.pitch_deg + 45.0) < 1.5 and abs(a.euler_angle_north.yaw_deg) < 3.0,
    )
    await gimbal.release_control(number)
    await has_control(ControlMode.NONE)


async def use_camera(system: Any) -> None:
    from mavsdk.asyncio.plugins.camera import CameraAsync
    from mavsdk.plugins.camera import Mode, PhotosRange

    from tests.clients.mavsdk_waiting import WALL_DEADLINE_S, first

    camera = CameraAsync(system)

    async def pictures(stream: AsyncIterator[Any], count: int) -> list[int]:
        return [(await first(stream, lambda info: info.is_success, "picture")).index for _ in range(count)]

    found = await first(camera.subscribe_camera_list(), lambda known: known.cameras, "camera")
    information = found.cameras[0]
    assert (information.vendor_name, information.component_id) == ("flightstack", CAMERA)
    assert information.horizontal_resolution_px > 0 and information.focal_length_mm > 0.0
    number = information.component_id
    await camera.set_mode(number, Mode.PHOTO)
    taken = camera.subscribe_capture_info()
    waiting = asyncio.ensure_future(pictures(taken, 1))
    await first(camera.subscribe_storage(), lambda update: update.storage.total_storage_mib > 0.0, "storage")
    await camera.take_photo(number)
    assert await asyncio.wait_for(waiting, WALL_DEADLINE_S) == [0]
    await camera.start_photo_interval(number, 0.5)
    assert await asyncio.wait_for(pictures(taken, 3), WALL_DEADLINE_S) == [1, 2, 3]
    await camera.stop_photo_interval(number)
    assert len(await camera.list_photos(number, PhotosRange.ALL)) >= 4


async def use_lens_and_video(system: Any) -> None:
    from mavsdk.asyncio.plugins.camera import CameraAsync
    from mavsdk.plugins.camera import Mode, Option, Setting

    from tests.clients.mavsdk_waiting import first

    camera = CameraAsync(system)
    await first(camera.subscribe_camera_list(), lambda known: known.cameras, "camera")
    await camera.zoom_range(CAMERA, 50.0)
    await camera.zoom_in_start(CAMERA)
    await camera.zoom_stop(CAMERA)
    await camera.zoom_range(CAMERA, 0.0)
    await camera.focus_meters(CAMERA, 20.0)
    await camera.focus_in_start(CAMERA)
    await camera.focus_stop(CAMERA)
    await camera.focus_auto_continuous(CAMERA)
    await camera.set_mode(CAMERA, Mode.VIDEO)
    assert await camera.get_mode(CAMERA) == Mode.VIDEO
    await camera.start_video(CAMERA)
    await first(camera.subscribe_storage(), lambda update: update.storage.video_on, "a running video")
    await camera.stop_video(CAMERA)
    shown = await first(
        camera.subscribe_video_stream_info(), lambda u: u.video_stream_info.settings.uri, "video stream"
    )
    assert shown.video_stream_info.settings.uri.startswith("rtsp://127.0.0.1:")
    known = await camera.get_possible_setting_options(CAMERA)
    assert {item.setting_id for item in known} >= {"CAM_PHOTOQUAL", "CAM_AUTOFOCUS"}
    await camera.set_setting(CAMERA, Setting("CAM_PHOTOQUAL", "", Option("75", ""), False))
    chosen = await camera.get_setting(CAMERA, Setting("CAM_PHOTOQUAL", "", Option("", ""), False))
    assert chosen.option.option_id == "75"
    await camera.stop_video_streaming(CAMERA, 1)
    await camera.start_video_streaming(CAMERA, 1)
    await camera.format_storage(CAMERA, 1)
    await camera.reset_settings(CAMERA)


async def track_target(system: Any) -> None:
    from mavsdk.asyncio.plugins.camera import CameraAsync
    from mavsdk.asyncio.plugins.gimbal import GimbalAsync
    from mavsdk.plugins.camera import CameraError
    from mavsdk.plugins.gimbal import ControlMode, GimbalMode, SendMode

    from tests.clients.mavsdk_waiting import first

    camera, gimbal = CameraAsync(system), GimbalAsync(system)
    await first(camera.subscribe_camera_list(), lambda known: known.cameras, "camera")
    found = await first(gimbal.subscribe_gimbal_list(), lambda known: known.gimbals, "gimbal")
    number = found.gimbals[0].gimbal_id
    await gimbal.take_control(number, ControlMode.PRIMARY)
    await gimbal.set_angles(number, 0.0, -60.0, 0.0, GimbalMode.YAW_LOCK, SendMode.ONCE)
    with pytest.raises(CameraError):
        await camera.track_point(CAMERA, 0.01, 0.99, 0.001)  # nothing is there
    for _ in range(50):
        try:
            await camera.track_rectangle(CAMERA, 0.2, 0.2, 0.8, 0.8)
            break
        except CameraError:  # the gimbal is still on its way, or this very frame has no detection
            await asyncio.sleep(0.1)
    else:
        raise AssertionError("the target was not tracked")
    await camera.track_stop(CAMERA)
    await gimbal.release_control(number)


def with_mavsdk(port: int, *uses: Callable[[Any], Awaitable[None]]) -> None:
    """Run each on a system of MAVSDK's."""
    pytest.importorskip("mavsdk", reason="the MAVSDK client library is not installed")
    from tests.clients.mavsdk_waiting import ground_station

    async def use_all() -> None:
        async with ground_station(f"udpin://127.0.0.1:{port}") as system:
            for use in uses:
                await use(system)

    asyncio.run(use_all())


@pytest.mark.compatibility(client="MAVSDK asyncio", feature="camera, gimbal", parameter="parked", plane=True)
def test_mavsdk_uses_gimbal_and_camera(parked: int) -> None:
    with_mavsdk(parked, use_gimbal, use_camera, use_lens_and_video)


@pytest.mark.compatibility(client="MAVSDK asyncio", feature="camera tracking", parameter="hovering")
@pytest.mark.slow
def test_mavsdk_tracks_a_target(hovering: tuple[Client, int]) -> None:
    _, port = hovering
    with_mavsdk(port, track_target)


@pytest.mark.compatibility(
    client="pymavlink (mavutil)", feature="LANDING_TARGET of the camera", parameter="hovering"
)
def test_mavutil_sees_a_target(hovering: tuple[Client, int]) -> None:
    client, _ = hovering
    client.link.mav.command_long_send(
        1,
        GIMBAL,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
        0,
        -60.0,
        0.0,
        0,
        0,
        mavlink.GIMBAL_MANAGER_FLAGS_YAW_LOCK,
        0,
        GIMBAL,
    )
    ack = client.until(
        "gimbal's answer", lambda m: m.get_type() == "COMMAND_ACK" and m.get_srcComponent() == GIMBAL
    )
    assert ack.result == mavlink.MAV_RESULT_ACCEPTED
    seen = client.until("target", lambda m: m.get_type() == "LANDING_TARGET" and abs(m.angle_y) < 0.1)
    assert (seen.get_srcComponent(), seen.frame) == (CAMERA, mavlink.MAV_FRAME_BODY_FRD)
    assert abs(seen.angle_x) < math.radians(12.0)
