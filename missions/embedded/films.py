"""The pictures of a flight's cameras as lossless videos in its run folder, each beside the file that
describes its camera: what `flightstack vision` reads.
"""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from autopilot_bridge.sitl import Sitl
from estimators.vision import CameraDescription
from estimators.vision.video import Film, VideoError
from flightsim.payload import Camera, MovingPointCamera
from missions.embedded.rendered_points import RenderedPointsReader
from missions.embedded.rendered_tags import Picture, RenderedTagsReader

__all__ = ["FlightFilm", "point_readers_of", "readers_of", "start_films"]


class FlightFilm:
    """The video of one camera. Its files are made when the first picture comes.

    Args:
        path: of the video; the camera's description gets the suffix .toml.
        camera: its description; `start_us` is that of the first picture.
    """

    def __init__(self, path: Path, camera: CameraDescription) -> None:
        self._path, self._camera = path, camera
        self._film: Film | None = None
        self._start_us = 0

    def write(self, time_us: int, picture: Picture) -> None:
        """Add a picture (height, width, 3), BGR, of a vehicle time.

        Raises:
            VideoError: it can't be written.
        """
        if self._film is None:
            camera = replace(self._camera, start_us=time_us)
            geometry = camera.geometry
            self._film = Film(self._path, width_px=geometry.width_px, height_px=geometry.height_px)
            self._start_us = time_us
            try:
                with self._path.with_suffix(".toml").open("x", encoding="utf-8") as file:
                    file.write(camera.toml())
            except OSError as error:
                raise VideoError(f"can't write beside {self._path}: {error.strerror}") from error
        self._film.write(time_us - self._start_us, picture)

    def close(self) -> None:
        """Finish the video.

        Raises:
            VideoError: its end can't be written.
        """
        if self._film is not None:
            self._film.close()


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


def start_films(sitl: Sitl, folder: Path) -> list[FlightFilm]:
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
            film = reader.film = FlightFilm(folder / f"camera{system_id}.mp4", camera)
            films.append(film)
    for system_id, points, finder in point_readers_of(sitl):
        if finder.films:
            camera = CameraDescription(geometry=finder.geometry, latency_s=points.parameters.latency_s)
            film = finder.film = FlightFilm(folder / f"camera{system_id}.mp4", camera)
            films.append(film)
    return films
