"""Pictures change nothing of a flight: the same bytes whether a client watches, keeps them, or not."""

from pathlib import Path

import pytest

from autopilot_bridge.mavlink import FrameEncoder, dialect
from autopilot_bridge.payload import CameraComponent
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.video import VideoParameters
from autopilot_bridge.video.for_sitl import show_cameras
from flightsim.payload import (
    CameraParameters,
    GimbalParameters,
    GroundTargetParameters,
    PayloadParameters,
    RandomWalk,
)
from flightsim.world_spec import VehicleSpec, WorldSpec

TARGET = GroundTargetParameters(
    motion=RandomWalk(south_m=-30.0, west_m=-30.0, north_m=30.0, east_m=30.0, speed_m_s=3.0, leg_s=0.7),
    tag_id=2,
)


def flight(tmp_path: Path | None, *, look: bool) -> bytes:
    sitl = Sitl(
        WorldSpec(
            vehicles=(
                VehicleSpec(payload=PayloadParameters(gimbal=GimbalParameters(), camera=CameraParameters())),
            ),
            targets=(TARGET,),
            seed=5,
        )
    )
    said = bytearray()
    link = sitl.connect(0)
    link.on_receive = said.extend
    service = None
    lost: list[str] = []
    if tmp_path is not None:
        # the photos' names are reported; a stream would be, too
        service = show_cameras(sitl, VideoParameters(port=None, folder=tmp_path / "pictures"), lost.append)
        sitl.poll_every(4000)
    camera = sitl.vehicles[0].station.get(CameraComponent)
    client = FrameEncoder(255, 190)

    def order(command: int, *values: float) -> None:
        params = (*values, *(0.0,) * (7 - len(values)))
        link.send(client.encode(dialect.MAVLink_command_long_message(1, 100, command, 0, *params)))

    for step in range(1000):
        sitl.advance()
        if step == 300:
            order(dialect.MAV_CMD_IMAGE_START_CAPTURE, 0, 0.3, 5)
        if step == 600:
            order(dialect.MAV_CMD_VIDEO_START_CAPTURE)
        if look and step % 7 == 0:
            camera.device.view(sitl.time_us)
    if service is not None:
        service.close()
        kept = {path.name for path in (tmp_path / "pictures").rglob("*.*")}  # type: ignore[operator]
        assert {f"IMG_{n:04d}.jpg" for n in range(5)} | {"VID_0000.mp4"} == kept
        assert lost == []
    sitl.close()
    return bytes(said)


def test_looking_changes_nothing(tmp_path):
    assert flight(None, look=False) == flight(None, look=True)


@pytest.mark.slow
def test_the_same_seed_says_the_same_with_pictures_kept(tmp_path):
    first, second = (flight(tmp_path / name, look=False) for name in ("first", "second"))
    assert first == second
    assert b"camera1/IMG_0004.jpg" in first
