"""The base class of all missions."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from missions.base.options import MissionOptions
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.vehicle.limits import Limits

if TYPE_CHECKING:
    from pathlib import Path

    from autopilot_bridge.mission_plan import MissionItem
    from flightsim.foundation.geodesy import GeodeticPosition
    from missions.flown.camera_picture import PicturesOf
    from missions.flown.records import FlightRecords
    from missions.flown.score import FlightScore
    from missions.planning.outline import Outline
    from missions.vehicle.notes import FlightNotes
    from missions.vehicle.sensors import Sensor
    from missions.vehicle.vehicle import Vehicle

AnyOptions = TypeVar("AnyOptions", bound=MissionOptions)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldDefaults:
    """The embedded world that a mission is flown in, unless the user selects another.

    Attributes:
        model: vehicle model.
        wind: "SPEED[@FROM]", m/s and degrees.
        turbulence: "none", "light", "moderate" or "severe".
        autopilot: flavour; None: any.
        home: "lat,lon,alt[,heading]"; None: the flavour's default.
    """

    model: str = "iris"
    wind: str = "0"
    turbulence: str = "none"
    autopilot: str | None = None
    home: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Debriefing:
    """What is known about a flight when it is over.

    Attributes:
        records: recorded messages of all vehicles and, embedded, of the truth.
        flights: notes and scores, one per vehicle.
        options: options of the first vehicle.
        target_ne_m: true place of the first magnetic target of an embedded world, north and east of the map's
            home; None: not known.
        targets_ne_m: the same of all magnetic targets; None: not known, () if the world has none.
    """

    records: "FlightRecords"
    flights: "Sequence[tuple[FlightNotes, FlightScore]]"
    options: MissionOptions
    target_ne_m: tuple[float, float] | None = None
    targets_ne_m: tuple[tuple[float, float], ...] | None = None


def verdict_of_all(debriefing: Debriefing, verdict: Callable[["FlightNotes", "FlightScore"], str]) -> str:
    """The verdicts on all vehicles of a flight in one sentence; "" if all have flown the commanded paths."""
    verdicts = {notes.system_id: verdict(notes, score) for notes, score in debriefing.flights}
    if len(verdicts) == 1:
        return next(iter(verdicts.values()))
    return "; ".join(f"vehicle {system_id}: {text}" for system_id, text in verdicts.items() if text)


class Mission(Generic[AnyOptions]):
    """A mission that can be flown. Subclasses override what differs.

    Attributes:
        name: name for users and for file names.
        world_defaults: the world it is flown in by default.
        kinds: kinds of vehicles that can fly it, the default one first.
        flies_as_team: one call of `fly_team` flies all vehicles of a team; else `fly` is called for each.
        commands: the mission commands its vehicle. A mission that only observes leaves the vehicle in its
            current state, even in flight.
        lands_without_sensors: the mission itself ends when one of its sensors stops
            (`vehicle.sensors.stopped`), so that a team lands in its layers; otherwise the run ends it, and
            the vehicle returns.
    """

    name: str = "mission"
    world_defaults = WorldDefaults()
    kinds: tuple[VehicleKind, ...] = (VehicleKind.MULTICOPTER, VehicleKind.FIXED_WING)
    flies_as_team = False
    commands = True
    lands_without_sensors = False

    def adapted(self, options: AnyOptions, limits: Limits) -> AnyOptions:
        """The options as one vehicle flies them: options that were not specified get values that suit the
        vehicle.
        """
        return options

    def check(self, options: AnyOptions, limits: Limits) -> None:
        """Raise PlanError if one vehicle can't fly the mission.

        Called before anything is started, and again when the vehicle's own limits are known.
        """

    def check_place(self, options: AnyOptions, limits: Limits, home: "GeodeticPosition") -> None:
        """Raise PlanError, before takeoff, if one vehicle can't fly the mission from its home.

        Called for embedded vehicles before anything is started, for other vehicles as soon as their home is
        known.
        """

    def with_map(self, options: AnyOptions, published: "Path") -> AnyOptions:
        """The options, after a magnetic map of the embedded world was published to a file.

        Called for embedded vehicles only.
        """
        return options

    def sensors(self, options: AnyOptions) -> "Sequence[Sensor]":
        """The sensors that each vehicle must carry.

        The run proves them before the takeoff and watches them, until the mission calls
        `vehicle.sensors.release` or has ended.
        """
        return ()

    async def outline(self, vehicle: "Vehicle", options: AnyOptions) -> "Outline | None":
        """The path that one vehicle, which is ready to arm, would fly; None: it is not known in advance."""
        return None

    async def remarks(self, vehicle: "Vehicle", options: AnyOptions) -> Sequence[str]:
        """What the user should know before the flight of one vehicle, which is ready to arm."""
        return ()

    async def plan_items(self, vehicle: "Vehicle", options: AnyOptions) -> "Sequence[MissionItem]":
        """The mission items that would be uploaded to one vehicle, which is ready to arm; for mission files.

        Raises:
            PlanError: this mission is not flown by uploaded waypoints.
        """
        raise PlanError(f"mission {self.name} is not flown by uploaded waypoints; there is no file of it")

    async def fly(self, vehicle: "Vehicle", options: AnyOptions) -> None:
        """Fly one vehicle, which is ready to arm, including takeoff and landing."""
        raise PlanError(f"mission {self.name} flies no single vehicle")

    async def fly_team(self, vehicles: "Sequence[Vehicle]", options: Sequence[AnyOptions]) -> None:
        """Fly all vehicles of a team, each ready to arm; called instead of `fly` if `flies_as_team`."""
        raise PlanError(f"mission {self.name} flies no team")

    def estimator_settings(self, options: AnyOptions) -> Mapping[str, float | str]:
        """Parameter values of estimators that follow from the mission, by name.

        An estimator that runs during the flight receives the parameters that it has and that the user did not
        set.
        """
        return {}

    def estimator_files(self, options: AnyOptions) -> Mapping[str, tuple[str, bytes]]:
        """Files that estimators read, which follow from the mission: name and contents of each, by the name
        of the parameter that names the file.

        They are in the run folder before the flight if its estimator has the parameter.
        """
        return {}

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        """Why a flight that came to its end has not flown what was commanded; "" if it has.

        By the messages of the vehicles alone. Here: the commanded paths, where there are any.

        Args:
            debriefing: of the flight.
            max_error_m: the user's own bound for the path error.
        """
        from missions.flown.verdict import path_verdict

        return verdict_of_all(debriefing, lambda notes, score: path_verdict(notes, score, max_error_m))

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        """What `summary.json` has beside the figures of every flight."""
        return {}

    def files(self, debriefing: Debriefing) -> Mapping[str, bytes]:
        """Further files of the run folder: contents by name."""
        return {}

    def report_lines(self, summary: Mapping[str, Any]) -> Sequence[str]:
        """Lines that the command line prints after a completed flight, besides those of every flight."""
        return ()

    def title(self, options: AnyOptions) -> str:
        """First words of the picture's title."""
        return self.name

    def pictures(self, debriefing: Debriefing, pictures_of: "PicturesOf") -> Mapping[str, bytes]:
        """Pictures and videos of the cameras, by file name, with what the mission draws in."""
        return {}

    def draw(self, path: "Path", title: str, debriefing: Debriefing) -> None:
        """Draw `track.png`."""
        from missions.flown.picture import draw_run

        draw_run(path, title, list(debriefing.flights))
