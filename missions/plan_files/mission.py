"""The mission from a mission file."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from autopilot_bridge.mission_plan import MissionItem
from estimators.tracking.metrics import rms
from flightsim.foundation.geodesy import GeodeticPosition
from missions.base.mission import Debriefing, Mission, WorldDefaults, verdict_of_all
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.plan_files.document import NAV_LAND, MissionDocument, PlannedHome
from missions.plan_files.files import read_mission_file
from missions.plan_files.flight import check_distance, fly_document, own_speed_m_s
from missions.plan_files.options import FileOptions, Then
from missions.plan_files.progress import CURVED
from missions.plan_files.route import Stop, placed, route_of, scored_stops, straight
from missions.vehicle.item_tracker import THROUGH
from missions.vehicle.items import FLOWN_TO
from missions.vehicle.limits import FixedWingLimits, Limits
from missions.vehicle.notes import PATTERN, Phase

if TYPE_CHECKING:
    from missions.flown.score import FlightScore
    from missions.planning.outline import Outline
    from missions.vehicle.notes import FlightNotes
    from missions.vehicle.vehicle import Vehicle

_MODELS: Final = {VehicleKind.MULTICOPTER: "iris", VehicleKind.FIXED_WING: "aerosonde"}


class FileMission(Mission[FileOptions]):
    """A mission file, flown unchanged.

    Attributes:
        document: contents of the file.

    Raises:
        PlanError: the file can't be read, or its contents can't be flown.
    """

    def __init__(self, path: Path) -> None:
        self.document = document = read_mission_file(path)
        self.name = path.stem
        kind = document.kind or VehicleKind.MULTICOPTER
        self.kinds = (kind,) if document.kind else (VehicleKind.MULTICOPTER, VehicleKind.FIXED_WING)
        self.world_defaults = WorldDefaults(
            model=_MODELS[kind], autopilot=document.firmware, home=_home_text(document)
        )

    def adapted(self, options: FileOptions, limits: Limits) -> FileOptions:
        heights = [-stop.position_ned_m[2] for stop in route_of(self.document, self._plan_home).stops]
        return options.unless_chosen(altitude_m=max(heights, default=options.altitude_m))

    def check(self, options: FileOptions, limits: Limits) -> None:
        for name in options.arguments:
            raise PlanError(
                f"`arguments` {name}: {self.document.path} takes none; they are for missions of your own"
            )
        home = self.document.home
        self.document.check_heights(
            None if home is None else home.alt_m, below_home_allowed=options.allow_below_home
        )
        wings = isinstance(limits, FixedWingLimits)
        kind = VehicleKind.FIXED_WING if wings else VehicleKind.MULTICOPTER
        if self.document.kind not in (None, kind):
            raise PlanError(
                f"{self.document.path} is for a {self.document.kind}, and the vehicle is a {kind}; choose "
                "another vehicle (`model`, `connect`), or plan it for this one"
            )
        if wings and not self.document.lands and options.then is None:
            raise PlanError(
                f"{self.document.path} does not land; add a landing, or say what comes after it: `then=land` "
                "(along the runway, at home) or `then=return` (by its parameters an aircraft may circle over "
                "home then; PX4 asks for a landing in the plan, unless MIS_TKO_LAND_REQ is 0 or 1)"
            )
        if options.time_limit_s is None and route_of(self.document, self._plan_home).endless:
            raise PlanError(
                f"{self.document.path} jumps back for ever; say when it ends with `time_limit_s` SECONDS"
            )

    def check_place(self, options: FileOptions, limits: Limits, home: GeodeticPosition) -> None:
        check_distance(route_of(self.document, home), self.document.path, home)
        self.document.check_heights(home.alt_m, below_home_allowed=options.allow_below_home)

    async def fly(self, vehicle: "Vehicle", options: FileOptions) -> None:
        await fly_document(vehicle, options, self.document)

    async def remarks(self, vehicle: "Vehicle", options: FileOptions) -> Sequence[str]:
        if options.then is Then.LAND or (self.document.lands and not self.document.returns):
            return ()
        reason = await vehicle.return_end.stays_because()
        if not reason:
            return ()
        # its advice is of no use for a plan that the vehicle would not fly
        items = placed(self.document.items, vehicle.home, vehicle.firmware.unset)
        await vehicle.plans.refuse_infeasible(items, self.document.fence)
        return (
            f"the flight ends in the air: after its return it {vehicle.return_end.stay} over home "
            f"({reason}); `then=land` lands it",
        )

    async def plan_items(self, vehicle: "Vehicle", options: FileOptions) -> Sequence[MissionItem]:
        return self.document.items

    async def outline(self, vehicle: "Vehicle", options: FileOptions) -> "Outline":
        from missions.planning.outline import Outline

        route = route_of(self.document, vehicle.home)
        return Outline(
            points_ned_m=tuple(stop.position_ned_m for stop in route.stops),
            duration_s=options.time_limit_s
            if route.endless
            else route.duration_s(own_speed_m_s(self.document, vehicle.kind)),
            plan_home=None if self.document.home is None else self.document.home.place,
            fence=self.document.fence,
        )

    @property
    def _places(self) -> set[int]:
        """Indices of the items with a place to fly to, without landings."""
        items = enumerate(self.document.items)
        return {k for k, item in items if item.command in FLOWN_TO and item.command != NAV_LAND}

    @property
    def _plan_home(self) -> GeodeticPosition:
        home = self.document.home or PlannedHome(lat_deg=0.0, lon_deg=0.0, alt_m=None)
        return home.place

    def title(self, options: FileOptions) -> str:
        return self.document.path.name

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        return verdict_of_all(debriefing, lambda notes, score: self._verdict(notes, score, max_error_m))

    def _verdict(self, notes: "FlightNotes", score: "FlightScore", max_error_m: float | None) -> str:
        """Check that every waypoint was passed in order; the path between them is chosen by the autopilot."""
        from missions.flown.verdict import NO_TRACK, WAYPOINT_SLACK_M, flown_track, waypoint_verdict

        commanded = notes.commanded
        if commanded is None:
            return ""
        kind = VehicleKind(notes.kind)
        stops = scored_stops(
            route_of(self.document, commanded.origin), with_takeoff=kind is VehicleKind.MULTICOPTER
        )
        waypoints = [stop for stop in stops if stop.command in THROUGH]
        reached_us = [time_us for index, time_us in notes.reached if index in self._places]
        if self._places and not reached_us:
            return "no place of the mission was reached"
        if not waypoints:
            return ""
        scored = next((p for p in notes.phases if p.name in (PATTERN, CURVED)), None)
        end_us = reached_us[-1] if scored is None else scored.end_us  # one place makes no phase
        track = flown_track(score, Phase(name="", start_us=notes.phases[0].start_us, end_us=end_us))
        if track is None:
            return NO_TRACK
        return waypoint_verdict(
            track,
            np.array([stop.position_ned_m for stop in waypoints]),
            max(commanded.acceptance_m + WAYPOINT_SLACK_M[kind], max_error_m or 0.0),
            notes.cut_short,
        )

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        notes, score = debriefing.flights[0] if debriefing.flights else (None, None)
        document = self.document
        block: dict[str, Any] = {
            "file": str(document.path),
            "items": len(document.items),
            "fence_items": len(document.fence),
            "rally_points": len(document.rally),
            "reached": [],
            "legs": [],
        }
        if notes is None or score is None:
            return {"mission_file": block}
        block["reached"] = [
            {"item": index + 1, "command": document.items[index].command, "time_s": time_us / 1e6}
            for index, time_us in notes.reached
        ]
        block["legs"] = legs = list(self._legs(notes, score))
        worst = [leg["cross_track_max_m"] for leg in legs]
        squares = [leg["cross_track_rms_m"] ** 2 for leg in legs]
        block["cross_track_max_m"] = max(worst) if worst else None
        block["cross_track_rms_m"] = round(math.sqrt(sum(squares) / len(squares)), 3) if squares else None
        return {"mission_file": block}

    def _legs(self, notes: "FlightNotes", score: "FlightScore") -> Sequence[Mapping[str, Any]]:
        """Distance of the track from each straight leg, between the times of the leg's ends."""
        track = score.truth if score.truth is not None else score.estimate
        if track is None or notes.commanded is None:
            return ()
        route = route_of(self.document, notes.commanded.origin)
        stops = scored_stops(route, with_takeoff=notes.kind == VehicleKind.MULTICOPTER)
        legs: list[Mapping[str, Any]] = []
        times = notes.reached
        place = 0
        for a, b in pairwise(stops):
            start = next((k for k in range(place, len(times)) if times[k][0] == a.index), None)
            if start is None:
                continue
            place = start  # items without a place (speed, camera) may be between the two places
            stop = next((k for k in range(start + 1, len(times)) if times[k][0] == b.index), None)
            if stop is None or not straight(a, b):
                continue
            flown = track.between(times[start][1], times[stop][1]).pos_ned_m
            if len(flown) > 1:
                legs.append({"from": a.index + 1, "to": b.index + 1, **_cross_track(a, b, flown)})
        return legs

    def report_lines(self, summary: Mapping[str, Any]) -> Sequence[str]:
        block = summary["mission_file"]
        reached = {entry["item"] - 1 for entry in block["reached"]}
        lines = [f"places reached: {len(reached & self._places)} of {len(self._places)}"]
        if block["cross_track_rms_m"] is not None:
            lines.append(
                f"cross-track {block['cross_track_rms_m']:.2f} m RMS, {block['cross_track_max_m']:.2f} m at "
                f"most, over {len(block['legs'])} legs"
            )
        return lines


