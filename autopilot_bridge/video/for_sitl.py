"""Serves the pictures of the cameras of a SITL: each camera component gets a stream and a folder for
photos.
"""

import math
from collections.abc import Callable
from typing import Final

from autopilot_bridge.payload import CameraComponent
from autopilot_bridge.payload.camera_video import VideoStream
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.video.parameters import VideoParameters
from autopilot_bridge.video.service import CameraOnShow, VideoService
from flightsim.airframe import AirframeKind
from flightsim.picture import Scenery

_RUNWAY_M: Final = 600.0
_BITS_PER_PIXEL: Final = 0.35  # approximate value for a moving landscape at our quality


class CameraFolder:
    """Makes the files of a camera component."""

    def __init__(self, service: VideoService, index: int) -> None:
        self._service = service
        self._index = index

    def photo(self, time_us: int, notes: dict[str, float]) -> str:
        """Store a photo; returns its name within the folder."""
        return self._service.photo(self._index, time_us, notes)

    def start_video(self, time_us: int) -> None:
        """Begin to store a video."""
        self._service.start_recording(self._index, time_us)

    def stop_video(self, time_us: int) -> None:
        """End the video."""
        self._service.stop_recording(self._index)


def show_cameras(
    sitl: Sitl, parameters: VideoParameters, on_loss: Callable[[str], None]
) -> VideoService | None:
    """Serve the pictures of all cameras of a world; None: there is no camera.

    Cameras are named "camera" and the vehicle's system id. Aircraft have a runway of 600 m through home.

    Args:
        sitl: the world.
        parameters: how its pictures are served.
        on_loss: called with what could not be stored, and why.

    Raises:
        VideoError: the port is busy, or the folder is not empty.
    """
    components = [
        (vehicle.specification.system_id, camera)
        for vehicle in sitl.vehicles
        if vehicle.station is not None and (camera := vehicle.station.get(CameraComponent)) is not None
    ]
    if not components:
        return None

    def streaming(index: int) -> bool:
        stream = components[index][1].stream
        return stream is not None and stream.running

    service = VideoService(
        [
            CameraOnShow(
                name=f"camera{system_id}",
                camera=component.device,
                model=component.device.parameters.model,
                blur_px_m=component.device.parameters.blur_px_m,
                imager=component.device.parameters.imager,
                streaming=lambda index=index: streaming(index),  # type: ignore[misc]
            )
            for index, (system_id, component) in enumerate(components)
        ],
        scenery=_scenery(sitl),
        parameters=parameters,
        on_loss=on_loss,
    )
    for index, (_, component) in enumerate(components):
        uri = service.uri(index)
        if uri is not None:
            width_px, height_px = service.size_px(index)
            bitrate = round(_BITS_PER_PIXEL * width_px * height_px * service.rate_hz)
            component.stream = VideoStream(uri, width_px, height_px, service.rate_hz, bitrate)
        if parameters.folder is not None:
            component.keeper = CameraFolder(service, index)
    sitl.attend(service.poll)
    return service


def _scenery(sitl: Sitl) -> Scenery:
    aircraft = any(vehicle.vehicle.airframe.kind is AirframeKind.FIXED_WING for vehicle in sitl.vehicles)
    return Scenery(
        runway_length_m=_RUNWAY_M if aircraft else 0.0,
        runway_heading_rad=math.radians(sitl.spec.place.heading_deg),
    )
