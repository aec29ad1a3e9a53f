"""An embedded SITL: the simulated world in this process, on virtual time, one memory link per vehicle."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from autopilot_bridge.clock import VirtualTimeLoop
from autopilot_bridge.links import Link
from autopilot_bridge.sitl import Sitl
from autopilot_bridge.sitl.sitl import TruthListener
from flightsim.airframe import load_airframe
from flightsim.environment import Environment
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.home import Home
from flightsim.vehicle import VehicleDivergedError
from flightsim.wind_profile import WindLaw, WindProfile
from flightsim.world_spec import HOMES, WorldSpec, team
from missions.embedded.scenario import equipped, publish
from missions.errors import MissionError
from missions.kind import VehicleKind
from missions.scenario import Scenario

MAX_FLIGHT_S = 24 * 3600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class EmbeddedConfiguration:
    """Configuration of the simulated world that a mission is flown in.

    Attributes:
        vehicles: number of vehicles, with system ids 1, 2, ...
        model: model of all vehicles, or one for each vehicle: a name, or a path.
        launch: launch method of the aircraft; None: the method in each aircraft's description.
        flavour: "px4" or "ardupilot".
        seed: the same seed gives the same flight.
        physics_rate_hz: steps per second of vehicle time.
        speedup: simulated seconds per wall second at most; None: as fast as the machine can.
        wind_speed_m_s, wind_from_deg: mean wind, at 10 m above ground.
        wind_profile: law of wind speed over height, a `flightsim.wind_profile.WindLaw`.
        turbulence: "none", "light", "moderate" or "severe".
        parameters: autopilot parameters that differ from the flavour's defaults.
        gps: receiver class of all vehicles, "differential" or "standalone".
        home: "lat,lon,alt[,heading]"; None: the default place of the flavour's own SITL.
        max_flight_s: vehicle time, s, after which a run that has not ended fails.
        scenario: targets, payload and magnetic map that the mission needs.
    """

    vehicles: int = 1
    model: str | Path | Sequence[str | Path] = "iris"
    launch: str | None = None
    flavour: str = "px4"
    seed: int = 0
    physics_rate_hz: int = 250
    speedup: float | None = None
    wind_speed_m_s: float = 0.0
    wind_from_deg: float = 0.0
    wind_profile: str = "log"
    turbulence: str = "none"
    parameters: Mapping[str, float] = field(default_factory=dict)
    gps: str = "differential"
    home: str | None = None
    max_flight_s: float = MAX_FLIGHT_S
    scenario: Scenario = field(default_factory=Scenario)

    def __post_init__(self) -> None:
        if self.speedup is not None and not 0.0 < self.speedup < float("inf"):
            raise ValueError(f"speed factor {self.speedup} is not accepted; give a number above 0")


class EmbeddedSitl:
    """A simulated world, the event loop that runs on its time, and a link to each vehicle.

    Attributes:
        sitl: the world.
        loop: run the mission on it (`autopilot_bridge.clock.run`).
        links: the mission's end of each vehicle's link.
    """

    def __init__(self, configuration: EmbeddedConfiguration) -> None:
        flavour = configuration.flavour
        if configuration.home is not None:
            home = Home.parse(configuration.home)
        else:
            home = HOMES.get(flavour, HOMES["px4"])
        vehicles = team(
            configuration.vehicles,
            model=configuration.model,
            autopilot=flavour,
            parameters=configuration.parameters,
            launch=configuration.launch,
            heading_deg=home.heading_deg,
            gps=configuration.gps,
        )
        environment = Environment.from_wind(
            speed_m_s=configuration.wind_speed_m_s,
            from_deg=configuration.wind_from_deg,
            profile=WindProfile(law=WindLaw(configuration.wind_profile)),
            turbulence=configuration.turbulence,
        )
        world = WorldSpec(
            vehicles=vehicles,
            home=home,
            air=environment,
            seed=configuration.seed,
            physics_rate_hz=configuration.physics_rate_hz,
        )
        self.sitl = Sitl(equipped(world, configuration.scenario))
        for path in configuration.scenario.published:
            assert self.sitl.published_map is not None
            publish(self.sitl.published_map, path)
        self.links: list[Link] = [self.sitl.connect(index) for index in range(configuration.vehicles)]
        sitl = self.sitl

        def advance() -> None:
            try:
                sitl.advance()
            except VehicleDivergedError as error:
                raise MissionError(f"the simulation ended: {error}") from error

        self.loop = VirtualTimeLoop(
            advance,
            lambda: sitl.time_us,
            speedup=configuration.speedup,
            max_time_us=round(configuration.max_flight_s * 1e6),
        )

    def parameters(self, index: int, names: Sequence[str]) -> dict[str, float]:
        """Parameter values of a vehicle's autopilot, as it would send them; names it does not have are left
        out.
        """
        return self.sitl.vehicles[index].parameter_values(names)

    @property
    def home(self) -> GeodeticPosition:
        """The home of the vehicles."""
        place = self.sitl.spec.place
        return GeodeticPosition(lat_deg=place.lat_deg, lon_deg=place.lon_deg, alt_m=place.alt_m)

    @property
    def time_us(self) -> int:
        """Vehicle time, microseconds since boot."""
        return self.sitl.time_us

    def on_truth(self, listener: TruthListener) -> None:
        """Subscribe to frames of truth at 50 Hz, for the log and the score."""
        self.sitl.on_truth(listener)

    def close(self) -> None:
        """Close every link."""
        self.sitl.close()
        for link in self.links:
            link.close()


def open_embedded(configuration: EmbeddedConfiguration) -> EmbeddedSitl:
    """Build the world. Simulated time does not advance before the loop runs.

    Raises:
        ValueError: a value is not accepted; the message names it and what is accepted.
        MissionError: a file that the scenario publishes cannot be written.
    """
    return EmbeddedSitl(configuration)


def model_kind(model: str | Path) -> VehicleKind:
    """Class of vehicle of a model.

    Raises:
        ValueError: the model does not exist.
    """
    return VehicleKind(load_airframe(model).kind.value)
