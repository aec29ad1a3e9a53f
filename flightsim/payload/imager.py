"""What lens, sensor and link do to a picture: distortion, light, noise, rolling shutter, compression."""

import math
from dataclasses import dataclass, field, fields
from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.checks import NotNegative, Positive, Whole, require_finite
from flightsim.foundation.kernels import kernel
from flightsim.foundation.options import Options

Array = NDArray[np.float64]

_ITERATIONS: Final = 20
_CONVERGED: Final = 1e-12
_LARGEST_LEFT: Final = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class BrownDistortion:
    """Distortion of a lens (Brown 1966), in the order and with the signs of OpenCV.

    With r2 = x2 + y2 a ray at (x, y) in normalised image coordinates is seen at
    x (1 + k1 r2 + k2 r2^2 + k3 r2^3) + 2 p1 x y + p2 (r2 + 2 x2), and y in the same way.

    Attributes:
        k1, k2, k3: radial; a negative k1 makes a barrel.
        p1, p2: tangential.
    """

    k1: float = 0.0
    k2: float = 0.0
    p1: float = 0.0
    p2: float = 0.0
    k3: float = 0.0

    def __post_init__(self) -> None:
        require_finite(**{f.name: getattr(self, f.name) for f in fields(self)})

    @property
    def coefficients(self) -> tuple[float, float, float, float, float]:
        """k1, k2, p1, p2, k3."""
        return self.k1, self.k2, self.p1, self.p2, self.k3

    @property
    def none(self) -> bool:
        """Whether the lens is ideal."""
        return not any(self.coefficients)

    def distorted(self, rays: Array) -> Array:
        """Normalised image coordinates (..., 2) at which rays (..., 2) are seen."""
        x, y = rays[..., 0], rays[..., 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (self.k1 + r2 * (self.k2 + r2 * self.k3))
        return np.stack(
            (
                x * radial + 2.0 * self.p1 * x * y + self.p2 * (r2 + 2.0 * x * x),
                y * radial + self.p1 * (r2 + 2.0 * y * y) + 2.0 * self.p2 * x * y,
            ),
            axis=-1,
        )

    def rays(self, seen: Array) -> Array:
        """The rays (..., 2) that are seen at normalised image coordinates (..., 2), by fixed-point iteration.

        Raises:
            ValueError: the lens folds the picture there: no ray, or more than one, is seen at a place.
        """
        rays = np.array(seen, dtype=np.float64)
        if not _undistort(rays.reshape(-1, 2), np.array(self.coefficients)) < _LARGEST_LEFT:
            raise ValueError(
                f"the distortion {self.coefficients} is not accepted: it folds the picture at its edges; "
                "smaller coefficients, or a smaller field of view, are"
            )
        return rays


@dataclass(frozen=True, slots=True, kw_only=True)
class ImagerParameters(Options):
    """Lens and sensor. The defaults are ideal.

    Attributes:
        distortion: of the lens.
        read_noise: one sigma of each sample, in levels of 0 to 255.
        shot_noise: variance that grows with the light: levels^2 for each level.
        rolling_shutter_s: from the exposure of the first to that of the last row; 0: all rows at once.
        vignetting: power of the natural falloff of light, cos^4 of the angle to the optical axis; 0: none.
        brightness: light as a multiple of that of a right exposure; levels saturate at 255.
        jpeg_quality: 1 to 100 of JPEG; 0: no compression.
    """

    distortion: BrownDistortion = field(default_factory=BrownDistortion)
    read_noise: NotNegative = 0.0
    shot_noise: NotNegative = 0.0
    rolling_shutter_s: NotNegative = 0.0
    vignetting: NotNegative = 0.0
    brightness: Positive = 1.0
    jpeg_quality: Whole = 0

    def check_together(self) -> None:
        if self.jpeg_quality > 100:
            raise ValueError(f"jpeg_quality {self.jpeg_quality} is not possible; 0 to 100 are")

    @property
    def noisy(self) -> bool:
        """Whether a picture has noise."""
        return self.read_noise > 0.0 or self.shot_noise > 0.0

    def noise_sigma(self, level: float) -> float:
        """One sigma of a sample, levels."""
        return math.sqrt(self.read_noise**2 + self.shot_noise * level)


@kernel
def _undistort(points: Array, coefficients: Array) -> float:
    """Replace the places (n, 2) at which rays are seen by the rays; returns the largest remaining distance,
    or infinity.
    """
    k1, k2, p1, p2, k3 = coefficients
    largest = 0.0
    for i in range(points.shape[0]):
        u, v = points[i, 0], points[i, 1]
        x, y, left = u, v, math.inf
        for _ in range(_ITERATIONS):
            r2 = x * x + y * y
            radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
            dx = u - (x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x))
            dy = v - (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y)
            x += dx
            y += dy
            left = max(abs(dx), abs(dy))
            if not left >= _CONVERGED:
                break
        points[i, 0], points[i, 1] = x, y
        if not left <= largest:
            largest = left if left == left else math.inf
    return largest
