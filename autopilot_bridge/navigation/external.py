"""Pose and velocity measured by an external system: visual odometry, motion capture.

The navigation filter receives them as `ExternalSample`s. They come from messages, so their values are
untrusted.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

POSITION_M: Final = slice(0, 3)
Q_LOCAL_FROM_FRD: Final = slice(3, 7)
VELOCITY_M_S: Final = slice(7, 10)
SAMPLE_SIZE: Final = 10


class ExternalFrame(IntEnum):
    """Axes that a sample's vectors are in."""

    NED = 0  # north, east, down
    LOCAL_FRD = 1  # level, but with a separate heading reference
    BODY_FRD = 2  # the vehicle's; velocities only


@dataclass(frozen=True, slots=True, kw_only=True)
class ExternalSample:
    """One measurement.

    Attributes:
        time_us: vehicle time at which it was taken; of its arrival where that is not known.
        values: float64[SAMPLE_SIZE]: position m, attitude (Hamilton, w x y z), velocity m/s; NaN: not there.
        frame: of position and attitude.
        velocity_frame: of the velocity.
        position_variance_m2, velocity_variance_m2_s2: of the three axes; NaN: not known.
        yaw_variance_rad2: NaN: not known.
        reset_counter: changes when the sender's estimate has jumped.
        quality: 1 to 100 %; 0: not known, -1: the sender's estimate has failed.
    """

    time_us: int
    values: Array
    frame: ExternalFrame
    velocity_frame: ExternalFrame
    position_variance_m2: tuple[float, float, float]
    velocity_variance_m2_s2: tuple[float, float, float]
    yaw_variance_rad2: float
    reset_counter: int = 0
    quality: int = 0


class ExternalCounts:
    """What became of the samples.

    Attributes:
        taken: came in.
        fused: moved the estimate.
        refused: all that was to be fused was beyond its gate.
        not_finite: no usable value, or values beyond the limits.
        late: older than the filter's history.
        poor: of too little quality.
        frozen: the same to the last digit, in flight.
        incoherent: moves in another way than the vehicle, so that nothing is begun with it.
        flooded: more than are looked at between two updates.
        resets: jumps of the estimate to the sender's values.
    """

    def __init__(self) -> None:
        self.taken = self.fused = self.refused = self.not_finite = self.late = 0
        self.poor = self.frozen = self.incoherent = self.flooded = self.resets = 0


def variance_of(reported: float, noise: float, *, own: bool) -> float:
    """The variance that the filter uses for a variance in a message.

    Args:
        reported: the sender's; NaN or an invalid value: not known.
        noise: 1-sigma: the smallest value used.
        own: only `noise` is used.
    """
    least = noise * noise
    return least if own or not 0.0 < reported < 1e6 else max(reported, least)
