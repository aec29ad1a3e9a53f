"""Checks whether an aircraft that can't stop can follow a curve, by its tightest turn."""

import math
from typing import Final

import numpy as np

from missions.errors import PlanError
from missions.patterns.curve import Curve, curvature_per_m
from missions.patterns.polyline import Polyline
from missions.planning.corners import corner_reach_m
from missions.vehicle.limits import FixedWingLimits

_SAMPLES: Final = 20_000
# time to roll from level into the steepest turn, including the delay before the roll begins
_ROLL_S: Final = 1.0
_SAME: Final = 1e-3
_SHARPEST_RAD: Final = math.radians(170.0)


def smallest_radius_m(curve: Curve) -> float:
    """Radius of the tightest bend of a smooth curve."""
    u = np.linspace(0.0, curve.end, _SAMPLES)
    return 1.0 / max(1e-9, float(np.abs(curvature_per_m(*curve.derivatives(u))).max()))


def roll_in_m(airspeed_m_s: float, limits: FixedWingLimits) -> float:
    """Largest distance flown over ground while rolling into a turn."""
    return (limits.true_airspeed_m_s(airspeed_m_s) + limits.wind_m_s) * _ROLL_S


def leg_needed_m(turn_rad: float, airspeed_m_s: float, limits: FixedWingLimits) -> float:
    """Length of a leg with such a corner at both ends."""
    radius_m = limits.path_radius_m(airspeed_m_s)
    return 2.0 * corner_reach_m(turn_rad, radius_m, roll_in_m(airspeed_m_s, limits))


def check_turns(
    curve: Curve,
    airspeed_m_s: float,
    limits: FixedWingLimits,
    *,
    radius_m: float | None = None,
    size_m: tuple[float, float] | None = None,
    spacing_m: float | None = None,
) -> float:
    """Refuse a curve that is too tight; returns the turn radius that it was checked for.

    A polyline's corners are rounded as in `planning.corners`: each corner uses a part of both its legs.

    Args:
        curve: the curve to be flown.
        airspeed_m_s: equivalent airspeed.
        limits: limits of the aircraft.
        radius_m: smallest turn radius; None: the limits' radius for a path that the autopilot's guidance
            follows.
        size_m, spacing_m: width and height, and track spacing, that the curve was made for; the error message
            then names values that are sufficient.

    Raises:
        PlanError: names the turn radius and what to change.
    """
    if radius_m is None:
        radius_m = limits.path_radius_m(airspeed_m_s)
    reason = f"{math.degrees(limits.bank_max_rad):.0f} degrees of bank ({limits.bank_parameter})"
    if radius_m > limits.turn_radius_m(airspeed_m_s):
        reason = f"its path guidance ({limits.guidance_parameter})"
    needs = f"{radius_m:.0f} m at {airspeed_m_s:g} m/s in {limits.wind_m_s:.3g} m/s of wind with {reason}"
    if isinstance(curve, Polyline):
        short = _shortest_leg(curve, radius_m, roll_in_m(airspeed_m_s, limits))
        if short[0] > 1.0:
            between_tracks = spacing_m is not None and abs(short[1] - spacing_m) < _SAME * spacing_m
            change = f"ask for `spacing_m` {_tens(short[0] * short[1]):g}" if between_tracks else ""
            raise PlanError(
                f"a leg of {short[1]:.0f} m is too short to turn at both its ends: the aircraft needs "
                f"{needs}; {change or _larger(short[0], size_m)}, or lower `speed_m_s`"
            )
        return radius_m
    tightest_m = smallest_radius_m(curve)
    if tightest_m < radius_m:
        factor = radius_m / tightest_m
        raise PlanError(
            f"the pattern bends with a radius of {tightest_m:.0f} m at its tightest, and the aircraft needs "
            f"{needs}; {_larger(factor, size_m)}, choose a simpler `ratio` or `pattern`, or lower `speed_m_s`"
        )
    return radius_m


def _shortest_leg(curve: Polyline, radius_m: float, ramp_m: float) -> tuple[float, float]:
    """(needed length over present length, present length m) of the leg that is shortest for its turns."""
    vertices = curve.vertices_m
    lengths = curve.leg_lengths_m
    taken = [0.0] * len(lengths)
    for k in range(1, len(vertices) - 1):
        (n0, e0), (n1, e1), (n2, e2) = vertices[k - 1], vertices[k], vertices[k + 1]
        turn = abs(math.remainder(math.atan2(e2 - e1, n2 - n1) - math.atan2(e1 - e0, n1 - n0), math.tau))
        if turn > _SHARPEST_RAD:
            raise PlanError(
                "the pattern turns straight back on its own leg, which an aircraft can't; choose another "
                "pattern, `periods=1` or a shorter `search_time_s`"
            )
        part = corner_reach_m(turn, radius_m, ramp_m)
        taken[k - 1] += part
        taken[k] += part
    return max((part / length, length) for part, length in zip(taken, lengths, strict=True))


def _larger(factor: float, size_m: tuple[float, float] | None) -> str:
    if size_m is None:
        return f"make `width_m, height_m` {_scaled(factor)} times larger"
    width_m, height_m = (_tens(factor * side_m) for side_m in size_m)
    return f"ask for `width_m, height_m` {width_m:g}" + ("" if width_m == height_m else f"x{height_m:g}")


def _tens(value_m: float) -> float:
    return 10.0 * math.ceil(0.1 * value_m)


def _scaled(factor: float) -> str:
    return f"{math.ceil(10.0 * factor) / 10.0:g}"
