"""The role of a belief about the place of one target on an area: a grid or particles."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.camera_sight import CameraSight
from estimators.tracking.grid import GridLayout

__all__ = ["AreaBelief"]

Array = NDArray[np.float64]


class AreaBelief(Protocol):
    """Probability of a target's place, given the frames of all cameras so far."""

    def predict(self, dt_s: float) -> None:
        """Let the target move for a time."""
        ...

    def update(self, sight: CameraSight) -> float:
        """Multiply by the likelihood of a frame, with or without detections (equation 1a).

        Returns:
            The probability of the frame given those before, relative to a frame that looks elsewhere: of one
            without a detection, 1 minus the probability that the target is detected in it.
        """
        ...

    @property
    def probability_of_detection(self) -> float:
        """Probability that the frames up to the first detection would have detected the target (equation 8,
        corrected); false detections don't count.
        """
        ...

    def moments(self) -> tuple[Array, Array]:
        """Mean (2,) and covariance (2, 2) of the place, north and east."""
        ...

    @property
    def mode_ne_m(self) -> tuple[float, float]:
        """The most probable place."""
        ...

    @property
    def entropy_nats(self) -> float:
        """Differential entropy of the place in square metres: of a uniform belief the logarithm of the
        area.
        """
        ...

    def shares(self, layout: GridLayout) -> Array:
        """Probability of the target in each cell of a layout, (rows, columns)."""
        ...
