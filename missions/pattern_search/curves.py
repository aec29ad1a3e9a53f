"""The curve of each search pattern from the options, and sizes that suit an aircraft's turns."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final

from missions.base.options import FlightOptions
from missions.errors import PlanError
from missions.patterns import (
    Curve,
    Lap,
    Lissajous,
    Polyline,
    ergodic,
    expanding_square,
    named_lissajous,
    parallel_sweep,
    sector,
)
from missions.patterns.lissajous import reduced_ratio
from missions.planning.sizing import (
    curve_side_m,
    legs_side_m,
    sector_side_m,
    spacing_for_turns_m,
    spacing_within_m,
)
from missions.vehicle.limits import FixedWingLimits

MAX_LENGTH_M: Final = 100_000.0
"""Longest pattern that is planned: some hours of flight, and small enough for a planner's memory."""

MAX_FLIGHT_S: Final = 20_000.0
"""The same limit as a time: a faster vehicle may fly farther."""


def _check_length(length_m: float, options: FlightOptions) -> None:
    """Refuse a pattern by its approximate length, before its points are computed."""
    most_m = max(MAX_LENGTH_M, MAX_FLIGHT_S * options.speed_m_s)
    if length_m > most_m:
        raise PlanError(
            f"the pattern is about {1e-3 * length_m:.4g} km long, more than {1e-3 * most_m:g} km; "
            "ask for less `periods` or `search_time_s`, a smaller `width_m, height_m`, a wider `spacing_m`, "
            "a simpler `ratio`"
        )


def _lissajous_length_m(shape: Lissajous, laps: float) -> float:
    """Approximate length: the root mean square of the speed in the parameter, times its range."""
    speed = math.hypot(shape.amplitude_x_m * shape.ratio_x, shape.amplitude_y_m * shape.ratio_y)
    return math.sqrt(0.5) * speed * shape.end * laps


def _passes(options: FlightOptions, one_pass_m: float) -> int:
    """Number of whole passes from `--periods`, or enough passes for the search time."""
    if options.search_time_s is not None:
        return max(1, math.ceil(options.search_time_s * options.speed_m_s / one_pass_m))
    if not float(options.periods).is_integer():
        raise PlanError(f"`periods` {options.periods:g}: this pattern is flown in whole passes")
    return int(options.periods)


def _in_passes(make: Callable[[int], Polyline], options: FlightOptions, rough_length_m: float) -> Polyline:
    """The pattern with the requested number of passes; one pass has about the given length."""
    _check_length(rough_length_m, options)
    one_pass_m = make(1).length_m
    passes = _passes(options, one_pass_m)
    _check_length(one_pass_m * passes, options)
    return make(passes)


def lissajous_curve(options: FlightOptions) -> Curve:
    """The Lissajous pattern that the options describe, in laps; the vehicles of a team start evenly spaced on
    it.
    """
    if options.ratio is None:
        shape = named_lissajous(options.pattern, width_m=options.width_m, height_m=options.height_m)
    else:
        ratio_x, ratio_y = reduced_ratio(*options.ratio)
        shape = Lissajous(
            amplitude_x_m=0.5 * options.width_m,
            amplitude_y_m=0.5 * options.height_m,
            ratio_x=ratio_x,
            ratio_y=ratio_y,
            phase_x_rad=0.5 * math.pi,
        )
    if options.phase_x_rad is not None:
        shape = replace(shape, phase_x_rad=options.phase_x_rad)
    if options.phase_y_rad is not None:
        shape = replace(shape, phase_y_rad=options.phase_y_rad)
    if not shape.closed:
        slower_turns = options.periods
        if options.search_time_s is not None:
            slowest_turn_m = 2.0 * min(options.width_m, options.height_m)
            slower_turns = max(1.0, options.search_time_s * options.speed_m_s / slowest_turn_m)
        spread = math.tau * options.index / options.vehicles
        shape = replace(shape, open_turns=slower_turns)
        _check_length(_lissajous_length_m(shape, 1.0), options)
        return replace(
            shape,
            phase_x_rad=shape.phase_x_rad + spread * shape.ratio_x,
            phase_y_rad=shape.phase_y_rad + spread * shape.ratio_y,
        )
    laps = options.periods
    if options.search_time_s is not None:
        if options.period_s is not None:
            laps = math.ceil(options.search_time_s / options.period_s)
        else:
            once_m = 2.0 * math.hypot(options.width_m, options.height_m)
            laps = max(1, math.ceil(options.search_time_s * options.speed_m_s / once_m))
    _check_length(_lissajous_length_m(shape, laps), options)
    return Lap(curve=shape, laps=laps, start=options.index / options.vehicles)


