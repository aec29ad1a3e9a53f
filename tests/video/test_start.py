"""The picture process before any client watches."""

import time

import pytest

from autopilot_bridge.sitl import Sitl
from autopilot_bridge.video import VideoParameters
from autopilot_bridge.video.for_sitl import show_cameras
from flightsim.payload import Camera, CameraParameters, CameraView, GimbalParameters, PayloadParameters
from flightsim.world_spec import VehicleSpec, WorldSpec

DEADLINE_S = 100.0


def test_it_is_ready_before_the_first_player_comes(monkeypatch: pytest.MonkeyPatch) -> None:
    """It makes a picture that no client requested, and ends at once with the vehicles."""
    payload = PayloadParameters(gimbal=GimbalParameters(), camera=CameraParameters())
    sitl = Sitl(WorldSpec(vehicles=(VehicleSpec(payload=payload),)))
    looked: list[int] = []
    view = Camera.view

    def counted(camera: Camera, time_us: int) -> CameraView:
        looked.append(time_us)
        return view(camera, time_us)

    monkeypatch.setattr(Camera, "view", counted)
    service = show_cameras(sitl, VideoParameters(port=0), [].append)
    assert service is not None
    service.start()
    process = service._process
    service.start()  # a second time does nothing
    assert process is not None and service._process is process
    deadline_s = time.monotonic() + DEADLINE_S
    while not looked:
        assert time.monotonic() < deadline_s and process.poll() is None
        service.poll(0)
        time.sleep(0.01)  # it comes when it comes: another process
    service.close()
    assert process.poll() is not None
    sitl.close()
