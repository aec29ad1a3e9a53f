"""What a stream of setpoints can contain, for both classes of vehicle."""

import math
from enum import IntEnum
from typing import Final

from autopilot_bridge.flight.context import Array

NAN3: Final = (math.nan, math.nan, math.nan)

Vector = Array | tuple[float, float, float]
"""Three components, local NED or body FRD."""


class OffboardKind(IntEnum):
    """The quantity that the latest setpoint controls."""

    NONE = 0
    TRAJECTORY = 1
    ATTITUDE = 2
    RATES = 3


class GuidedKind(IntEnum):
    """The kind of the present target."""

    HOLD = 0
    POSITION = 1
    VELOCITY = 2
    ACCELERATION = 3
    TRAJECTORY = 4  # position and velocity together, streamed
    ATTITUDE = 5
    HEADING = 6  # of a fixed wing: a constant direction
