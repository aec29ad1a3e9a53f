"""The content of a SITL world: vehicles, place, air and seed. Data only; `Sitl` builds it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Final

from flightsim.airframe import AirframeKind, LaunchKind, load_airframe
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.payload import GroundTargetParameters, MagneticField, PayloadParameters
from flightsim.sensors import GpsParameters, SensorSuiteParameters

FIXED_EPOCH_UNIX_US: Final = 1_735_689_600_000_000
"""2025-01-01T00:00:00Z: the default time of boot, so that equal flights give equal logs."""

TEAM_SPACING_M: Final[Mapping[AirframeKind, float]] = MappingProxyType(
    {AirframeKind.MULTICOPTER: 5.0, AirframeKind.FIXED_WING: 25.0}
)
"""Space beside each vehicle; between two vehicles of different kinds, the larger of both values."""
MAX_VEHICLES: Final = 250


HOMES: Final[Mapping[str, Home]] = MappingProxyType(
    {
        "px4": Home(lat_deg=47.39774, lon_deg=8.54559, alt_m=489.4),
        "ardupilot": Home(lat_deg=-35.3632621, lon_deg=149.1652374, alt_m=584.0, heading_deg=353.0),
    }
)
"""The default place of each firmware's own SITL: Zurich and Canberra."""


def parse_home(text: str) -> Home:
    """Home from "lat,lon,alt[,heading]", as ArduPilot's SITL writes it.

    Raises:
        ValueError: the text has another form, or a number is out of range.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (3, 4):
        raise ValueError(f"home {text!r} is not 'lat,lon,alt[,heading]', for example 47.3977,8.5456,489,0")
    heading_deg = numbers[3] if len(numbers) == 4 else 0.0
    return Home(lat_deg=numbers[0], lon_deg=numbers[1], alt_m=numbers[2], heading_deg=heading_deg)


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleSpecification:
    """One vehicle of the world.

    Attributes:
        system_id: MAVLink system id, 1..250.
        model: name of one of our models or of an aircraft in the `jsbsim` package, or a path.
        flavour: "px4" or "ardupilot".
        offset_ne_m: its place, north and east of home.
        parameters: autopilot parameters that differ from the flavour's defaults.
        launch: how an aircraft is launched: "runway", "catapult" or "hand"; None: as its description
            defines.
        payload: its mission payload; by default none.
        gps: its receiver, one of `flightsim.sensors.RECEIVERS`: "differential" is about as accurate as the
            receivers in the firmwares' own simulators, "standalone" as a receiver without corrections.
        sensors: all its sensors, instead of the usual ones and of `gps`; None: the usual ones.
    """

    system_id: int = 1
    model: str | Path = "iris"
    flavour: str = "px4"
    offset_ne_m: tuple[float, float] = (0.0, 0.0)
    parameters: Mapping[str, float] = field(default_factory=dict)
    launch: str | None = None
    payload: PayloadParameters = field(default_factory=PayloadParameters)
    gps: str = "differential"
    sensors: SensorSuiteParameters | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.system_id <= MAX_VEHICLES:
            raise ValueError(f"system id {self.system_id} is not in 1..{MAX_VEHICLES}")
        if self.launch is not None and self.launch not in tuple(LaunchKind):
            accepted = ", ".join(kind.value for kind in LaunchKind)
            raise ValueError(f"launch {self.launch!r} is unknown; accepted: {accepted}")
        GpsParameters.of(self.gps)


@dataclass(frozen=True, slots=True, kw_only=True)
class SitlConfiguration:
    """A whole world.

    Attributes:
        vehicles: at least one; system ids differ.
        home: None: the place of the first vehicle's flavour.
        environment: wind, turbulence, date.
        seed: root of every random stream.
        physics_rate_hz: steps per second.
        unix_epoch_us: the time of boot by the vehicles' clocks.
        targets: targets on the ground that cameras can detect.
        magnetic_field: the field that survey magnetometers measure.
    """

    vehicles: tuple[VehicleSpecification, ...] = (VehicleSpecification(),)
    home: Home | None = None
    environment: Environment = field(default_factory=Environment)
    seed: int = 0
    physics_rate_hz: int = 250
    unix_epoch_us: int = FIXED_EPOCH_UNIX_US
    targets: tuple[GroundTargetParameters, ...] = ()
    magnetic_field: MagneticField | None = None

    def __post_init__(self) -> None:
        if not self.vehicles:
            raise ValueError("a SITL needs at least one vehicle")
        ids = [vehicle.system_id for vehicle in self.vehicles]
        if len(set(ids)) != len(ids):
            raise ValueError(f"system ids {ids} are not all different")

    @property
    def place(self) -> Home:
        """Home, resolved."""
        if self.home is not None:
            return self.home
        return HOMES.get(self.vehicles[0].flavour, HOMES["px4"])


def team(
    count: int,
    *,
    model: str | Path | Sequence[str | Path],
    flavour: str,
    parameters: Mapping[str, float],
    launch: str | None = None,
    heading_deg: float = 0.0,
    gps: str = "differential",
) -> tuple[VehicleSpecification, ...]:
    """`count` vehicles with system ids 1, 2, ... in a row to the right of the first.

    Args:
        count: number of vehicles.
        model: of all vehicles, or one for each.
        flavour: of all vehicles.
        parameters: that differ from the flavour's defaults.
        launch: how the aircraft of the team are launched.
        heading_deg: heading of all vehicles; the row is perpendicular to it, so that runways are side by
            side.
        gps: receiver of all vehicles.

    Raises:
        ValueError: count is not in 1..250, or differs from the number of models; a launch of multicopters.
        AirframeError: a model can't be used.
    """
    if not 1 <= count <= MAX_VEHICLES:
        raise ValueError(f"vehicle count {count} is not in 1..{MAX_VEHICLES}")
    models = [model] * count if isinstance(model, str | Path) else list(model)
    if len(models) != count:
        raise ValueError(f"{len(models)} models for {count} vehicles; accepted: one for all, or {count}")
    kinds = [load_airframe(each).kind for each in models]
    if launch is not None and AirframeKind.FIXED_WING not in kinds:
        names = ", ".join(str(name) for name in dict.fromkeys(models))
        raise ValueError(
            f"launch {launch!r} is for aircraft, and there is none among {names}; "
            "leave it out, or choose the model of an aircraft, such as aerosonde"
        )
    right = (-math.sin(math.radians(heading_deg)), math.cos(math.radians(heading_deg)))
    along_m, vehicles = 0.0, []
    for index, (each, kind) in enumerate(zip(models, kinds, strict=True)):
        if index:
            along_m += max(TEAM_SPACING_M[kind], TEAM_SPACING_M[kinds[index - 1]])
        vehicles.append(
            VehicleSpecification(
                system_id=index + 1,
                model=each,
                flavour=flavour,
                offset_ne_m=(right[0] * along_m + 0.0, right[1] * along_m),
                parameters=parameters,
                launch=launch if kind is AirframeKind.FIXED_WING else None,
                gps=gps,
            )
        )
    return tuple(vehicles)
