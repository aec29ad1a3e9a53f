"""Parameters of the estimator `orbit-target`, of its tracker and of its filter."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from flightsim.foundation.options import Options, option

PRESSURES_PA: Final = (10_000.0, 120_000.0)
"""Pressures between which an aircraft flies."""


class AttitudeFrom(StrEnum):
    """The source of roll and pitch."""

    AUTOPILOT = "autopilot"
    FILTER = "filter"
    """Our own filter, fed with the aircraft's inertial sensors and airspeed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RelativeTargetParameters(Options):
    """Noise of the filter; standard deviations."""

    angle_rad: float = option(
        math.radians(0.5), above=0.0, help="Standard deviation of a line of sight: pixels, gimbal, attitude."
    )
    drift_acceleration_m_s2_per_root_hz: float = option(
        0.7, above=0.0, help="Random walk of the target against the air: gusts, and a target that turns."
    )
    offset_rate_m_per_root_s: float = option(
        0.3, above=0.0, help="Random walk of the offset: sideslip, compass, time stamps."
    )
    gate: float = option(
        13.8, above=0.0, help="Largest normalized innovation squared of an accepted detection."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class TrackerParameters(RelativeTargetParameters):
    """Parameters of the tracker and of its filter."""

    acquired_after: int = option(
        3, least=1, help="Number of accepted detections in a row with which the target is acquired."
    )
    lost_after_s: float = option(
        3.0, above=0.0, help="Time without an accepted detection after which an acquired target is lost."
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitTargetParameters(TrackerParameters):
    """Parameters of `OrbitTargetEstimator`."""

    attitude: AttitudeFrom = option(
        AttitudeFrom.AUTOPILOT, help="Source of roll and pitch: the autopilot, or our own filter."
    )
    target_north_m: float | None = option(
        None, varies="the first detection", help="Place north of home where the target is expected."
    )
    target_east_m: float | None = option(
        None, varies="the first detection", help="Place east of home where the target is expected."
    )
    target_speed_m_s: float = option(0.0, least=0.0, most=15.0, help="Expected speed of the target.")
    target_heading_rad: float = option(0.0, help="Direction in which the target is expected to move.")
    target_sigma_m: float = option(
        20.0, above=0.0, help="Standard deviation of the expected place (paper: 20 m)."
    )
    drift_sigma_m_s: float = option(
        2.0, above=0.0, help="Standard deviation of the target's velocity relative to the air."
    )
    target_ground_m: float = option(0.0, help="Height of the target's ground above that of the start.")
    ground_pa: float | None = option(
        None,
        above=PRESSURES_PA[0],
        below=PRESSURES_PA[1],
        varies="measured before it is armed",
        help="Pressure on the ground.",
    )

    def check_together(self) -> None:
        if (self.target_north_m is None) != (self.target_east_m is None):
            raise ValueError("target_north_m and target_east_m make a place together; give both, or neither")
