"""The pictures of a camera as lossless video beside the file that describes the camera: what
`flightstack vision` reads.
"""

from dataclasses import replace
from pathlib import Path

from estimators.errors import VideoError
from estimators.vision import CameraDescription
from estimators.vision.video import Film, Picture
from flightsim.foundation.packages import required

__all__ = ["CameraFilm"]


class CameraFilm:
    """The lossless video of one camera. Its files are made when the first picture comes.

    Args:
        path: of the video; the camera's description gets the suffix .toml.
        camera: its description; `start_us` is that of the first picture.

    Raises:
        MissingPackage: PyAV is not installed.
    """

    def __init__(self, path: Path, camera: CameraDescription) -> None:
        required("av", f"the video {path}")  # before the flight, not at its first picture
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
