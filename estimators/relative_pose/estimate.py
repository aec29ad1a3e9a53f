"""The estimate of the estimator `relative-pose`."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from estimators.relative_pose.belief import PoseMode


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativePoseEstimate:
    """Where another aircraft is, in the level frame of one aircraft.

    Attributes:
        time_us: time on the base common to both.
        subject: system id of the aircraft in whose frame it is.
        modes: the modes, the most probable first; more than one while the bearing is ambiguous.
        converged: whether one mode holds nearly all probability and is narrow.
        resets: times that the belief started anew.
    """

    COLUMNS: ClassVar[tuple[str, ...]] = (
        *("forward_m", "right_m", "down_m", "relative_heading_rad", "bearing_rad", "horizontal_range_m"),
        *("horizontal_sigma_m", "heading_sigma_rad", "weight", "modes", "second_bearing_rad"),
        *("converged", "resets"),
    )

    time_us: int
    subject: int
    modes: Sequence[PoseMode]
    converged: bool
    resets: int

    def row(self) -> tuple[float, ...]:
        """The values in the order of `COLUMNS`; those of the most probable mode."""
        best = self.modes[0]
        return (
            *(best.forward_m, best.right_m, best.down_m, best.heading_rad),
            *(best.bearing_rad, best.horizontal_range_m, best.horizontal_sigma_m),
            *(math.sqrt(float(best.covariance[3, 3])), best.weight, float(len(self.modes))),
            self.modes[1].bearing_rad if len(self.modes) > 1 else math.nan,
            *(float(self.converged), float(self.resets)),
        )