def _cross_track(a: Stop, b: Stop, flown: np.ndarray[Any, Any]) -> dict[str, float]:
    """Horizontal distance from the line of the leg."""
    start, stop = np.array(a.position_ned_m[:2]), np.array(b.position_ned_m[:2])
    along = stop - start
    length = float(np.linalg.norm(along))
    offset = flown[:, :2] - start
    if length < 1.0:
        across = np.linalg.norm(offset, axis=1)
    else:
        across = np.abs(offset[:, 0] * along[1] - offset[:, 1] * along[0]) / length
    return {"cross_track_rms_m": round(rms(across), 3), "cross_track_max_m": round(float(across.max()), 3)}


def _home_text(document: MissionDocument) -> str | None:
    """The file's home for an embedded world, with the heading to the mission's first place. An altitude that
    the file does not know is empty.
    """
    home = document.home
    if home is None:
        return None
    altitude = "" if home.alt_m is None else f"{home.alt_m:.3f}"
    place = f"{home.lat_deg:.9f},{home.lon_deg:.9f},{altitude}"
    for stop in route_of(document, home.place).stops:
        north, east, _ = stop.position_ned_m
        if math.hypot(north, east) > 5.0:
            heading_deg = math.degrees(math.atan2(east, north)) % 360.0
            return f"{place},{heading_deg:.3f}"
    return place
