"""The base class of all missions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.base.flight import AnyOptions, FunctionFlight, MissionFlight
from missions.base.options import FlightOptions, MissionOptions
from missions.base.report import Report
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.planning.outline import Outline
from missions.vehicle.limits import Limits
from missions.vehicle.sensors import Sensor
from missions.vehicle.vehicle import Vehicle

__all__ = ["Mission", "WorldDefaults"]


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


class Mission(Generic[AnyOptions]):
    """A mission that can be flown: it plans and makes flights, of which it remembers nothing.

    Subclasses override what differs.

    Attributes:
        name: name for users and for file names.
        world_defaults: the world it is flown in by default.
        kinds: kinds of vehicles that can fly it, the default one first.
        commands: the mission commands its vehicle. A mission that only observes leaves the vehicle in its
            current state, even in flight.
        lands_without_sensors: the mission itself ends when one of its sensors stops
            (`vehicle.sensors.stopped`), so that a team lands in its layers; otherwise the run ends it, and
            the vehicle returns.
        options_class: class of its options, which the command line makes of a mission of a user's package.
        unflown: figures of a run that ended before the mission's flight began.
    """

    name: str = "mission"
    world_defaults = WorldDefaults()
    kinds: tuple[VehicleKind, ...] = (VehicleKind.MULTICOPTER, VehicleKind.FIXED_WING)
    commands = True
    lands_without_sensors = False
    options_class: type[MissionOptions] = FlightOptions
    unflown: Mapping[str, Any] = MappingProxyType({})

    def adapted(self, options: AnyOptions, limits: Limits) -> AnyOptions:
        """The options as one vehicle flies them: options that were not specified get values that suit the
        vehicle.
        """
        return options

    def check(self, options: AnyOptions, limits: Limits) -> None:
        """Raise PlanError if one vehicle can't fly the mission.

        Called before anything is started, and again when the vehicle's own limits are known.
        """

    def check_place(self, options: AnyOptions, limits: Limits, home: GeodeticPosition) -> None:
        """Raise PlanError, before takeoff, if one vehicle can't fly the mission from its home.

        Called for embedded vehicles before anything is started, for other vehicles as soon as their home is
        known.
        """

    def with_map(self, options: AnyOptions, published: Path) -> AnyOptions:
        """The options, after a magnetic map of the embedded world was published to a file.

        Called for embedded vehicles only.
        """
        return options

    def sensors(self, options: AnyOptions) -> Sequence[Sensor]:
        """The sensors that each vehicle must carry.

        The run proves them before the takeoff and watches them, until the mission calls
        `vehicle.sensors.release` or has ended.
        """
        return ()

    async def outline(self, vehicle: Vehicle, options: AnyOptions) -> Outline | None:
        """The path that one vehicle, which is ready to arm, would fly; None: it is not known in advance."""
        return None

    async def remarks(self, vehicle: Vehicle, options: AnyOptions) -> Sequence[str]:
        """What the user should know before the flight of one vehicle, which is ready to arm."""
        return ()

    async def plan_items(self, vehicle: Vehicle, options: AnyOptions) -> Sequence[MissionItem]:
        """The mission items that would be uploaded to one vehicle, which is ready to arm; for mission files.

        Raises:
            PlanError: this mission is not flown by uploaded waypoints.
        """
        raise PlanError(f"mission {self.name} is not flown by uploaded waypoints; there is no file of it")

    async def fly(self, vehicle: Vehicle, options: AnyOptions) -> Report | None:
        """Fly one vehicle, which is ready to arm, including takeoff and landing.

        Returns:
            What is reported about the flight beside the figures of every flight; None: nothing.
        """
        raise PlanError(f"mission {self.name} flies no single vehicle")

    def flight(self, vehicles: Sequence[Vehicle], options: Sequence[AnyOptions]) -> MissionFlight[AnyOptions]:
        """A flight of vehicles that are ready to arm. Here: each by `fly`.

        Args:
            vehicles: the vehicles.
            options: of each, adapted to it.

        Raises:
            PlanError: they can't be flown so.
        """
        return FunctionFlight(vehicles, options, self.fly)

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

    def refuse_arguments(self, options: MissionOptions) -> None:
        """Refuse arguments, which are for missions of users."""
        for name in options.arguments:
            raise PlanError(f"`arguments` {name}: {self.name} takes none; they are for missions of your own")
