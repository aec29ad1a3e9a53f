"""The mission of one search pattern: its curve, its size for the vehicle, and its flight."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from autopilot_bridge.mission_plan import MissionItem
from missions.base.mission import Debriefing, Mission
from missions.base.options import FlightOptions
from missions.errors import PlanError
from missions.pattern_search.flight import (
    check_pattern,
    fly_pattern,
    pattern_frequencies,
    pattern_items,
    pattern_outline,
)
from missions.pattern_search.for_vehicle import flight_for_vehicle
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
        for name in options.arguments:
            raise PlanError(f"`arguments` {name}: {self.name} takes none; they are for missions of your own")
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

    async def fly(self, vehicle: Vehicle, options: FlightOptions) -> None:
        if not options.search:
            await fly_pattern(vehicle, options, self.curve(options))
            return
        from missions.pattern_search.tag_watch import TagWatch

        search = TagWatch(
            vehicle, tag_id=options.tag_id, altitude_m=options.own_altitude_m, limit_s=options.search_time_s
        )
        search.start()
        try:
            await fly_pattern(vehicle, options, self.curve(options), search)
        finally:
            search.stop()
            search.note()

    def estimator_settings(self, options: FlightOptions) -> Mapping[str, float | str]:
        if options.period_s is None:
            return {}  # at constant speed the motion is not harmonic
        x_rad_s, y_rad_s = pattern_frequencies(self.curve(options), options.period_s)
        return {"omega_x_rad_s": x_rad_s, "omega_y_rad_s": y_rad_s}

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        assert isinstance(debriefing.options, FlightOptions)
        frames = sum(notes.marks.get("search_frames_at_altitude", 0.0) for notes, _ in debriefing.flights)
        if debriefing.options.search and not frames:
            return "the search ended without a picture that was searched: look at the camera"
        return super().verdict(debriefing, max_error_m)

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        assert isinstance(debriefing.options, FlightOptions)
        figures: dict[str, Any] = dict(self.estimator_settings(debriefing.options))
        if debriefing.options.search and debriefing.flights:
            from missions.pattern_search.search_figures import search_figures

            figures["search"] = search_figures(debriefing)
        return figures

    def report_lines(self, summary: Mapping[str, Any]) -> Sequence[str]:
        lines = []
        if "omega_x_rad_s" in summary:
            x, y = summary["omega_x_rad_s"], summary["omega_y_rad_s"]
            lines.append(f"frequencies: omega_x_rad_s={x:.6g} (east), omega_y_rad_s={y:.6g} (north)")
        if "search" in summary:
            lines.append(search_line(summary["search"]))
        return lines

    def title(self, options: FlightOptions) -> str:
        parts = [self.name]
        if self.name == "lissajous":
            parts.append(options.pattern if options.ratio is None else "{:g}:{:g}".format(*options.ratio))
        parts += [f"{options.width_m:g} m x {options.height_m:g} m", f"via {options.via}"]
        return ", ".join(parts)
