"""The missions of this package, and users' own missions."""

import importlib.util
import inspect
import math
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from autopilot_bridge.errors import BridgeError
from autopilot_bridge.mission_plan import MissionItem
from missions.errors import MissionError, PlanError
from missions.mission import Debriefing, Mission
from missions.occupancy.mission import OccupancyMission
from missions.options import FlightOptions
from missions.orbit.mission import OrbitMission
from missions.outline import Outline
from missions.patterns import (
    Curve,
    Lap,
    Lissajous,
    Polyline,
    expanding_square,
    named_lissajous,
    parallel_sweep,
    sector,
)
from missions.patterns.lissajous import reduced_ratio
from missions.plan_files.mission import FileMission
from missions.plan_files.suffixes import SUFFIXES as MISSION_FILES
from missions.planning.limits import FixedWingLimits, Limits
from missions.planning.sizing import (
    curve_side_m,
    legs_side_m,
    sector_side_m,
    spacing_for_turns_m,
    spacing_within_m,
)
from missions.vehicle.vehicle import Vehicle

CurveMaker = Callable[[FlightOptions], Curve]
Sizing = Callable[[FlightOptions, FixedWingLimits], FlightOptions]


class PatternMission(Mission[FlightOptions]):
    """A mission that flies one search pattern.

    Args:
        name: name for users and for file names.
        make_curve: creates the pattern from options.
        size: gives values to size options that the user did not specify, so that a fixed-wing aircraft can
            fly the turns.
    """

    def __init__(self, name: str, make_curve: CurveMaker, size: Sizing) -> None:
        self.name = name
        self._make_curve = make_curve
        self._size = size

    def adapted(self, options: FlightOptions, limits: Limits) -> FlightOptions:
        options = options.for_vehicle(limits)
        return self._size(options, limits) if isinstance(limits, FixedWingLimits) else options

    def check(self, options: FlightOptions, limits: Limits) -> None:
        from missions.pattern_search.flight import check_pattern

        for name in options.arguments:
            raise PlanError(f"--arg {name}: {self.name} takes none; they are for missions of your own")
        check_pattern(self.curve(options), options, limits)

    def curve(self, options: FlightOptions) -> Curve:
        """The pattern around its centre, with the requested number of passes."""
        return self._make_curve(options)

    async def plan_items(self, vehicle: Vehicle, options: FlightOptions) -> Sequence[MissionItem]:
        from missions.pattern_search.flight import pattern_items

        return await pattern_items(vehicle, options, self.curve(options))

    async def outline(self, vehicle: Vehicle, options: FlightOptions) -> Outline:
        from missions.pattern_search.flight import pattern_outline

        return pattern_outline(vehicle, options, self.curve(options))

    async def fly(self, vehicle: Vehicle, options: FlightOptions) -> None:
        from missions.pattern_search.flight import fly_pattern

        await fly_pattern(vehicle, options, self.curve(options))

    def estimator_settings(self, options: FlightOptions) -> Mapping[str, float]:
        if options.period_s is None:
            return {}  # at constant speed the motion is not harmonic
        from missions.pattern_search.flight import pattern_frequencies

        x_rad_s, y_rad_s = pattern_frequencies(self.curve(options), options.period_s)
        return {"omega_x_rad_s": x_rad_s, "omega_y_rad_s": y_rad_s}

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        assert isinstance(debriefing.options, FlightOptions)
        return self.estimator_settings(debriefing.options)

    def said(self, summary: Mapping[str, Any]) -> Sequence[str]:
        if "omega_x_rad_s" not in summary:
            return ()
        x, y = summary["omega_x_rad_s"], summary["omega_y_rad_s"]
        return (f"frequencies: omega_x_rad_s={x:.6g} (east), omega_y_rad_s={y:.6g} (north)",)

    def title(self, options: FlightOptions) -> str:
        parts = [self.name]
        if self.name == "lissajous":
            parts.append(options.pattern if options.ratio is None else "{:g}:{:g}".format(*options.ratio))
        parts += [f"{options.width_m:g} m x {options.height_m:g} m", f"via {options.via}"]
        return ", ".join(parts)


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
            "ask for less --periods or --search-time, a smaller --size, a wider --spacing, a simpler --ratio"
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
        raise PlanError(f"--periods {options.periods:g}: this pattern is flown in whole passes")
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


def _sector(options: FlightOptions) -> Curve:
    radius_m = 0.5 * min(options.width_m, options.height_m)
    passes = _passes(options, 9.0 * max(radius_m, 1e-3))
    _check_length(9.0 * radius_m * passes, options)
    heading = options.heading_rad + math.radians(30.0) * options.index / options.vehicles
    return sector(radius_m=radius_m, heading_rad=heading, passes=passes)


def _parallel_sweep(options: FlightOptions) -> Curve:
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


def _expanding_square(options: FlightOptions) -> Curve:
    def make(passes: int) -> Polyline:
        return expanding_square(
            size_m=min(options.width_m, options.height_m),
            spacing_m=options.spacing_m,
            heading_rad=options.heading_rad + math.radians(90.0) * options.index / options.vehicles,
            passes=passes,
        )

    return _in_passes(make, options, min(options.width_m, options.height_m) ** 2 / options.spacing_m)


