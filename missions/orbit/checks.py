"""What an aircraft can't orbit, refused before anything is flown."""

import math
from typing import Final

from flightsim.foundation.atmosphere import GRAVITY_M_S2
from missions.errors import PlanError
from missions.orbit.options import OrbitOptions
from missions.vehicle.limits import FixedWingLimits, Limits

LEAST_DEPRESSION_RAD: Final = math.radians(8.0)
_MARGIN_RAD: Final = math.radians(3.0)


def airspeed_of(options: OrbitOptions, limits: FixedWingLimits) -> float:
    """Equivalent airspeed of the orbit."""
    return limits.airspeed_trim_m_s if options.airspeed_m_s is None else options.airspeed_m_s


def check_vehicle(options: OrbitOptions, limits: Limits) -> None:
    """Refuse an orbit that the aircraft can't hold, or from which the target can't be seen.

    Raises:
        PlanError: names the reason and what to change.
    """
    if not isinstance(limits, FixedWingLimits):
        raise PlanError("orbit is flown by aircraft with wings; choose `model=aerosonde`, or another one")
    airspeed_m_s = airspeed_of(options, limits)
    limits.check_airspeed(airspeed_m_s)
    limits.check_separation(options.separation_m, options.vehicles)
    limits.check_altitude(options.own_altitude_m)
    reach_m = math.hypot(*options.target_ne_m) + options.entry_distance_m
    if not reach_m <= limits.reach_m:
        raise PlanError(
            f"the entry of the orbit may be {reach_m:.0f} m from home, more than {limits.reach_m:g} m; "
            "ask for a `target_ne_m` nearer to home, or a smaller `entry_distance_m`"
        )
    least_m = limits.turn_radius_m(airspeed_m_s, drift_m_s=options.estimator.target_speed_m_s)
    if options.radius_m < least_m:
        raise PlanError(
            f"an orbit of radius {options.radius_m:g} m can't be held: at {airspeed_m_s:g} m/s of "
            "airspeed, in "
            f"{limits.wind_m_s:.3g} m/s of wind and around a target that moves at "
            f"{options.estimator.target_speed_m_s:g} m/s, "
            f"{math.degrees(limits.bank_max_rad):.0f} degrees of bank ({limits.bank_parameter}) make "
            "a circle of "
            f"{least_m:.0f} m or more; ask for `radius_m` {10.0 * math.ceil(0.1 * least_m):g}, or a "
            "lower `airspeed_m_s`"
        )
    if options.height_over_target_m <= 0.0:
        raise PlanError(
            f"the target's ground, {options.estimator.target_ground_m:g} m above home, is not below the "
            f"aircraft at {options.own_altitude_m:g} m; change `altitude_m`"
        )
    depression = math.atan2(options.height_over_target_m, options.radius_m)
    if depression < LEAST_DEPRESSION_RAD:
        raise PlanError(
            f"from {options.height_over_target_m:g} m above it, at {options.radius_m:g} m, the target "
            "would be seen "
            f"only {math.degrees(depression):.1f} degrees below the horizon, too flat to measure its "
            "distance; "
            f"{math.degrees(LEAST_DEPRESSION_RAD):g} are needed: ask for a higher `altitude_m` or a "
            "smaller `radius_m`"
        )


def check_camera(
    options: OrbitOptions, limits: FixedWingLimits, pitch_min_rad: float, pitch_max_rad: float
) -> None:
    """Refuse an orbit on which the target would be outside the gimbal's range.

    On the circle the target is abeam: the bank lifts the horizon on its side, so that relative to the
    body the target is (depression - bank) down.
    """
    true_m_s = limits.true_airspeed_m_s(airspeed_of(options, limits))
    depression = math.atan2(options.height_over_target_m, options.radius_m)
    slower = max(5.0, true_m_s - limits.wind_m_s - options.estimator.target_speed_m_s)
    faster = true_m_s + limits.wind_m_s + options.estimator.target_speed_m_s
    for speed in (slower, faster):
        bank = math.atan(speed**2 / (GRAVITY_M_S2 * options.radius_m))
        elevation = bank - depression
        if not pitch_min_rad + _MARGIN_RAD <= elevation <= pitch_max_rad - _MARGIN_RAD:
            raise PlanError(
                f"on the orbit the target would be {math.degrees(elevation):.0f} degrees above the "
                "wing's plane, "
                f"outside what the camera's gimbal reaches ({math.degrees(pitch_min_rad):.0f} to "
                f"{math.degrees(pitch_max_rad):.0f} degrees); change `radius_m` or `altitude_m`"
            )
