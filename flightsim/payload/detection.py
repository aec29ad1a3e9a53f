"""What a detector makes of a picture: the answer of one frame, and how likely it sees a target."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from flightsim.checks import require_not_negative, require_probability
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
    """What the detector found in one frame; perhaps nothing.

    Attributes:
        time_us: when it was exposed.
        number: counts from 0.
        detections: from left to right, so that their order tells nothing.
    """

    time_us: int
    number: int
    detections: tuple[Detection, ...]


class DetectionModel(Protocol):
    """How likely a target in the image is detected."""

    def probability(self, size_px: Array, range_m: Array) -> Array:
        """Probabilities (n,) from the size in the image and the distance of each target."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ResolutionDetection:
    """Detection by resolution: a logistic curve over the size in the image.

    The smooth form of Tisdale et al. (2008), equations 5 to 7, whose 0.96 is the default of the upper end.

    Attributes:
        max_probability: of a target that fills many pixels.
        half_size_px: size at which half of that is left.
        slope_px: width of the fall; 0: a step.
    """

    max_probability: float = 0.96
    half_size_px: float = 4.0
    slope_px: float = 0.7

    def __post_init__(self) -> None:
        require_probability(max_probability=self.max_probability)
        require_not_negative(half_size_px=self.half_size_px, slope_px=self.slope_px)

    @classmethod
    def constant(cls, probability: float) -> "ResolutionDetection":
        """The same probability for every target in the image."""
        return cls(max_probability=probability, half_size_px=0.0, slope_px=0.0)

    def probability(self, size_px: Array, range_m: Array) -> Array:
        """The curve at each size."""
        above = size_px - self.half_size_px
        if self.slope_px == 0.0:
            return np.where(above >= 0.0, self.max_probability, 0.0)
        share: Array = 0.5 * (1.0 + np.tanh(0.5 * above / self.slope_px))
        return self.max_probability * share