def sector_curve(options: FlightOptions) -> Curve:
    radius_m = 0.5 * min(options.width_m, options.height_m)
    passes = _passes(options, 9.0 * max(radius_m, 1e-3))
    _check_length(9.0 * radius_m * passes, options)
    heading = options.heading_rad + math.radians(30.0) * options.index / options.vehicles
    return sector(radius_m=radius_m, heading_rad=heading, passes=passes)


def parallel_sweep_curve(options: FlightOptions) -> Curve:
    def make(passes: int) -> Polyline:
        return parallel_sweep(
            width_m=options.width_m,
            height_m=options.height_m,
            spacing_m=options.spacing_m,
            heading_rad=options.heading_rad,
            passes=passes,
        )

    whole = _in_passes(make, options, options.width_m * options.height_m / options.spacing_m)
    return whole.reversed() if options.index % 2 else whole


def expanding_square_curve(options: FlightOptions) -> Curve:
    def make(passes: int) -> Polyline:
        return expanding_square(
            size_m=min(options.width_m, options.height_m),
            spacing_m=options.spacing_m,
            heading_rad=options.heading_rad + math.radians(90.0) * options.index / options.vehicles,
            passes=passes,
        )

    return _in_passes(make, options, min(options.width_m, options.height_m) ** 2 / options.spacing_m)


def ergodic_curve(options: FlightOptions) -> Curve:
    one_pass_m = options.width_m * options.height_m / options.spacing_m
    length_m = one_pass_m * _passes(options, one_pass_m)
    _check_length(length_m, options)
    return ergodic(
        width_m=options.width_m,
        height_m=options.height_m,
        spacing_m=options.spacing_m,
        length_m=length_m,
        heading_rad=options.heading_rad + math.tau * options.index / options.vehicles,
    )


def lissajous_size(options: FlightOptions, limits: FixedWingLimits) -> FlightOptions:
    once = lissajous_curve(replace(options, periods=1.0, search_time_s=None))
    side_m = curve_side_m(once, options.width_m, options.speed_m_s, limits)
    return options.unless_chosen(width_m=side_m, height_m=side_m)


def sector_size(options: FlightOptions, limits: FixedWingLimits) -> FlightOptions:
    side_m = sector_side_m(options.speed_m_s, limits)
    return options.unless_chosen(width_m=side_m, height_m=side_m)


def sweep_size(options: FlightOptions, limits: FixedWingLimits) -> FlightOptions:
    """A sweep reduces its spacing until it divides the side, so each of the two depends on the other."""
    if options.chosen("width_m") or options.chosen("height_m"):
        short_m = min(options.width_m, options.height_m)
        # tracks as long as their spacing, and half the spacing beyond each end
        _require_room(options, max(options.width_m, options.height_m), 2.0, limits)
        return options.unless_chosen(spacing_m=spacing_within_m(short_m, options.speed_m_s, limits))
    return square_size(options, limits)


def _require_room(options: FlightOptions, side_m: float, spacings: float, limits: FixedWingLimits) -> None:
    """Refuse a specified side that is too small for the track spacing that the aircraft's turns need."""
    spacing_m = spacing_for_turns_m(options.speed_m_s, limits)
    if not options.chosen("spacing_m") and side_m < spacings * spacing_m:
        raise PlanError(
            f"`width_m, height_m` {side_m:g} m has no room for the aircraft's turns: "
            f"at {options.speed_m_s:g} m/s in {limits.wind_m_s:.3g} m/s of wind tracks must be "
            f"{spacing_m:g} m apart; ask for `width_m, height_m` "
            f"{spacings * spacing_m:g} or more, or less `speed_m_s`"
        )


def square_size(options: FlightOptions, limits: FixedWingLimits) -> FlightOptions:
    if options.chosen("width_m") or options.chosen("height_m"):
        _require_room(options, min(options.width_m, options.height_m), 1.0, limits)
    side_m = legs_side_m(options.spacing_m)
    return options.unless_chosen(width_m=side_m, height_m=side_m)
