"""Options of an orbit."""

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Final

from estimators.orbit_target.parameters import OrbitTargetParameters
from flightsim.foundation.options import held, option, other_default
from missions.base.options import MissionOptions
from missions.errors import PlanError
from missions.gps_off import GpsOff

WANDERING_M: Final = 100.0
"""Largest distance of a wandering target from its place: radius of its circle, half the side of its area."""
_FASTEST_M_S: Final = 15.0  # of a target on the ground


class Direction(IntEnum):
    """Direction of a circle, seen from above."""

    CW = 1
    CCW = -1


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitOptions(MissionOptions):
    """A circle around a target on the ground.

    Attributes:
        target_wanders: the path of the target is not known, only that it stays within 100 m of its place.
    """

    altitude_m: float = other_default(100.0)
    separation_m: float = other_default(20.0)
    radius_m: float = option(150.0, above=0.0, help="Radius of the orbit, horizontal.")
    direction: Direction = option(Direction.CW, help="Direction of the orbit, seen from above.")
    duration_s: float = option(600.0, least=1.0, most=6 * 3600.0, help="Time on the orbit.")
    airspeed_m_s: float | None = option(
        None, above=0.0, varies="the aircraft's own", help="Equivalent airspeed of the aircraft."
    )
    target_ne_m: tuple[float, float] = option(
        (500.0, 300.0),
        metavar="NORTH,EAST",
        help="Place of the target at the beginning, m from home, as reported before the flight.",
    )
    target_wanders: bool = False
    entry_bearing_rad: float = option(math.pi, help="Bearing from the target to the place where GPS is lost.")
    entry_distance_m: float = option(
        400.0, above=0.0, help="Distance from the target to the place where GPS is lost."
    )
    entry_heading_rad: float | None = option(
        None, varies="towards the target", help="Heading of the aircraft where GPS is lost."
    )
    gps_fault: bool = option(True, help="GPS is left on; the orbit doesn't use it.")
    gps_off: GpsOff = option(
        GpsOff.AUTO, help="Way of switching GPS off: MAV_CMD_INJECT_FAILURE, a parameter, or what works."
    )
    lost_limit_s: float = option(
        30.0, above=0.0, help="Time without the target after which the orbit is given up."
    )
    estimator: OrbitTargetParameters = held(
        OrbitTargetParameters(),
        target_speed="target_speed_m_s",
        target_heading="target_heading_rad",
        target_ground="target_ground_m",
        attitude="attitude",
    )

    def check_together(self) -> None:
        speed_m_s = self.estimator.target_speed_m_s
        if speed_m_s > _FASTEST_M_S:
            raise PlanError(f"`target_speed_m_s` {speed_m_s:g} m/s is not in 0..{_FASTEST_M_S:g} m/s")

    @property
    def height_over_target_m(self) -> float:
        """Height of this vehicle over the target."""
        return self.own_altitude_m - self.estimator.target_ground_m

    @property
    def entry_course_rad(self) -> float:
        """Heading at the place where GPS is lost."""
        if self.entry_heading_rad is not None:
            return self.entry_heading_rad
        return math.remainder(self.entry_bearing_rad + math.pi, math.tau)
