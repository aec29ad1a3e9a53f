"""Pictures of a camera with what was found in them, for the run folder."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Any, Final

from flightsim.foundation.packages import required
from flightsim.foundation.vectors import ImagePoint

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from estimators.vision import CameraGeometry

__all__ = ["CameraPicture", "PicturesOf", "clip", "png"]


_JPEG_QUALITY: Final = 80  # noise does not compress: a picture of 640 x 480 pixels has some 100 kB


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPicture:
    """A picture.

    Attributes:
        time_us: vehicle time of the exposure.
        jpeg: the picture, compressed.
        camera: its geometry.
        points: what was found in it, as tangents to the right and down.
    """

    time_us: int
    jpeg: bytes
    camera: "CameraGeometry"
    points: tuple[ImagePoint, ...]

    @classmethod
    def of(
        cls,
        time_us: int,
        pixels: "NDArray[np.uint8]",
        camera: "CameraGeometry",
        points: tuple[ImagePoint, ...],
    ) -> "CameraPicture":
        """Of pixels (height, width, 3), BGR."""
        import cv2

        _, data = cv2.imencode(".jpg", pixels, (cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY))
        return cls(time_us=time_us, jpeg=bytes(data), camera=camera, points=points)

    def drawn(self, tracks: Sequence[tuple[ImagePoint, str, bool]]) -> "NDArray[np.uint8]":
        """The picture (height, width, 3), BGR, with a circle around each point, and a cross with a text at
        each track.

        Args:
            tracks: tangents, text, and whether it is marked.
        """
        import cv2
        import numpy as np

        picture: Any = cv2.imdecode(np.frombuffer(self.jpeg, np.uint8), cv2.IMREAD_COLOR)

        def place(point: ImagePoint) -> tuple[int, int]:
            x, y = self.camera.pixels(np.array([[*point, 1.0]]))[0] - 0.5
            return round(float(x)), round(float(y))

        for point in self.points:
            cv2.circle(picture, place(point), 9, (0, 220, 255), 1, cv2.LINE_AA)
        for point, text, marked in tracks:
            colour = (0, 0, 255) if marked else (255, 160, 0)
            x, y = place(point)
            cv2.drawMarker(picture, (x, y), colour, cv2.MARKER_CROSS, 13, 2 if marked else 1, cv2.LINE_AA)
            for shade, width in (((0, 0, 0), 3), (colour, 1)):
                cv2.putText(
                    picture, text, (x + 9, y - 7), cv2.FONT_HERSHEY_SIMPLEX, 0.45, shade, width, cv2.LINE_AA
                )
        return np.asarray(picture, dtype=np.uint8)


PicturesOf = Callable[[int], Sequence[CameraPicture]]
"""The pictures that the camera of a vehicle has kept, by system id, in the order of their times."""


def png(pixels: "NDArray[np.uint8]") -> bytes:
    """A picture (height, width, 3), BGR, as PNG."""
    import cv2

    _, data = cv2.imencode(".png", pixels)
    return bytes(data)


def clip(pictures: "Iterable[NDArray[np.uint8]]", rate_hz: int) -> bytes:
    """Pictures (height, width, 3), BGR, of one size as a video (MP4, H.264); b"" without pictures."""
    av = required("av", "a clip of the tracks")
    file, stream = BytesIO(), None
    with av.open(file, "w", format="mp4") as container:
        for pixels in pictures:
            if stream is None:
                stream = container.add_stream("libx264", rate=rate_hz)
                stream.height, stream.width = pixels.shape[:2]
                stream.pix_fmt = "yuv420p"
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="bgr24")))
        if stream is not None:
            container.mux(stream.encode(None))
    return b"" if stream is None else file.getvalue()
