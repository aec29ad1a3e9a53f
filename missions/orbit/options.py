"""Options of an orbit."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Final

from flightsim.foundation.atmosphere import GRAVITY_M_S2
from missions.base.options import MissionOptions, check_positive
from missions.errors import PlanError
from missions.vehicle.gps_switch import GpsOff
from missions.vehicle.limits import FixedWingLimits, Limits

WANDERING_M: Final = 100.0
"""Largest distance of a wandering target from its place: radius of its circle, half the side of its area."""


class AttitudeFrom(StrEnum):
    """The source of roll and pitch for the orbit."""

    AUTOPILOT = "autopilot"
    FILTER = "filter"
    """Our own filter, fed with the aircraft's inertial sensors and airspeed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OrbitOptions(MissionOptions):
    """A circle around a target on the ground.

    Attributes:
        altitude_m: height above home, and so above the target's ground when the ground is level.
        radius_m: horizontal radius.
        direction: +1 clockwise seen from above, -1 counter-clockwise.
        duration_s: time on the circle.
        airspeed_m_s: equivalent airspeed; None: the aircraft's default.
        target_ne_m: estimated position of the target from home, when the vehicle is first received.
        target_speed_m_s, target_heading_rad: estimated motion of the target, along a straight line.
        target_wanders: the path of the target is not known, only that it stays within 100 m of its place.
        target_ground_m: height of the ground at the target, above home.
        entry_bearing_rad: bearing from the target to the place where GPS is lost.
        entry_distance_m: distance between the two.
        entry_heading_rad: heading of the aircraft at that place; None: towards the target.
        gps_fault: GPS is switched off for the orbit.
        gps_off: how GPS is switched off.
        lost_limit_s: the mission ends when the target was not seen for this time.
        attitude: source of roll and pitch; the yaw is the autopilot's.
    """

    altitude_m: float = 100.0
    separation_m: float = 20.0
    radius_m: float = 150.0
    direction: int = 1
    duration_s: float = 600.0
    airspeed_m_s: float | None = None
    target_ne_m: tuple[float, float] = (500.0, 300.0)
    target_speed_m_s: float = 0.0
    target_heading_rad: float = 0.0
    target_wanders: bool = False
    target_ground_m: float = 0.0
    entry_bearing_rad: float = math.pi
    entry_distance_m: float = 400.0
    entry_heading_rad: float | None = None
    gps_fault: bool = True
    gps_off: GpsOff = GpsOff.AUTO
    lost_limit_s: float = 30.0
    attitude: AttitudeFrom = AttitudeFrom.AUTOPILOT

    def __post_init__(self) -> None:
        super(OrbitOptions, self).__post_init__()
        check_positive(
            radius_m=self.radius_m,
            duration_s=self.duration_s,
            airspeed_m_s=self.airspeed_m_s,
            entry_distance_m=self.entry_distance_m,
            lost_limit_s=self.lost_limit_s,
        )
        if self.direction not in (-1, 1):
            raise PlanError(f"`direction` {self.direction} is not 1 (clockwise) or -1")
        if not 0.0 <= self.target_speed_m_s <= 15.0:
            raise PlanError(f"`target_speed_m_s` {self.target_speed_m_s:g} m/s is not in 0..15 m/s")
        if not 1.0 <= self.duration_s <= 6 * 3600.0:
            raise PlanError(f"`duration_s` {self.duration_s:g} s is not in 1..21600 s")
        if not all(math.isfinite(value) for value in self.target_ne_m):
            raise PlanError("`target_ne_m` is not a place; give NORTH,EAST in metres from home")
        if not math.isfinite(self.target_ground_m):
            raise PlanError(
                f"`target_ground_m` {self.target_ground_m:g} m is not a height; give metres above home"
            )

    @property
    def height_over_target_m(self) -> float:
        """Height of this vehicle over the target."""
        return self.own_altitude_m - self.target_ground_m

    @property
    def entry_course_rad(self) -> float:
        """Heading at the place where GPS is lost."""
        if self.entry_heading_rad is not None:
            return self.entry_heading_rad
        return math.remainder(self.entry_bearing_rad + math.pi, math.tau)

    def airspeed(self, limits: FixedWingLimits) -> float:
        """Equivalent airspeed of the orbit."""
        return limits.airspeed_trim_m_s if self.airspeed_m_s is None else self.airspeed_m_s

    def check(self, limits: Limits) -> None:
        """Refuse an orbit that the aircraft can't hold, or from which the target can't be seen.

        Raises:
            PlanError: names the reason and what to change.
        """
        if not isinstance(limits, FixedWingLimits):
            raise PlanError("orbit is flown by aircraft with wings; choose `model=aerosonde`, or another one")
        airspeed_m_s = self.airspeed(limits)
        limits.check_airspeed(airspeed_m_s)
        limits.check_separation(self.separation_m, self.vehicles)
        limits.check_altitude(self.own_altitude_m)
        reach_m = math.hypot(*self.target_ne_m) + self.entry_distance_m
        if not reach_m <= limits.reach_m:
            raise PlanError(
                f"the entry of the orbit may be {reach_m:.0f} m from home, more than {limits.reach_m:g} m; "
                "ask for a `target_ne_m` nearer to home, or a smaller `entry_distance_m`"
            )
        least_m = limits.turn_radius_m(airspeed_m_s, drift_m_s=self.target_speed_m_s)
        if self.radius_m < least_m:
            raise PlanError(
                f"an orbit of radius {self.radius_m:g} m can't be held: at {airspeed_m_s:g} m/s of "
                "airspeed, in "
                f"{limits.wind_m_s:.3g} m/s of wind and around a target that moves at "
                f"{self.target_speed_m_s:g} m/s, "
                f"{math.degrees(limits.bank_max_rad):.0f} degrees of bank ({limits.bank_parameter}) make "
                "a circle of "
                f"{least_m:.0f} m or more; ask for `radius_m` {10.0 * math.ceil(0.1 * least_m):g}, or a "
                "lower `airspeed_m_s`"
            )
        if self.height_over_target_m <= 0.0:
            raise PlanError(
                f"the target's ground, {self.target_ground_m:g} m above home, is not below the aircraft at "
                f"{self.own_altitude_m:g} m; change `altitude_m`"
            )
        depression = math.atan2(self.height_over_target_m, self.radius_m)
        if depression < LEAST_DEPRESSION_RAD:
            raise PlanError(
                f"from {self.height_over_target_m:g} m above it, at {self.radius_m:g} m, the target "
                "would be seen "
                f"only {math.degrees(depression):.1f} degrees below the horizon, too flat to measure its "
                "distance; "
                f"{math.degrees(LEAST_DEPRESSION_RAD):g} are needed: ask for a higher `altitude_m` or a "
                "smaller `radius_m`"
            )

    def check_camera(self, limits: FixedWingLimits, pitch_min_rad: float, pitch_max_rad: float) -> None:
        """Refuse an orbit on which the target would be outside the gimbal's range.

        On the circle the target is abeam: the bank lifts the horizon on its side, so that relative to the
        body the target is (depression - bank) down.
        """
        true_m_s = limits.true_airspeed_m_s(self.airspeed(limits))
        depression = math.atan2(self.height_over_target_m, self.radius_m)
        slower = max(5.0, true_m_s - limits.wind_m_s - self.target_speed_m_s)
        faster = true_m_s + limits.wind_m_s + self.target_speed_m_s
        for speed in (slower, faster):
            bank = math.atan(speed**2 / (GRAVITY_M_S2 * self.radius_m))
            elevation = bank - depression
            if not pitch_min_rad + _MARGIN_RAD <= elevation <= pitch_max_rad - _MARGIN_RAD:
                raise PlanError(
                    f"on the orbit the target would be {math.degrees(elevation):.0f} degrees above the "
                    "wing's plane, "
                    f"outside what the camera's gimbal reaches ({math.degrees(pitch_min_rad):.0f} to "
                    f"{math.degrees(pitch_max_rad):.0f} degrees); change `radius_m` or `altitude_m`"
                )


LEAST_DEPRESSION_RAD = math.radians(8.0)
_MARGIN_RAD = math.radians(3.0)
