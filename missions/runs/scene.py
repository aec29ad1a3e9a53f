"""The scene of a flight: what its mission and estimators show, for the run folder and a live viewer."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from autopilot_bridge.mavlink import Packet
from estimators.fleet import Fleet
from estimators.scene.of_estimators import EstimatorShows
from estimators.scene.recording import SUFFIX, SceneWriter
from estimators.scene.shown import Showing, Shown, Subject
from estimators.scene_items import Item, Line, Role, Text
from flightsim.foundation.geodesy import GeodeticPosition
from missions.runs.flight import Flight
from missions.vehicle.connection import Recorder
from missions.vehicle.notes import FlightNotes
from missions.vehicle.vehicle import Vehicle
from missions.view.feed import SceneFeed

__all__ = ["FlightScene"]

_MISSION_US: Final = 1_000_000
_ESTIMATES_US: Final = 100_000
_OF_USERS: Final = (
    *(
        ArithmeticError,
        AssertionError,
        AttributeError,
        LookupError,
        OSError,
        RuntimeError,
        TypeError,
        ValueError,
    ),
)
"""What a user's code may raise."""
_MOST_POINTS: Final = 2000  # of a commanded path


class FlightScene:
    """A recorder that also looks at what mission and estimators show, and feeds a viewer.

    It only reads, on the vehicle time of what is recorded: a flight has the same bytes with and without it.

    Args:
        recorder: the recorder that stores the frames.
        flight: the state of the run.
        fleet: the estimators of the flight; None: there are none.
        log: the log that the recorder writes; the scene is stored beside it.
        feed: of a live viewer; None: there is none.
    """

    def __init__(
        self, recorder: Recorder, flight: Flight, fleet: Fleet | None, log: Path, feed: SceneFeed | None
    ) -> None:
        self._record = recorder.record
        self._acts = recorder.acts
        self._flight = flight
        self._fleet = fleet
        self._feed = feed
        self._writer = SceneWriter(log.with_suffix(SUFFIX))
        self._showing: dict[str, Showing] = {}
        self._estimators = None if fleet is None else EstimatorShows(fleet.name)
        self._look_us = self._estimates_us = 0
        self._failed = False

    @property
    def acts(self) -> bool:
        """As of the recorder inside."""
        return self._acts

    def record(self, packet: Packet, time_us: int) -> None:
        """Record frames, and look at what is shown."""
        self._record(packet, time_us)
        if self._feed is not None:
            self._feed.packet(packet, time_us)
        if time_us >= self._estimates_us and not self._failed:
            self._look(time_us)

    def record_truth(self, time_us: int, frame: bytes) -> None:
        """Record a frame of truth."""
        self.record(Packet.of_one(frame), time_us)

    def close(self) -> None:
        """The flight is over: look once more, and close the file and the feed."""
        if not self._failed:
            self._look_us = 0
            self._look(self._estimates_us)
        self._writer.close()
        if self._feed is None:
            return
        self._feed.close()
        if self._feed.failure:
            self._warn(f"the viewer shows nothing from some time on: {self._feed.failure}")
        elif self._feed.dropped:
            self._warn(f"the viewer was slower than the flight: {self._feed.dropped} items were left out")

    def _look(self, time_us: int) -> None:
        """Whatever a user's `shown` raises ends this, never the flight."""
        try:
            self._estimates_us = time_us + _ESTIMATES_US
            shown = self._of_estimators()
            if time_us >= self._look_us:
                self._look_us = time_us + _MISSION_US
                shown += self._of_mission()
            for one in shown:
                self._writer.write(one)
                if self._feed is not None:
                    self._feed.show(one)
        except _OF_USERS as error:
            self._failed = True
            reason = error.strerror if isinstance(error, OSError) else f"{type(error).__name__}: {error}"
            self._warn(f"what the mission and its estimators show is not recorded further: {reason}")

    def _warn(self, text: str) -> None:
        for vehicle in self._flight.vehicles[:1]:
            vehicle.notes.warn(text)

    def _of_estimators(self) -> list[Shown]:
        if self._fleet is None or self._estimators is None:
            return []
        return [
            shown
            for runner in self._fleet.runners.values()
            if runner.tables
            for shown in self._estimators.look_at(runner)
        ]

    def _of_mission(self) -> list[Shown]:
        vehicles = [vehicle for vehicle in self._flight.vehicles if vehicle.notes.system_id]
        if not vehicles:
            return []
        found = []
        for vehicle in vehicles:
            base = f"vehicles/{vehicle.notes.system_id}"
            found += self._changes(base, vehicle, _of_notes(vehicle), _origin_of(vehicle.notes))
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


def _of_notes(vehicle: Vehicle) -> dict[str, Item]:
    """The present phase, and the path that the vehicle was commanded to fly."""
    notes = vehicle.notes
    found: dict[str, Item] = {}
    if notes.current:
        found["phase"] = Text(text=f"phase {notes.current}", state=notes.current, role=Role.COMMANDED)
    if notes.commanded is not None:
        points = notes.commanded.points_ned_m
        thinned = points[:: max(1, len(points) // _MOST_POINTS)]
        found["commanded"] = Line(points_ned_m=thinned)
    return found
