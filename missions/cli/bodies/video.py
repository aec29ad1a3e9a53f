"""Video and pictures of the cameras of `flightstack sitl`."""

import sys
from collections.abc import Callable
from pathlib import Path

import click

from autopilot_bridge.sitl import Sitl
from autopilot_bridge.video import VideoParameters, VideoService
from autopilot_bridge.video.for_sitl import show_cameras
from flightsim.foundation.packages import installed, missing


def start_video(
    world: Sitl, video: str | None, rate_hz: float, pictures: Path | None, on_loss: Callable[[str], None]
) -> VideoService | None:
    """Serve video and keep pictures as the options specify; None: neither was requested.

    Args:
        world: the world that has the cameras.
        video, rate_hz, pictures: values of the command-line options.
        on_loss: called with what could not be written, and the reason.

    Raises:
        ValueError: an option that can't be met, or one that needs a camera.
    """
    if not any(vehicle.specification.payload.camera for vehicle in world.vehicles):
        if video is not None or pictures is not None:
            option = "--video" if video is not None else "--pictures"
            raise ValueError(f"{option} is for cameras; add --camera")
        return None
    if video == "off" and pictures is None:
        return None
    if sys.platform == "win32":
        if video is not None or pictures is not None:
            raise ValueError("video and pictures are not possible on Windows; accepted: --video off")
        click.echo("no video: it is not possible on Windows", err=True)
        return None
    if video is None and pictures is None and not installed("av"):
        click.echo(missing("av", "no video: it"), err=True)
        return None

    if video == "off":
        parameters = VideoParameters(port=None, folder=pictures, rate_hz=rate_hz)
    elif video is None:
        parameters = VideoParameters(folder=pictures, rate_hz=rate_hz)
    else:
        host, port = _place(video)
        parameters = VideoParameters(host=host, port=port, any_port=False, folder=pictures, rate_hz=rate_hz)
    if parameters.port is not None and not parameters.host.startswith(("127.", "localhost")):
        click.echo(f"warning: video on {parameters.host} is open to whoever reaches it", err=True)
    service = show_cameras(world, parameters, on_loss)
    if service is not None and parameters.port is not None:
        service.start()
    return service


def _place(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not (port.isascii() and port.isdigit() and len(port) <= 5):
        raise ValueError(f"--video {text!r} is not accepted: PORT, HOST:PORT or off is, for example 8554")
    return host or "127.0.0.1", int(port)
