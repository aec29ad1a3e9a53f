"""The pictures of a flight's cameras as lossless videos in its run folder."""

from collections.abc import Iterator
from pathlib import Path

from autopilot_bridge.sitl import Sitl
from estimators.vision import CameraDescription
from flightsim.payload import Camera, MovingPointCamera
from missions.camera_film import CameraFilm
from missions.embedded.rendered_points import RenderedPointsReader
from missions.embedded.rendered_tags import RenderedTagsReader

__all__ = ["point_readers_of", "readers_of", "start_films"]


def readers_of(sitl: Sitl) -> Iterator[tuple[int, Camera, RenderedTagsReader]]:
    """System id, device and reader of each camera whose detections are read off rendered pictures."""
    for vehicle in sitl.vehicles:
        device = None if vehicle.payload is None else vehicle.payload.devices.camera
        if device is not None and isinstance(device.reader, RenderedTagsReader):
            yield vehicle.specification.system_id, device, device.reader


def point_readers_of(sitl: Sitl) -> Iterator[tuple[int, MovingPointCamera, RenderedPointsReader]]:
    """The same of each moving-point camera whose points are found in rendered pictures."""
    for vehicle in sitl.vehicles:
        device = None if vehicle.payload is None else vehicle.payload.devices.moving_points
        if device is not None and isinstance(device.reader, RenderedPointsReader):
            yield vehicle.specification.system_id, device, device.reader


def start_films(sitl: Sitl, folder: Path) -> list[CameraFilm]:
    """Keep the pictures of the cameras whose parameters want it, as camera1.mp4 and so on by system id."""
    films = []
    for system_id, device, reader in readers_of(sitl):
        if reader.films:
            p = device.parameters
            camera = CameraDescription(
                geometry=reader.geometry,
                mount_rad=(p.mount_roll_rad, p.mount_pitch_rad, p.mount_yaw_rad),
                position_frd_m=p.position_frd_m,
                latency_s=p.latency_s,
            )
            film = reader.film = CameraFilm(folder / f"camera{system_id}.mp4", camera)
            films.append(film)
    for system_id, points, finder in point_readers_of(sitl):
        if finder.films:
            camera = CameraDescription(geometry=finder.geometry, latency_s=points.parameters.latency_s)
            film = finder.film = CameraFilm(folder / f"camera{system_id}.mp4", camera)
            films.append(film)
    return films
