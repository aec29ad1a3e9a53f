"""A camera whose detections are read off rendered pictures: the world's renderer and the detector of
`estimators.vision`, frame by frame on vehicle time.
"""

from dataclasses import dataclass, field
from typing import Final, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from estimators.vision import (
    CameraGeometry,
    TagDetection,
    TagDetector,
    TagDetectorParameters,
    draw_detections,
)
from flightsim.payload import CameraView, Detection, ImagerParameters, PinholeModel
from flightsim.picture import Renderer, Scenery
from missions.embedded.picture_geometry import picture_geometry

__all__ = ["RenderedTags", "RenderedTagsReader", "TagPicture"]

Picture = NDArray[np.uint8]

_MARGIN_PX: Final = 40  # more than the windows of the detector's thresholds and corners


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TagPicture:
    """A picture with detections.

    Attributes:
        time_us: vehicle time of the exposure.
        pixels: (height, width, 3), BGR.
        detections: what the detector found in it.
    """

    time_us: int
    pixels: Picture
    detections: tuple[TagDetection, ...]

    def drawn(self) -> bytes:
        """The picture with the detections drawn in, as PNG."""
        _, data = cv2.imencode(".png", draw_detections(self.pixels, self.detections))
        return bytes(data)


class FrameWriter(Protocol):
    """Keeps pictures."""

    def write(self, time_us: int, picture: Picture) -> None:
        """Add a picture (height, width, 3), BGR, of a vehicle time."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class RenderedTags:
    """Renders what a camera sees, and detects the tags in it.

    Attributes:
        detector: parameters of the detector.
        scenery: of the world.
        skip: render only the part of a frame around the tags, and no frame in whose view no tag can lie. The
            detections are the same: the detector finds no tag where there is none.
        film: keep all pictures as a lossless video in the run folder; then none is skipped.
    """

    detector: TagDetectorParameters = field(default_factory=TagDetectorParameters)
    scenery: Scenery = field(default_factory=Scenery)
    skip: bool = True
    film: bool = False

    def start(
        self, *, model: PinholeModel, imager: ImagerParameters, blur_px_m: float, seed: int
    ) -> "RenderedTagsReader":
        """The reader of one camera.

        Raises:
            ValueError: the distortion folds the picture.
        """
        return RenderedTagsReader(self, model, imager, blur_px_m, seed)


class RenderedTagsReader:
    """Renders and searches the frames of one camera.

    Attributes:
        film: the video to which all pictures are written; None: none.
        kept: the first picture with a detection; None: there was none yet.
        rendered: number of frames that were rendered.
        skipped: number of frames that were not.
    """

    def __init__(
        self,
        parameters: RenderedTags,
        model: PinholeModel,
        imager: ImagerParameters,
        blur_px_m: float,
        seed: int,
    ) -> None:
        self._parameters = parameters
        self._model, self._imager = model, imager
        self._renderer = Renderer(
            model, aperture_px_m=blur_px_m, scenery=parameters.scenery, imager=imager, seed=seed
        )
        self._zoom = 0.0
        self._detector = self._detector_at(1.0)
        self.film: FrameWriter | None = None
        self.kept: TagPicture | None = None
        self.rendered = 0
        self.skipped = 0

    def _detector_at(self, zoom: float) -> TagDetector:
        if zoom != self._zoom:
            self._zoom = zoom
            self._detector = TagDetector(self._geometry_at(zoom), self._parameters.detector)
        return self._detector

    def _geometry_at(self, zoom: float) -> CameraGeometry:
        return picture_geometry(self._model, self._imager, zoom)

    @property
    def geometry(self) -> CameraGeometry:
        """Of the camera without zoom."""
        return self._geometry_at(1.0)

    @property
    def films(self) -> bool:
        """Whether the pictures are to be kept as a video."""
        return self._parameters.film

    def read(self, view: CameraView) -> tuple[Detection, ...]:
        """The tags in the picture of a view."""
        skip = self._parameters.skip and self.film is None
        if skip and not self._renderer.may_show_tag(view):
            self.skipped += 1
            return ()
        self.rendered += 1
        window = self._renderer.tag_window(view, _MARGIN_PX) if skip else None
        picture = self._renderer.render(view, window=window)
        if self.film is not None:
            self.film.write(view.time_us, picture)
        corner = (0, 0) if window is None else (window.left, window.top)
        found = self._detector_at(view.zoom).detect(picture, corner_px=corner)
        if found and self.kept is None:
            whole = picture if window is None else self._renderer.render(view)
            self.kept = TagPicture(time_us=view.time_us, pixels=whole, detections=found)
        return tuple(
            Detection(
                view.time_us,
                *tag.centre_px,
                tag.angle_x_rad,
                tag.angle_y_rad,
                tag.size_rad,
                tag.tag_id,
                tag.distance_m,
            )
            for tag in found
        )
