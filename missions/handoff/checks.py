"""What two aircraft can't hand over, refused before anything is flown."""

import math

from missions.errors import PlanError
from missions.handoff.options import HandoffOptions
from missions.vehicle.limits import FixedWingLimits, Limits


def airspeed_of(options: HandoffOptions, limits: FixedWingLimits) -> float:
    """Equivalent airspeed of the orbits."""
    return limits.airspeed_trim_m_s if options.airspeed_m_s is None else options.airspeed_m_s


def check_vehicle(options: HandoffOptions, limits: Limits) -> None:
    """Refuse a handoff that an aircraft can't fly.

    Raises:
        PlanError: names the reason and what to change.
    """
    if options.vehicles != 2:
        raise PlanError(f"`vehicles` {options.vehicles}: a handoff is flown by 2 aircraft")
    if not isinstance(limits, FixedWingLimits):
        raise PlanError("handoff is flown by aircraft with wings; choose `model=aerosonde`, or another one")
    airspeed_m_s = airspeed_of(options, limits)
    limits.check_airspeed(airspeed_m_s)
    limits.check_separation(options.separation_m, options.vehicles)
    limits.check_altitude(options.own_altitude_m)
    least_m = limits.turn_radius_m(airspeed_m_s)
    if options.radius_m < least_m:
        raise PlanError(
            f"an orbit of radius {options.radius_m:g} m can't be held at {airspeed_m_s:g} m/s: "
            f"{least_m:.0f} m or more can; ask for `radius_m` {10.0 * math.ceil(0.1 * least_m):g}, or "
            "a lower `airspeed_m_s`"
        )
    orbit_m = options.tracker_radius_m
    reach_m = max(math.hypot(*options.target_ne_m), math.hypot(*options.start_ne_m)) + orbit_m
    if reach_m > limits.reach_m:
        raise PlanError(
            f"the orbits may be {reach_m:.0f} m from home, more than {limits.reach_m:g} m; ask for a "
            "`target_ne_m` nearer to home, or a smaller `start_distance_m`"
        )
    if options.own_altitude_m < 0.2 * orbit_m:
        raise PlanError(
            f"from {options.own_altitude_m:g} m at {orbit_m:g} m targets are seen too flat to "
            "measure their places; ask for a higher `altitude_m` or a smaller `radius_m`"
        )
