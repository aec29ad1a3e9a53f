"""The mission `occupancy`: a team searches a magnetic map for a target (Lum et al. 2005, section IV)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.mission import Debriefing, Mission, WorldDefaults
from missions.occupancy.options import OccupancyOptions, check_reach, check_vehicle
from missions.occupancy.survey_map import load_survey_map
from missions.occupancy.team import SearchTeam
from missions.planning.limits import Limits
from missions.scenario import Scenario, Setting, SurveyScenario

if TYPE_CHECKING:
    from missions.notes import FlightNotes
    from missions.vehicle.vehicle import Vehicle

MAP_NAME: Final = "magnetic_map.npz"

_MARGIN_CELLS: Final = 2.0  # cells around the area in a generated map
_INSIDE: Final = 0.9  # share of the area in which a target is drawn
_TARGET_STREAM: Final = 0x7A67


@dataclass(frozen=True, slots=True, kw_only=True)
class _World:
    """The requested embedded world of the next flight.

    Attributes:
        map_path: path of its published map.
        target_ne_m: true place of its target; for the score, never for the vehicles.
    """

    map_path: Path
    target_ne_m: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Flown:
    """The newest flight, for its debriefing.

    Attributes:
        first_notes: notes of the first vehicle; they identify the flight.
        team: the team at the end of the flight.
        target_ne_m: where the target is; None: not known.
    """

    first_notes: "FlightNotes"
    team: SearchTeam
    target_ne_m: tuple[float, float] | None


class OccupancyMission(Mission[OccupancyOptions]):
    """A team shares an occupancy map and flies headings from cell to cell until the target is found."""

    name = "occupancy"
    world_defaults = WorldDefaults(model="aerosonde", wind="5@270", turbulence="light")
    together = True

    def __init__(self) -> None:
        self._world: _World | None = None
        self._flown: _Flown | None = None

    def check(self, options: OccupancyOptions, limits: Limits) -> None:
        for name in options.arguments:
            raise PlanError(f"`arguments` {name}: {self.name} takes none; they are for missions of your own")
        check_vehicle(options, limits)
        if options.map_file is not None:
            layout = options.layout
            load_survey_map(Path(options.map_file)).require_data(
                south_m=layout.south_m,
                north_m=layout.north_m,
                west_m=layout.west_m,
                east_m=layout.east_m,
                what=f"the searched area (`width_m, height_m` {options.width_m:g}x{options.height_m:g})",
            )

    def check_place(self, options: OccupancyOptions, limits: Limits, home: GeodeticPosition) -> None:
        if options.map_file is not None:  # a generated map is centred on home
            check_reach(options, limits, load_survey_map(Path(options.map_file)).frame(), home)

    def scenario(self, options: OccupancyOptions, setting: Setting) -> Scenario:
        """A magnetic map with a target in it. Both are drawn from the seed unless the user specified them."""
        target_ne_m, orientation_rad = drawn_target(options, setting.seed)
        given = None if options.map_file is None else Path(options.map_file)
        made = setting.folder / MAP_NAME
        self._world = _World(map_path=made if given is None else given, target_ne_m=target_ne_m)
        north_m, east_m = options.area_ne_m
        margin_m = _MARGIN_CELLS * options.cell_m
        return Scenario(
            survey=SurveyScenario(
                map_path=given,
                publish_to=made if given is None else None,
                width_m=options.width_m + 2.0 * (abs(east_m) + margin_m),
                height_m=options.height_m + 2.0 * (abs(north_m) + margin_m),
                survey_height_m=options.altitude_m,
                target_ne_m=target_ne_m,
                amplitude_nt=options.amplitude_nt,
                sigma_along_m=options.sigma_along_m,
                sigma_across_m=options.sigma_across_m,
                orientation_rad=orientation_rad,
                moment_a_m2=options.moment_a_m2,
                depth_m=options.depth_m,
            )
        )

    async def fly_team(self, vehicles: "Sequence[Vehicle]", options: Sequence[OccupancyOptions]) -> None:
        world, self._world = self._world, None
        given = options[0].map_file
        if given is not None:
            map_path = Path(given)
        elif world is not None:
            map_path = world.map_path
        else:
            raise PlanError(
                "a search needs the published magnetic map of its place: give it with `map_file` FILE"
            )
        team = SearchTeam(vehicles, options, load_survey_map(map_path))
        self._flown = _Flown(
            first_notes=vehicles[0].notes,
            team=team,
            target_ne_m=options[0].target_ne_m if world is None else world.target_ne_m,
        )
        await team.fly()

    def _flight_of(self, debriefing: Debriefing) -> _Flown | None:
        flown = self._flown
        if flown is None or not debriefing.flights or debriefing.flights[0][0] is not flown.first_notes:
            return None
        return flown

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        from missions.occupancy.figures import search_verdict

        flown = self._flight_of(debriefing)
        return "" if flown is None else search_verdict(flown.team, debriefing)

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        from missions.occupancy.figures import search_figures

        flown = self._flight_of(debriefing)
        if flown is None:
            return {"target_found": False, "time_to_find_s": None}
        return search_figures(flown.team, debriefing, flown.target_ne_m)

    def said(self, summary: Mapping[str, Any]) -> Sequence[str]:
        detected = f"probability of detection {summary.get('probability_of_detection', 0.0):.2f}"
        if not summary["target_found"]:
            return (f"target not found, {detected}",)
        error_m = summary["target_error_m"]
        off = "" if error_m is None else f", {error_m:.0f} m off"
        return (f"target found after {summary['time_to_find_s']:.0f} s{off}, {detected}",)

    def title(self, options: OccupancyOptions) -> str:
        return f"{self.name}, {options.vehicles} vehicles over {options.width_m:g} m x {options.height_m:g} m"

    def draw(self, path: Path, title: str, debriefing: Debriefing) -> None:
        flown = self._flight_of(debriefing)
        if flown is None or flown.team.began_us < 0:
            super().draw(path, title, debriefing)
            return
        from missions.occupancy.picture import draw_search

        draw_search(path, title, flown.team, debriefing, flown.target_ne_m)


def drawn_target(options: OccupancyOptions, seed: int) -> tuple[tuple[float, float], float]:
    """Place of the target of an embedded world and orientation of its signature: specified, or drawn from the
    seed.

    Returns:
        ((north m, east m) of the map's home, orientation in rad).
    """
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_TARGET_STREAM,)))
    north, east, turn = (float(value) for value in rng.uniform(-0.5, 0.5, 3))
    layout = options.layout
    height_m, width_m = layout.north_m - layout.south_m, layout.east_m - layout.west_m
    if options.target_ne_m is not None:
        return options.target_ne_m, turn * math.pi
    return (
        (
            0.5 * (layout.south_m + layout.north_m) + _INSIDE * north * height_m,
            0.5 * (layout.west_m + layout.east_m) + _INSIDE * east * width_m,
        ),
        turn * math.pi,
    )
