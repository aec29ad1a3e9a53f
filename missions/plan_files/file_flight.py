"""The flight of a mission file, and its report: the places that were reached, and the legs between them."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from estimators.tracking.metrics import rms
from missions.base.flight import MissionFlight
from missions.base.report import Debriefing, Report, verdict_of_all
from missions.flown.score import FlightScore
from missions.flown.verdict import NO_TRACK, WAYPOINT_SLACK_M, flown_track, waypoint_verdict
from missions.kind import VehicleKind
from missions.plan_files.document import NAV_LAND, MissionDocument
from missions.plan_files.flight import fly_document
from missions.plan_files.options import FileOptions
from missions.plan_files.progress import CURVED
from missions.plan_files.route import Stop, route_of, scored_stops, straight
from missions.vehicle.item_tracker import THROUGH
from missions.vehicle.items import FLOWN_TO
from missions.vehicle.notes import PATTERN, FlightNotes, Phase
from missions.vehicle.vehicle import Vehicle

__all__ = ["FileFlight"]


class FileFlight(MissionFlight[FileOptions]):
    """A mission file, flown unchanged by each vehicle.

    Args:
        document: contents of the file.
        vehicles: the vehicles, each ready to arm.
        options: of each, adapted to it.
    """

    def __init__(
        self, document: MissionDocument, vehicles: Sequence[Vehicle], options: Sequence[FileOptions]
    ) -> None:
        super().__init__(vehicles, options)
        self.document = document

    async def fly_one(self, index: int) -> None:
        await fly_document(self.vehicles[index], self.options[index], self.document)

    def report(self, debriefing: Debriefing) -> Report:
        block = self._figures(*debriefing.flights[0])
        return Report.of(
            debriefing,
            verdict=lambda: verdict_of_all(
                debriefing, lambda notes, score: self._verdict(notes, score, debriefing.max_error_m)
            ),
            figures={"mission_file": block},
            lines=lambda: self._lines(block),
            title=self.document.path.name,
        )

    @property
    def _places(self) -> set[int]:
        """Indices of the items with a place to fly to, without landings."""
        items = enumerate(self.document.items)
        return {k for k, item in items if item.command in FLOWN_TO and item.command != NAV_LAND}

    def _verdict(self, notes: FlightNotes, score: FlightScore, max_error_m: float | None) -> str:
        """Check that every waypoint was passed in order; the path between them is chosen by the autopilot."""
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

    def _figures(self, notes: FlightNotes, score: FlightScore) -> Mapping[str, Any]:
        document = self.document
        block: dict[str, Any] = {
            "file": str(document.path),
            "items": len(document.items),
            "fence_items": len(document.fence),
            "rally_points": len(document.rally),
        }
        block["reached"] = [
            {"item": index + 1, "command": document.items[index].command, "time_s": time_us / 1e6}
            for index, time_us in notes.reached
        ]
        block["legs"] = legs = list(self._legs(notes, score))
        worst = [leg["cross_track_max_m"] for leg in legs]
        squares = [leg["cross_track_rms_m"] ** 2 for leg in legs]
        block["cross_track_max_m"] = max(worst) if worst else None
        block["cross_track_rms_m"] = round(math.sqrt(sum(squares) / len(squares)), 3) if squares else None
        return block

    def _legs(self, notes: FlightNotes, score: FlightScore) -> Sequence[Mapping[str, Any]]:
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

    def _lines(self, block: Mapping[str, Any]) -> Sequence[str]:
        """Lines for the terminal."""
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
