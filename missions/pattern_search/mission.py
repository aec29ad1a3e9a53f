"""The mission of one search pattern: its curve, its size for the vehicle, and its flight."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from autopilot_bridge.mission_plan import MissionItem
from missions.base.flight import MissionFlight
from missions.base.mission import Mission
from missions.base.options import FlightOptions
from missions.base.report import Debriefing, Report, path_verdict_of_all
from missions.errors import PlanError
from missions.pattern_search.flight import (
    check_pattern,
    fly_pattern,
    pattern_frequencies,
    pattern_items,
    pattern_outline,
)
from missions.pattern_search.for_vehicle import flight_for_vehicle
from missions.pattern_search.picture import draw_search
from missions.pattern_search.search_figures import search_figures
from missions.pattern_search.tag_watch import TagWatch
from missions.patterns import Curve
from missions.planning.outline import Outline
from missions.vehicle.limits import FixedWingLimits, Limits
from missions.vehicle.sensors import TAG_CAMERA, Sensor
from missions.vehicle.vehicle import Vehicle


def check_search(options: FlightOptions, limits: Limits) -> None:
    """Raise PlanError if these vehicles can't search for a tag."""
    if isinstance(limits, FixedWingLimits):
        raise PlanError("`search` is flown by multicopters; aircraft fly their patterns without it")
    if options.vehicles > 1:
        raise PlanError(f"`search` is flown by one vehicle; `vehicles` is {options.vehicles}")


def search_line(search: Mapping[str, Any]) -> str:
    """The result of a search in one line."""
    if not search["found"]:
        return f"tag {search['tag_id']} was not found in {search['search_s']:.0f} s"
    line = f"tag {search['tag_id']} found after {search['search_s']:.1f} s"
    if search["north_m"] is not None:
        line += f" at {search['north_m']:.1f} m north, {search['east_m']:.1f} m east"
    if search["error_m"] is not None:
        line += f", {search['error_m']:.2f} m from its true place"
    return line


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
        options = flight_for_vehicle(options, limits)
        return self._size(options, limits) if isinstance(limits, FixedWingLimits) else options

    def check(self, options: FlightOptions, limits: Limits) -> None:
        self.refuse_arguments(options)
        if options.search:
            check_search(options, limits)
        check_pattern(self.curve(options), options, limits)

    def curve(self, options: FlightOptions) -> Curve:
        """The pattern around its centre, with the requested number of passes."""
        return self._make_curve(options)

    async def plan_items(self, vehicle: Vehicle, options: FlightOptions) -> Sequence[MissionItem]:
        return await pattern_items(vehicle, options, self.curve(options))

    def sensors(self, options: FlightOptions) -> Sequence[Sensor]:
        return (TAG_CAMERA,) if options.search else ()

    async def outline(self, vehicle: Vehicle, options: FlightOptions) -> Outline:
        return pattern_outline(vehicle, options, self.curve(options))

    def flight(self, vehicles: Sequence[Vehicle], options: Sequence[FlightOptions]) -> "PatternSearchFlight":
        return PatternSearchFlight(self, vehicles, options)

    def estimator_settings(self, options: FlightOptions) -> Mapping[str, float | str]:
        if options.period_s is None:
            return {}  # at constant speed the motion is not harmonic
        x_rad_s, y_rad_s = pattern_frequencies(self.curve(options), options.period_s)
        return {"omega_x_rad_s": x_rad_s, "omega_y_rad_s": y_rad_s}


class PatternSearchFlight(MissionFlight[FlightOptions]):
    """A pattern, flown by each vehicle in its layer.

    Args:
        mission: the pattern.
        vehicles: the vehicles, each ready to arm.
        options: of each, adapted to it.
    """

    def __init__(
        self, mission: PatternMission, vehicles: Sequence[Vehicle], options: Sequence[FlightOptions]
    ) -> None:
        super().__init__(vehicles, options)
        self._mission = mission

    async def fly_one(self, index: int) -> None:
        vehicle, options = self.vehicles[index], self.options[index]
        curve = self._mission.curve(options)
        if not options.search:
            await fly_pattern(vehicle, options, curve)
            return
        search = TagWatch(
            vehicle, tag_id=options.tag_id, altitude_m=options.own_altitude_m, limit_s=options.search_time_s
        )
        search.start()
        try:
            await fly_pattern(vehicle, options, curve, search)
        finally:
            search.stop()
            search.note()

    def report(self, debriefing: Debriefing) -> Report:
        options = self.options[0]
        figures: dict[str, Any] = dict(self._mission.estimator_settings(options))
        if options.search:
            figures["search"] = search_figures(debriefing, options)
        return Report.of(
            debriefing,
            verdict=lambda: self._unsearched(debriefing) or path_verdict_of_all(debriefing),
            figures=figures,
            lines=lambda: _lines(figures),
            title=self._title(options),
            overlay=partial(draw_search, debriefing, search_line(figures["search"]))
            if options.search
            else None,
        )

    def _unsearched(self, debriefing: Debriefing) -> str:
        frames = sum(notes.marks.get("search_frames_at_altitude", 0.0) for notes, _ in debriefing.flights)
        if self.options[0].search and not frames:
            return "the search ended without a picture that was searched: look at the camera"
        return ""

    def _title(self, options: FlightOptions) -> str:
        parts = [self._mission.name]
        if self._mission.name == "lissajous":
            parts.append(options.pattern if options.ratio is None else "{:g}:{:g}".format(*options.ratio))
        parts += [f"{options.width_m:g} m x {options.height_m:g} m", f"via {options.via}"]
        return ", ".join(parts)


def _lines(figures: Mapping[str, Any]) -> Sequence[str]:
    """Lines for the terminal."""
    lines = []
    if "omega_x_rad_s" in figures:
        x, y = figures["omega_x_rad_s"], figures["omega_y_rad_s"]
        lines.append(f"frequencies: omega_x_rad_s={x:.6g} (east), omega_y_rad_s={y:.6g} (north)")
    if "search" in figures:
        lines.append(search_line(figures["search"]))
    return lines
