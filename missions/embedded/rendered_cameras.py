"""The cameras of a SITL whose detections are read off rendered pictures, and their videos."""

from collections.abc import Iterator
from pathlib import Path

from autopilot_bridge.links import MemoryLink
from autopilot_bridge.sitl import Sitl
from estimators.vision import CameraDescription
from flightsim.payload import Camera, MovingPointCamera
from missions.embedded.rendered_points import RenderedPointsReader, watched
from missions.embedded.rendered_tags import RenderedTagsReader
from missions.flown.camera_film import CameraFilm
from missions.flown.camera_picture import CameraPicture

__all__ = ["RenderedCameras"]


class RenderedCameras:
    """What a run needs of the rendered cameras of its vehicles.

    Args:
        sitl: the world.
        films_to: folder for the videos of cameras whose pictures are kept, lossless, as camera1.mp4 and so on
            by system id; None: they are not kept.
    """

    def __init__(self, sitl: Sitl, films_to: Path | None) -> None:
        self._tag_readers = list(_tag_cameras(sitl))
        point_readers = list(_point_cameras(sitl))
        self._finders = {system_id: finder for system_id, _, finder in point_readers}
        self._films: list[CameraFilm] = []
        if films_to is None:
            return
        for system_id, device, reader in self._tag_readers:
            if reader.films:
                p = device.parameters
                camera = CameraDescription(
                    geometry=reader.geometry,
                    mount_rad=(p.mount_roll_rad, p.mount_pitch_rad, p.mount_yaw_rad),
                    position_frd_m=p.position_frd_m,
                    latency_s=p.latency_s,
                )
                reader.film = self._film(films_to, system_id, camera)
        for system_id, points, finder in point_readers:
            if finder.films:
                camera = CameraDescription(geometry=finder.geometry, latency_s=points.parameters.latency_s)
                finder.film = self._film(films_to, system_id, camera)

    def _film(self, folder: Path, system_id: int, camera: CameraDescription) -> CameraFilm:
        film = CameraFilm(folder / f"camera{system_id}.mp4", camera)
        self._films.append(film)
        return film

    def link(self, system_id: int, to_vehicle: MemoryLink) -> MemoryLink:
        """The mission's end of a vehicle's link; the front end of its moving-point camera receives the
        messages too.
        """
        finder = self._finders.get(system_id)
        return to_vehicle if finder is None else watched(to_vehicle, system_id, finder.watch)

    def first_detections(self) -> dict[str, bytes]:
        """The first picture of each camera in which a tag was read, as PNG with the detections drawn in, by
        file name.
        """
        return {
            f"tag{system_id}.png": reader.kept.drawn()
            for system_id, _, reader in self._tag_readers
            if reader.kept is not None
        }

    def pictures_of(self, system_id: int) -> tuple[CameraPicture, ...]:
        """The pictures that the moving-point camera of a vehicle has kept."""
        finder = self._finders.get(system_id)
        return () if finder is None else finder.kept

    def close(self) -> None:
        """Finish the videos.

        Raises:
            VideoError: the end of one can't be written.
        """
        for film in self._films:
            film.close()


def _tag_cameras(sitl: Sitl) -> Iterator[tuple[int, Camera, RenderedTagsReader]]:
    """System id, device and reader of each camera that reads tags."""
    for vehicle in sitl.vehicles:
        device = None if vehicle.station is None else vehicle.station.payload.get(Camera)
        if device is not None and isinstance(device.reader, RenderedTagsReader):
            yield vehicle.specification.system_id, device, device.reader


def _point_cameras(sitl: Sitl) -> Iterator[tuple[int, MovingPointCamera, RenderedPointsReader]]:
    """The same of each moving-point camera."""
    for vehicle in sitl.vehicles:
        device = None if vehicle.station is None else vehicle.station.payload.get(MovingPointCamera)
        if device is not None and isinstance(device.reader, RenderedPointsReader):
            yield vehicle.specification.system_id, device, device.reader
