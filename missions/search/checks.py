"""What a vehicle can fly of a search by steps."""

import math

from missions.errors import PlanError
from missions.search.options import StepSearchOptions
from missions.vehicle.limits import FixedWingLimits, Limits


def check_steps(options: StepSearchOptions, limits: Limits) -> tuple[float, float]:
    """Refuse layers, altitude, area, speed and steps that one vehicle can't fly.

    Returns:
        Step and speed.

    Raises:
        PlanError: names the option to change.
    """
    limits.check_separation(options.separation_m, options.vehicles)
    limits.check_altitude(options.own_altitude_m)
    area = options.area
    reach_m = math.hypot(max(abs(area.south_m), abs(area.north_m)), max(abs(area.west_m), abs(area.east_m)))
    if not reach_m <= limits.reach_m:
        raise PlanError(
            f"the searched area reaches {reach_m:.0f} m from home, more than {limits.reach_m:g} m; "
            "ask for a smaller `area_m`, or one nearer to home"
        )
    step_m, speed_m_s = options.step_m, options.speed_m_s
    if step_m is None or speed_m_s is None:
        raise PlanError("the options are not those of a vehicle yet: see for_vehicle")
    if not isinstance(limits, FixedWingLimits):
        limits.check_speed(speed_m_s)
        return step_m, speed_m_s
    limits.check_airspeed(speed_m_s)
    radius_m = limits.turn_radius_m(speed_m_s)
    if step_m < radius_m:
        raise PlanError(
            f"`step_m` {step_m:g} m is too short for an aircraft whose turns have a radius of "
            f"{radius_m:.0f} m; ask for {math.ceil(radius_m)} m or more, or a lower `speed_m_s`"
        )
    return step_m, speed_m_s
