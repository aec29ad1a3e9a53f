"""What every mission is."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.options import MissionOptions
from missions.planning.limits import Limits
from missions.scenario import Scenario, Setting

if TYPE_CHECKING:
    from pathlib import Path

    from autopilot_bridge.geodesy import GeodeticPosition
    from autopilot_bridge.mission_plan import MissionItem
    from missions.notes import FlightNotes
    from missions.outline import Outline
    from missions.records import FlightRecords
    from missions.score import FlightScore
    from missions.vehicle.vehicle import Vehicle

AnyOptions = TypeVar("AnyOptions", bound=MissionOptions)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldDefaults:
    """The embedded world a mission is flown in unless somebody asks for another.

    Attributes:
        model: vehicle.
        wind: "SPEED[@FROM]", m/s and degrees.
        turbulence: "none", "light", "moderate" or "severe".
        autopilot: flavour; None: any.
        home: "lat,lon,alt[,heading]"; None: the flavour's own.
    """

    model: str = "iris"
    wind: str = "0"
    turbulence: str = "none"
    autopilot: str | None = None
    home: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Debriefing:
    """What there is to say of a flight when it is over.

    Attributes:
        records: of all vehicles and, embedded, of the truth.
        flights: notes and scores, one per vehicle.
        options: of the first vehicle.
    """

    records: "FlightRecords"
    flights: "Sequence[tuple[FlightNotes, FlightScore]]"
    options: MissionOptions


def verdict_of_all(debriefing: Debriefing, verdict: Callable[["FlightNotes", "FlightScore"], str]) -> str:
    """The verdicts on all vehicles of a flight in one sentence; "" if all have flown what was commanded."""
    told = {notes.system_id: verdict(notes, score) for notes, score in debriefing.flights}
    if len(told) == 1:
        return next(iter(told.values()))
    return "; ".join(f"vehicle {system_id}: {text}" for system_id, text in told.items() if text)


class Mission(Generic[AnyOptions]):
    """Something that can be flown. Subclasses say what they do differently.

    Attributes:
        name: for people and file names.
        world_defaults: the world it is flown in.
        kinds: of vehicles that can fly it, the usual one first.
        together: the vehicles of a team are flown by one `fly_team`, not each by a `fly`.
        commands: it commands its vehicle; one that does not leaves it as it is, in the air too.
    """

    name: str = "mission"
    world_defaults = WorldDefaults()
    kinds: tuple[VehicleKind, ...] = (VehicleKind.MULTICOPTER, VehicleKind.FIXED_WING)
    together = False
    commands = True

    def adapted(self, options: AnyOptions, limits: Limits) -> AnyOptions:
        """The options as one vehicle flies them: what nobody chose suits it."""
        return options.for_vehicle(limits)

    def check(self, options: AnyOptions, limits: Limits) -> None:
        """Refuse, with a PlanError, what one vehicle can't fly.

        Before anything is started, and again when its own limits are known.
        """

    def check_place(self, options: AnyOptions, limits: Limits, home: "GeodeticPosition") -> None:
        """Refuse, with a PlanError, what one vehicle can't fly from its home; before it takes off.

        Called for embedded vehicles, whose home is known; for others the mission itself does it.
        """

    def scenario(self, options: AnyOptions, setting: Setting) -> Scenario:
        """What an embedded world must hold beside the vehicles; not asked for vehicles elsewhere."""
        return Scenario()

    async def outline(self, vehicle: "Vehicle", options: AnyOptions) -> "Outline | None":
        """Where one vehicle, which is ready to arm, would fly; None: it can't be told."""
        return None

    async def plan_items(self, vehicle: "Vehicle", options: AnyOptions) -> "Sequence[MissionItem]":
        """What would be uploaded to one vehicle, which is ready to arm, for mission files.

        Raises:
            PlanError: this mission is not flown by uploaded waypoints.
        """
        raise PlanError(f"mission {self.name} is not flown by uploaded waypoints; there is no file of it")

    async def fly(self, vehicle: "Vehicle", options: AnyOptions) -> None:
        """Fly one vehicle, which is ready to arm, from the ground back to the ground."""
        raise PlanError(f"mission {self.name} flies no single vehicle")

    async def fly_team(self, vehicles: "Sequence[Vehicle]", options: Sequence[AnyOptions]) -> None:
        """Fly all vehicles of a team, each ready to arm; called instead of `fly` when `together`."""
        raise PlanError(f"mission {self.name} flies no team")

    def estimator_settings(self, options: AnyOptions) -> Mapping[str, float]:
        """Parameters of estimators that follow from what is flown, by name.

        An estimator that is taken along gets those that it has and nobody has set.
        """
        return {}

    def verdict(self, debriefing: Debriefing, max_error_m: float | None) -> str:
        """Why a flight that came to its end has not flown what was commanded; "" if it has.

        By the messages of the vehicles alone. Here: the commanded paths, where there are any.

        Args:
            debriefing: of the flight.
            max_error_m: the user's own bound for the path error.
        """
        from missions.verdict import path_verdict

        return verdict_of_all(debriefing, lambda notes, score: path_verdict(notes, score, max_error_m))

    def figures(self, debriefing: Debriefing) -> Mapping[str, Any]:
        """What `summary.json` has beside the figures of every flight."""
        return {}

    def said(self, summary: Mapping[str, Any]) -> Sequence[str]:
        """Lines that the command line says of a completed flight, beside those of every flight."""
        return ()

    def title(self, options: AnyOptions) -> str:
        """First words of the picture's title."""
        return self.name

    def draw(self, path: "Path", title: str, debriefing: Debriefing) -> None:
        """Draw `track.png`."""
        from missions.picture import draw_run

        draw_run(path, title, list(debriefing.flights))
