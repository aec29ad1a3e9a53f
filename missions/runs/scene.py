"""The scene of a flight: what its mission and estimators show, for the run folder and a live viewer."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from estimators.fleet import Fleet
from estimators.scene.shown import Showing, Shown, Subject
from estimators.scene_items import Item, Line, Role, Text
from flightsim.foundation.geodesy import GeodeticPosition
from missions.estimation.scene import SceneRecorder
from missions.runs.flight import Flight
from missions.vehicle.connection import Recorder
from missions.vehicle.notes import FlightNotes
from missions.vehicle.vehicle import Vehicle
from missions.view.viewer import Viewer

__all__ = ["FlightScene"]

_MISSION_US: Final = 1_000_000
_MOST_POINTS: Final = 2000  # of a commanded path


class FlightScene(SceneRecorder):
    """The scene with what the mission shows, once a second, and the notes of the flight.

    Args:
        recorder: the recorder that stores the frames.
        flight: the state of the run.
        fleet: the estimators of the flight; None: there are none.
        log: the log that the recorder writes; the scene is stored beside it.
        view: an open viewer; None: there is none.
    """

    def __init__(
        self, recorder: Recorder, flight: Flight, fleet: Fleet | None, log: Path, view: Viewer | None
    ) -> None:
        super().__init__(recorder, fleet, log, view, self._note)
        self._flight = flight
        self._showing: dict[str, Showing] = {}
        self._due_us = 0

    def _note(self, text: str) -> None:
        for vehicle in self._flight.vehicles[:1]:
            vehicle.notes.warn(text)

    def shown(self, time_us: int, *, last: bool) -> list[Shown]:
        """Phases, commanded paths, and what the mission shows."""
        vehicles = [vehicle for vehicle in self._flight.vehicles if vehicle.notes.system_id]
        if not vehicles or (time_us < self._due_us and not last):
            return []
        self._due_us = time_us + _MISSION_US
        found = []
        for vehicle in vehicles:
            base = f"vehicles/{vehicle.notes.system_id}"
            found += self._changes(base, vehicle, _of_notes(vehicle.notes), _origin_of(vehicle.notes))
        if self._flight.mission is not None:
            found += self._changes("mission", vehicles[0], self._flight.mission.shown(), None)
        return found

    def _changes(
        self, base: str, vehicle: Vehicle, items: Mapping[str, Item], origin: GeodeticPosition | None
    ) -> list[Shown]:
        subject = Subject(base=base, system_id=vehicle.notes.system_id)
        showing = self._showing.setdefault(base, Showing(subject))
        return showing.changes(vehicle.clock.stamp_us, items, origin)


def _origin_of(notes: FlightNotes) -> GeodeticPosition | None:
    return None if notes.commanded is None else notes.commanded.origin


def _of_notes(notes: FlightNotes) -> dict[str, Item]:
    """The present phase, and the path that the vehicle was commanded to fly."""
    found: dict[str, Item] = {}
    if notes.current:
        found["phase"] = Text(text=f"phase {notes.current}", state=notes.current, role=Role.COMMANDED)
    if notes.commanded is not None:
        points = notes.commanded.points_ned_m
        found["commanded"] = Line(points_ned_m=points[:: max(1, len(points) // _MOST_POINTS)])
    return found
