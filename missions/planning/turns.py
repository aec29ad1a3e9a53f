"""Whether an aircraft that can't stop can follow a curve: its bends against the tightest turn."""

import math
from typing import Final

import numpy as np

from missions.errors import PlanError
from missions.patterns.curve import Curve, curvature_per_m
from missions.patterns.polyline import Polyline
from missions.planning.corners import corner_reach_m
from missions.planning.limits import FixedWingLimits

_SAMPLES: Final = 20_000
_ROLL_S: Final = 1.0  # to roll from level into the steepest turn, with the time the roll takes to begin
_SHARPEST_RAD: Final = math.radians(170.0)


def smallest_radius_m(curve: Curve) -> float:
    """Radius of the tightest bend of a smooth curve."""
    u = np.linspace(0.0, curve.end, _SAMPLES)
    return 1.0 / max(1e-9, float(np.abs(curvature_per_m(*curve.derivatives(u))).max()))


def roll_in_m(airspeed_m_s: float, limits: FixedWingLimits) -> float:
    """Distance flown over ground while rolling into a turn, at most."""
    return (airspeed_m_s + limits.wind_m_s) * _ROLL_S


def leg_needed_m(turn_rad: float, airspeed_m_s: float, limits: FixedWingLimits) -> float:
    """Length of a leg with such a corner at both its ends."""
    radius_m = limits.turn_radius_m(airspeed_m_s)
    return 2.0 * corner_reach_m(turn_rad, radius_m, roll_in_m(airspeed_m_s, limits))


def check_turns(curve: Curve, airspeed_m_s: float, limits: FixedWingLimits) -> float:
    """Refuse a curve that is too tight; gives the turn radius it was checked for.

    A polyline's corners are turned as `planning.corners` has it: each takes a part of both its legs.

    Raises:
        PlanError: says how tight it is, and what to change.
    """
    radius_m = limits.turn_radius_m(airspeed_m_s)
    needs = (
        f"{radius_m:.0f} m at {airspeed_m_s:g} m/s in {limits.wind_m_s:g} m/s of wind with "
        f"{math.degrees(limits.bank_max_rad):.0f} degrees of bank ({limits.bank_parameter})"
    )
    if isinstance(curve, Polyline):
        _check_corners(curve, radius_m, roll_in_m(airspeed_m_s, limits), needs)
        return radius_m
    tightest_m = smallest_radius_m(curve)
    if tightest_m < radius_m:
        factor = radius_m / tightest_m
        raise PlanError(
            f"the pattern bends with a radius of {tightest_m:.0f} m at its tightest, and the aircraft needs "
            f"{needs}; make --size {_scaled(factor)} times larger, choose a simpler --ratio or --pattern, or "
            "lower --speed"
        )
    return radius_m


def _check_corners(curve: Polyline, radius_m: float, ramp_m: float, needs: str) -> None:
    vertices = curve.vertices_m
    lengths = curve.leg_lengths_m
    taken = [0.0] * len(lengths)
    for k in range(1, len(vertices) - 1):
        (n0, e0), (n1, e1), (n2, e2) = vertices[k - 1], vertices[k], vertices[k + 1]
        turn = abs(math.remainder(math.atan2(e2 - e1, n2 - n1) - math.atan2(e1 - e0, n1 - n0), math.tau))
        if turn > _SHARPEST_RAD:
            raise PlanError(
                "the pattern turns straight back on its own leg, which an aircraft can't; choose another "
                "pattern, --periods 1 or a shorter --search-time"
            )
        part = corner_reach_m(turn, radius_m, ramp_m)
        taken[k - 1] += part
        taken[k] += part
    short = max((part / length, length) for part, length in zip(taken, lengths, strict=True))
    if short[0] > 1.0:
        raise PlanError(
            f"a leg of {short[1]:.0f} m is too short to turn at both its ends: the aircraft needs {needs}; "
            f"make --spacing (or --size, for sectors) {_scaled(short[0])} times larger, or lower --speed"
        )


def _scaled(factor: float) -> str:
    return f"{math.ceil(10.0 * factor) / 10.0:g}"
