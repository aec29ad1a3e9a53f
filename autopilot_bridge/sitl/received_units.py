"""Units that can fail although messages carry their samples: external odometry, the avoidance sensor."""

import math
from typing import Final, NamedTuple

from autopilot_bridge.navigation.external import SAMPLE_SIZE
from flightsim.sensors.fault_kinds import FaultTarget, SensorUnit

OBSTACLE_SECTORS: Final = 72
"""Number of sectors in OBSTACLE_DISTANCE."""

_NAN4: Final = (math.nan,) * 4


class ReceivedUnit(NamedTuple):
    """A unit, the size of its samples and their approximate rate per second."""

    target: FaultTarget
    size: int
    rate_hz: float


RECEIVED_UNITS: Final = (
    ReceivedUnit(
        FaultTarget(
            unit=SensorUnit.VIO,
            channels=slice(0, SAMPLE_SIZE),
            wrong_bias=(2.0, -1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.5, -0.3, 0.1),
            drift_per_s=(0.2, -0.1, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
            low=(-50.0, -50.0, -50.0, *_NAN4, -20.0, -20.0, -20.0),
            high=(50.0, 50.0, 50.0, *_NAN4, 20.0, 20.0, 20.0),
        ),
        SAMPLE_SIZE,
        30.0,
    ),
    ReceivedUnit(
        FaultTarget(
            unit=SensorUnit.AVOIDANCE,
            channels=slice(0, OBSTACLE_SECTORS),
            wrong_bias=(2.0,) * OBSTACLE_SECTORS,
            drift_per_s=(0.1,) * OBSTACLE_SECTORS,
            low=(0.0,) * OBSTACLE_SECTORS,
            high=(20.0,) * OBSTACLE_SECTORS,
        ),
        OBSTACLE_SECTORS,
        10.0,
    ),
)
"""Values of the samples. Odometry: position m, attitude, velocity m/s; obstacles: distance m by sector."""