def _lissajous_size(options: FlightOptions, limits: FixedWingLimits) -> FlightOptions:
    once = lissajous_curve(replace(options, periods=1.0, search_time_s=None))
    side_m = curve_side_m(once, options.width_m, options.speed_m_s, limits)
    return options.unless_chosen(width_m=side_m, height_m=side_m)


def _sector_size(options: FlightOptions, limits: FixedWingLimits) -> FlightOptions:
    side_m = sector_side_m(options.speed_m_s, limits)
    return options.unless_chosen(width_m=side_m, height_m=side_m)


def _sweep_size(options: FlightOptions, limits: FixedWingLimits) -> FlightOptions:
    """A sweep reduces its spacing until it divides the side, so each of the two depends on the other."""
    if options.chosen("width_m") or options.chosen("height_m"):
        short_m = min(options.width_m, options.height_m)
        # tracks as long as their spacing, and half the spacing beyond each end
        _require_room(options, max(options.width_m, options.height_m), 2.0, limits)
        return options.unless_chosen(spacing_m=spacing_within_m(short_m, options.speed_m_s, limits))
    return _square_size(options, limits)


def _require_room(options: FlightOptions, side_m: float, spacings: float, limits: FixedWingLimits) -> None:
    """Refuse a specified side that is too small for the track spacing that the aircraft's turns need."""
    spacing_m = spacing_for_turns_m(options.speed_m_s, limits)
    if not options.chosen("spacing_m") and side_m < spacings * spacing_m:
        raise PlanError(
            f"--size {side_m:g} m has no room for the aircraft's turns: at {options.speed_m_s:g} m/s in "
            f"{limits.wind_m_s:.3g} m/s of wind tracks must be {spacing_m:g} m apart; ask for "
            f"--size {spacings * spacing_m:g} or more, or less --speed"
        )


def _square_size(options: FlightOptions, limits: FixedWingLimits) -> FlightOptions:
    if options.chosen("width_m") or options.chosen("height_m"):
        _require_room(options, min(options.width_m, options.height_m), 1.0, limits)
    side_m = legs_side_m(options.spacing_m)
    return options.unless_chosen(width_m=side_m, height_m=side_m)


MISSIONS: Final[Mapping[str, Mission[Any]]] = MappingProxyType(
    {
        "lissajous": PatternMission("lissajous", lissajous_curve, _lissajous_size),
        "sector": PatternMission("sector", _sector, _sector_size),
        "parallel-sweep": PatternMission("parallel-sweep", _parallel_sweep, _sweep_size),
        "expanding-square": PatternMission("expanding-square", _expanding_square, _square_size),
        "orbit": OrbitMission(),
        "occupancy": OccupancyMission(),
    }
)
"""The missions with a name on the command line."""


class ScriptMission(Mission[FlightOptions]):
    """A user's own mission: a Python file with `async def fly(vehicle, options)`.

    The file may have a class `Mission` instead, made without arguments, with `async def fly(self, vehicle,
    options)` and, optionally, `def check(self, options)`, which raises `PlanError`. Each vehicle of a team
    flies it; `options.index` is the number of the vehicle.

    Raises:
        PlanError: the file can't be read, or has neither.
    """

    def __init__(self, path: Path) -> None:
        self.name = path.stem
        module = _load(path)
        holder: Any = module
        if not hasattr(module, "fly") and inspect.isclass(getattr(module, "Mission", None)):
            holder = module.Mission()
        fly = getattr(holder, "fly", None)
        if not inspect.iscoroutinefunction(fly):
            raise PlanError(
                f"{path} has neither `async def fly(vehicle, options)` nor a class `Mission` with it; add one"
            )
        self._fly = fly
        self._file = str(path)
        self._resolved = path.resolve()
        self._check = getattr(holder, "check", None)

    def check(self, options: FlightOptions, limits: Limits) -> None:
        if self._check is not None:
            self._check(options)

    async def fly(self, vehicle: Vehicle, options: FlightOptions) -> None:
        try:
            await self._fly(vehicle, options)
        except (MissionError, PlanError, BridgeError):
            raise
        except Exception as error:
            frames = traceback.extract_tb(error.__traceback__)
            line = next(
                (f.lineno for f in reversed(frames) if Path(f.filename).resolve() == self._resolved), "?"
            )
            raise MissionError(f"{self._file}, line {line}: {type(error).__name__}: {error}") from error


def _load(path: Path) -> Any:
    if not path.is_file():
        raise PlanError(f"mission file {path} does not exist")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise PlanError(f"mission file {path} is not Python; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise PlanError(f"mission file {path} can't be loaded: {type(error).__name__}: {error}") from error
    return module


def find_mission(name: str) -> Mission[Any]:
    """A mission by name, a user's own by path (anything ending in .py), or a mission file.

    Raises:
        PlanError: the mission does not exist; the message lists the known ones.
    """
    if name.endswith(".py"):
        return ScriptMission(Path(name))
    if Path(name).suffix.lower() in MISSION_FILES:
        return FileMission(Path(name))
    known = MISSIONS.get(name)
    if known is None:
        raise PlanError(
            f"mission {name!r} is not known; there are {', '.join(MISSIONS)}, "
            f"or the path of a file: Python (.py), or a mission file ({', '.join(MISSION_FILES)})"
        )
    return known
