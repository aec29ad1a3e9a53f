"""The result of a detector for one frame, and its probability to detect a target."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative, Positive, Share
from flightsim.foundation.options import Options
from flightsim.payload.camera_model import PinholeModel
from flightsim.payload.camera_view import CameraView
from flightsim.payload.imager import ImagerParameters
from flightsim.payload.targets import NO_TAG

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Detection:
    """One thing found in one frame.

    Attributes:
        time_us: when the frame was exposed, microseconds since boot.
        u_px, v_px: centre in the image, right from the left edge and down from the top edge.
        angle_x_rad, angle_y_rad: angles off the optical axis to the right and downwards, each in its own
            plane: LANDING_TARGET's, whose tangents are the normalised image coordinates.
        size_rad: angular size.
        target_id: the tag's number; -1 for what carries no tag and for false detections.
        distance_m: by the apparent size of a tag whose true size is known; 0: not measured.
    """

    time_us: int
    u_px: float
    v_px: float
    angle_x_rad: float
    angle_y_rad: float
    size_rad: float
    target_id: int = NO_TAG
    distance_m: float = 0.0

    @property
    def normalised(self) -> tuple[float, float]:
        """Normalised image coordinates, right and down (Tolman et al. 2021, equation 36)."""
        return math.tan(self.angle_x_rad), math.tan(self.angle_y_rad)


@dataclass(frozen=True, slots=True)
class CameraFrame:
    """The detections in one frame; may be empty.

    Attributes:
        time_us: when it was exposed.
        number: counts from 0.
        detections: from left to right, so that their order carries no information.
        searched: whether the frame says anything about targets; a detector of moving ones has nothing to
            compare its first frames with.
    """

    time_us: int
    number: int
    detections: tuple[Detection, ...]
    searched: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class SeenTargets:
    """Targets in one picture, as far as their detection depends on it; arrays (n,).

    Attributes:
        size_px: side of a tag, or diameter, as if seen from right above.
        range_m: distance.
        sine: of the depression of the line of sight: how much a tag on the ground is foreshortened.
        blur_px: way of the target in the picture during the exposure.
        edge_px: from its outline to the nearest edge of the picture; negative: the edge cuts it off.
        covered: another target stands before it.
        tagged: it is a tag, and no ball.
    """

    size_px: Array
    range_m: Array
    sine: Array
    blur_px: Array
    edge_px: Array
    covered: NDArray[np.bool_]
    tagged: NDArray[np.bool_]


class FrameReader(Protocol):
    """Detects targets in the pictures of one camera."""

    def read(self, view: CameraView) -> Sequence[Detection] | None:
        """The detections in the picture of a view; None: the frame was not searched."""


class FrameReaderParameters(Protocol):
    """A kind of detector that works on pictures: a parameter set that starts a reader."""

    def start(
        self, *, model: PinholeModel, imager: ImagerParameters, blur_px_m: float, seed: int
    ) -> FrameReader:
        """The reader of a camera with this geometry, sensor and lens; what is random comes from the seed."""


class DetectionModel(Protocol):
    """How likely a target in the image is detected."""

    def probability(self, seen: SeenTargets) -> Array:
        """Probabilities (n,)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PictureDetection(Options):
    """Detection as detectors do it in pictures of the size of the model: a logistic curve over the size.

    Tags of the family 36h11 by the AprilTag 3 library, balls by their colour. A tag on the ground is
    foreshortened, so the effective size is size_px * sine^foreshortening; with blur b, a size of
    sqrt(half_size_px^2 + (blur_factor b)^2) is needed for half of the tags to be read. A target that the edge
    of the picture cuts off, or that another one covers, is not detected. A tag is not read below
    min_depression_rad, whatever its size. The defaults are fits to rendered pictures, by
    `python -m benchmarks.camera_detection`.

    Attributes:
        max_probability: of a target that fills many pixels.
        half_size_px, slope_px: of a tag seen from above: size with half of that left, and width of the fall.
        foreshortening: exponent.
        min_depression_rad: of the line of sight to a tag.
        blur_factor: of motion, in pixels of size for each pixel of blur.
        ball_half_size_px, ball_slope_px: of a ball; it isn't foreshortened, and blur doesn't hide it.
    """

    max_probability: Share = 0.998
    half_size_px: NotNegative = 8.65
    slope_px: Positive = 0.505
    foreshortening: NotNegative = 0.844
    min_depression_rad: NotNegative = math.radians(4.5)
    blur_factor: NotNegative = 2.95
    ball_half_size_px: NotNegative = 2.01
    ball_slope_px: Positive = 0.042

    def probability(self, seen: SeenTargets) -> Array:
        """The curve at each target."""
        across_px = seen.size_px * np.maximum(seen.sine, 0.0) ** self.foreshortening
        half_px = np.hypot(self.half_size_px, self.blur_factor * seen.blur_px)
        tag = (across_px - half_px) / self.slope_px
        ball = (seen.size_px - self.ball_half_size_px) / self.ball_slope_px
        share = 0.5 * (1.0 + np.tanh(0.5 * np.where(seen.tagged, tag, ball)))
        whole = (seen.edge_px >= 0.0) & ~seen.covered
        whole &= ~seen.tagged | (seen.sine >= math.sin(self.min_depression_rad))
        value: Array = np.where(whole, self.max_probability * share, 0.0)
        return value


@dataclass(frozen=True, slots=True, kw_only=True)
class ResolutionDetection(Options):
    """Detection by resolution: a logistic curve over the size in the image.

    The smooth form of Tisdale et al. (2008), equations 5 to 7, whose 0.96 is the default of the upper end.

    Attributes:
        max_probability: of a target that fills many pixels.
        half_size_px: size at which half of that is left.
        slope_px: width of the fall; 0: a step.
    """

    max_probability: Share = 0.96
    half_size_px: NotNegative = 4.0
    slope_px: NotNegative = 0.7

    @classmethod
    def constant(cls, probability: float) -> "ResolutionDetection":
        """The same probability for every target in the image."""
        return cls(max_probability=probability, half_size_px=0.0, slope_px=0.0)

    def probability(self, seen: SeenTargets) -> Array:
        """The curve at each size."""
        above = seen.size_px - self.half_size_px
        if self.slope_px == 0.0:
            return np.where(above >= 0.0, self.max_probability, 0.0)
        share: Array = 0.5 * (1.0 + np.tanh(0.5 * above / self.slope_px))
        return self.max_probability * share
