"""Geometry of a landing: where it touches down, from where, how steep, and the circle that leads there."""

import math
from dataclasses import dataclass

from autopilot_bridge.flight.context import FlightContext
from autopilot_bridge.flight.fixed_wing.flare import flare_time
from autopilot_bridge.flight.fixed_wing.parameters import FixedWingFlightParameters
from autopilot_bridge.flight.fixed_wing.state import AircraftState


@dataclass(frozen=True, slots=True, kw_only=True)
class Approach:
    """A straight approach, local NED.

    Attributes:
        north_m, east_m, down_m: where the wheels shall touch.
        course_rad: of the approach.
        length_m: from its entry to the place.
        entry_down_m: height at the entry, held until the slope is met.
        slope: sink per metre of way (tangent).
    """

    north_m: float
    east_m: float
    down_m: float
    course_rad: float
    length_m: float
    entry_down_m: float
    slope: float

    @property
    def entry_ned_m(self) -> tuple[float, float, float]:
        """Where the approach begins."""
        return (
            self.north_m - self.length_m * math.cos(self.course_rad),
            self.east_m - self.length_m * math.sin(self.course_rad),
            self.entry_down_m,
        )

    def entry_circle(self, radius_m: float) -> tuple[float, float]:
        """Centre (north, east) of the circle that leads into the approach; the radius has its sign."""
        north, east, _ = self.entry_ned_m
        return (north - radius_m * math.sin(self.course_rad), east + radius_m * math.cos(self.course_rad))

    def flare_shift_m(self, ground_speed_m_s: float, flare_height_m: float, flare_sink_m_s: float) -> float:
        """How far before the place the slope must aim, since the flare carries farther than the slope."""
        before = ground_speed_m_s * self.slope
        if before <= flare_sink_m_s * 1.001:
            return 0.0
        time_s = flare_time(flare_height_m, flare_height_m, before, flare_sink_m_s)
        return ground_speed_m_s * time_s - flare_height_m / self.slope


def approach_along_leg(
    start_ned_m: tuple[float, float, float],
    place_ned_m: tuple[float, float, float],
    parameters: FixedWingFlightParameters,
) -> Approach | None:
    """The approach from a waypoint to the place to land; None when the leg is too short for one.

    Its slope is the leg's, within what is flown: a shallow leg is flown level at first, a steep one at the
    steepest angle (and meets the ground farther on).
    """
    p = parameters
    north, east = place_ned_m[0] - start_ned_m[0], place_ned_m[1] - start_ned_m[1]
    length = math.hypot(north, east)
    height = place_ned_m[2] - start_ned_m[2]
    if length < p.landing.shortest_leg_m or height <= 0.0:
        return None
    slope = height / length
    if slope < p.landing.shallow_share * math.tan(p.landing_angle_rad):
        slope = math.tan(p.landing_angle_rad)
    return Approach(
        north_m=place_ned_m[0],
        east_m=place_ned_m[1],
        down_m=place_ned_m[2],
        course_rad=math.atan2(east, north),
        length_m=length,
        entry_down_m=start_ned_m[2],
        slope=min(slope, math.tan(p.landing_angle_max_rad)),
    )


def approach_into_wind(
    ctx: FlightContext, state: AircraftState, place_ned_m: tuple[float, float, float]
) -> Approach:
    """An approach made up for a place: against the wind; in calm along the runway, or straight on."""
    p = ctx.fixed_wing
    wind = math.hypot(state.wind_north_m_s, state.wind_east_m_s)
    home_n, home_e = float(ctx.home_ned_m[0]), float(ctx.home_ned_m[1])
    near_home = math.hypot(place_ned_m[0] - home_n, place_ned_m[1] - home_e) < p.landing.runway_near_home_m
    if wind > p.landing.calm_m_s:
        course = math.atan2(-state.wind_east_m_s, -state.wind_north_m_s)
    elif near_home and math.isfinite(ctx.home_yaw_rad):
        course = ctx.home_yaw_rad
    else:
        course = state.course_rad
    slope = math.tan(p.landing_angle_rad)
    return Approach(
        north_m=place_ned_m[0],
        east_m=place_ned_m[1],
        down_m=place_ned_m[2],
        course_rad=course,
        # some way is flown level, so that the approach has settled when the slope begins
        length_m=p.landing_loiter_altitude_m / slope + 4.0 * p.landing_airspeed_m_s,
        entry_down_m=place_ned_m[2] - p.landing_loiter_altitude_m,
        slope=slope,
    )
