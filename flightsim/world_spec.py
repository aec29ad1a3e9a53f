"""The description of a world: vehicles, place, air, targets, magnetic field, scheduled faults and seed.

Data only; `autopilot_bridge.sitl.Sitl` builds the world. It can also be read from a TOML file
(`WorldSpec.load`, docs/world.md).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Self

from flightsim.airframe import AirframeError, AirframeKind, LaunchKind, load_airframe
from flightsim.environment import Environment
from flightsim.home import Home
from flightsim.initial_state import InitialState
from flightsim.payload import (
    GroundTargetParameters,
    MagneticField,
    MagneticSpec,
    PayloadParameters,
    Terrain,
    TerrainSpec,
)
from flightsim.sensors import GpsParameters, SensorSuiteParameters
from flightsim.sensors.fault_kinds import FaultType, SensorUnit
from flightsim.world import WorldParameters
from flightsim.world_file import WorldFileError, made_from, read_toml

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


class FaultUnit(IntEnum):
    """What can fail: MAVLink's FAILURE_UNIT."""

    GYRO = SensorUnit.GYRO
    ACCEL = SensorUnit.ACCEL
    MAG = SensorUnit.MAG
    BARO = SensorUnit.BARO
    GPS = SensorUnit.GPS
    OPTICAL_FLOW = SensorUnit.OPTICAL_FLOW
    VIO = SensorUnit.VIO
    DISTANCE_SENSOR = SensorUnit.DISTANCE_SENSOR
    AIRSPEED = SensorUnit.AIRSPEED
    BATTERY = SensorUnit.BATTERY
    MOTOR = 101
    SERVO = 102
    AVOIDANCE = SensorUnit.AVOIDANCE
    RC_SIGNAL = 104
    MAVLINK_SIGNAL = 105


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultSpec:
    """A fault of one vehicle that begins, and perhaps ends, at a vehicle time.

    Attributes:
        unit: what fails.
        failure: how, as MAV_CMD_INJECT_FAILURE has it, or DRIFT. A motor and a servo know OFF and WRONG (half
            effective), a servo also STUCK, the signals OFF.
        start_s: vehicle time at which it begins.
        duration_s: how long it lasts; None: to the end.
        vehicle: system id of the vehicle.
        instance: which of several, from 1; 0: all.
        bias, drift_per_s, slow_factor, delay_s, mean_up_s, mean_down_s, no_fix, blocked: form of a sensor's
            failure, as in `FaultPanel.inject`; None or False: its default form.
    """

    unit: FaultUnit
    failure: FaultType = FaultType.OFF
    start_s: float
    duration_s: float | None = None
    vehicle: int = 1
    instance: int = 0
    bias: tuple[float, ...] | None = None
    drift_per_s: tuple[float, ...] | None = None
    slow_factor: int | None = None
    delay_s: float | None = None
    mean_up_s: float | None = None
    mean_down_s: float | None = None
    no_fix: bool = False
    blocked: bool = False

    def __post_init__(self) -> None:
        if not (math.isfinite(self.start_s) and self.start_s >= 0.0):
            raise ValueError(f"start_s {self.start_s} is no vehicle time; accepted are 0 s and later")
        if self.duration_s is not None and not (math.isfinite(self.duration_s) and self.duration_s > 0.0):
            raise ValueError(
                f"duration_s {self.duration_s} is not accepted; give more than 0 s, or leave it out"
            )
        if self.failure is FaultType.OK:
            raise ValueError("failure OK is no fault; the end of a fault is start_s + duration_s")

    @property
    def options(self) -> dict[str, object]:
        """The form of the failure, for `FaultPanel.inject`."""
        names = (
            *("bias", "drift_per_s", "slow_factor", "delay_s", "mean_up_s", "mean_down_s"),
            *("no_fix", "blocked"),
        )
        given = {name: getattr(self, name) for name in names}
        return {name: value for name, value in given.items() if value is not None and value is not False}


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleSpec:
    """One vehicle of the world.

    Attributes:
        system_id: MAVLink system id, 1..250.
        model: name of one of our models or of an aircraft in the `jsbsim` package, or a path.
        autopilot: flavour of its autopilot, "px4" or "ardupilot".
        offset_ne_m: its place, north and east of home.
        parameters: autopilot parameters that differ from the flavour's defaults.
        launch: how an aircraft is launched: "runway", "catapult" or "hand"; None: as its description
            defines.
        payload: its mission payload; by default none.
        gps: its receiver, one of `flightsim.sensors.RECEIVERS`: "differential" is about as accurate as the
            receivers in the firmwares' own simulators, "standalone" as a receiver without corrections.
        sensors: all its sensors, instead of the usual ones and of `gps`; None: the usual ones.
        battery_ah: capacity of its battery, of the same mass; None: the model's.
    """

    system_id: int = 1
    model: str | Path = "iris"
    autopilot: str = "px4"
    offset_ne_m: tuple[float, float] = (0.0, 0.0)
    parameters: Mapping[str, float] = field(default_factory=dict)
    launch: str | None = None
    payload: PayloadParameters = field(default_factory=PayloadParameters)
    gps: str = "differential"
    sensors: SensorSuiteParameters | None = None
    battery_ah: float | None = None

    def __post_init__(self) -> None:
        if not 1 <= self.system_id <= MAX_VEHICLES:
            raise ValueError(f"system id {self.system_id} is not in 1..{MAX_VEHICLES}")
        if self.launch is not None and self.launch not in tuple(LaunchKind):
            accepted = ", ".join(kind.value for kind in LaunchKind)
            raise ValueError(f"launch {self.launch!r} is unknown; accepted: {accepted}")
        GpsParameters.of(self.gps)
        InitialState(battery_ah=self.battery_ah)


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldSpec:
    """A whole world.

    Attributes:
        vehicles: at least one; system ids differ.
        home: None: the place of the first vehicle's flavour.
        air: wind, turbulence, date.
        seed: root of every random stream.
        physics_rate_hz: steps per second.
        unix_epoch_us: the time of boot by the vehicles' clocks.
        targets: targets on the ground that cameras and target sensors can detect.
        magnetic_field: the field that survey magnetometers measure: data, or a field made in Python.
        terrain: hides targets from target sensors: generated, or given in Python; None: level ground.
        faults: scheduled faults; a later one of the same unit replaces an earlier one.
    """

    vehicles: tuple[VehicleSpec, ...] = (VehicleSpec(),)
    home: Home | None = None
    air: Environment = field(default_factory=Environment)
    seed: int = 0
    physics_rate_hz: int = 250
    unix_epoch_us: int = FIXED_EPOCH_UNIX_US
    targets: tuple[GroundTargetParameters, ...] = ()
    magnetic_field: MagneticSpec | MagneticField | None = None
    terrain: TerrainSpec | Terrain | None = None
    faults: tuple[FaultSpec, ...] = ()

    def __post_init__(self) -> None:
        if not self.vehicles:
            raise ValueError("a world needs at least one vehicle")
        ids = [vehicle.system_id for vehicle in self.vehicles]
        if len(set(ids)) != len(ids):
            raise ValueError(f"system ids {ids} are not all different")
        for fault in self.faults:
            if fault.vehicle not in ids:
                raise ValueError(f"a fault is for vehicle {fault.vehicle}; accepted are system ids {ids}")
        WorldParameters(seed=self.seed, physics_rate_hz=self.physics_rate_hz)

    @property
    def place(self) -> Home:
        """Home, resolved."""
        if self.home is not None:
            return self.home
        return HOMES.get(self.vehicles[0].autopilot, HOMES["px4"])

    @property
    def magnetic_targets_ne_m(self) -> tuple[tuple[float, float], ...]:
        """True places of the magnetic targets, north and east of the map's home."""
        field = self.magnetic_field
        return () if field is None else tuple((s.north_m, s.east_m) for s in field.signatures)

    @classmethod
    def of_team(
        cls,
        count: int | None = None,
        *,
        model: str | Path | Sequence[str | Path] = "iris",
        autopilot: str = "px4",
        parameters: Mapping[str, float] = MappingProxyType({}),
        launch: str | None = None,
        gps: str = "differential",
        home: Home | None = None,
        **fields: Any,
    ) -> Self:
        """A world with a team (`team`) that has the heading of home.

        Args:
            count: None: as many as models.
            model, autopilot, parameters, launch, gps: of the team.
            home: None: the default place of the flavour.
            fields: other fields of the world.

        Raises:
            ValueError: a value is not accepted.
        """
        place = HOMES.get(autopilot, HOMES["px4"]) if home is None else home
        if count is None:
            count = 1 if isinstance(model, str | Path) else len(model)
        vehicles = team(
            count,
            model=model,
            autopilot=autopilot,
            parameters=parameters,
            launch=launch,
            heading_deg=place.heading_deg,
            gps=gps,
        )
        return cls(vehicles=vehicles, home=home, **fields)

    @classmethod
    def load(cls, path: str | Path) -> Self:
        """The world that a TOML file describes (docs/world.md).

        Vehicles without `system_id` get 1, 2, ... in their order. When no vehicle has `offset_ne_m`, they
        stand in a row to the right of the first.

        Raises:
            WorldFileError: the file can't be read or a value is not accepted; the message names file, key,
                value and what is accepted.
        """
        path = Path(path)
        data = read_toml(path)
        vehicles = data.get("vehicles")
        tables = (
            [table for table in vehicles if isinstance(table, dict)] if isinstance(vehicles, list) else []
        )
        for number, table in enumerate(tables, 1):
            table.setdefault("system_id", number)
        world = made_from(cls, data, path)
        if tables and not any("offset_ne_m" in table for table in tables):
            try:
                placed = in_a_row(world.vehicles, heading_deg=world.place.heading_deg)
            except AirframeError as error:
                raise WorldFileError(f"{path}: vehicles: {error}") from error
            world = replace(world, vehicles=placed)
        return world


def in_a_row(vehicles: Sequence[VehicleSpec], *, heading_deg: float) -> tuple[VehicleSpec, ...]:
    """The vehicles, placed in a row to the right of the first, which stands at home.

    Args:
        vehicles: their places are not used.
        heading_deg: of all vehicles; the row is perpendicular to it, so that runways are side by side.

    Raises:
        AirframeError: a model can't be used.
    """
    spaces_m = [TEAM_SPACING_M[load_airframe(vehicle.model).kind] for vehicle in vehicles]
    north, east = -math.sin(math.radians(heading_deg)), math.cos(math.radians(heading_deg))
    along_m, placed = 0.0, []
    for index, vehicle in enumerate(vehicles):
        if index:
            along_m += max(spaces_m[index], spaces_m[index - 1])
        placed.append(replace(vehicle, offset_ne_m=(north * along_m + 0.0, east * along_m)))
    return tuple(placed)


def team(
    count: int,
    *,
    model: str | Path | Sequence[str | Path],
    autopilot: str = "px4",
    parameters: Mapping[str, float] = MappingProxyType({}),
    launch: str | None = None,
    heading_deg: float = 0.0,
    gps: str = "differential",
) -> tuple[VehicleSpec, ...]:
    """`count` vehicles with system ids 1, 2, ... in a row to the right of the first.

    Args:
        count: number of vehicles.
        model: of all vehicles, or one for each.
        autopilot: flavour of all vehicles.
        parameters: that differ from the flavour's defaults.
        launch: how the aircraft of the team are launched.
        heading_deg: heading of all vehicles.
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
    members = [
        VehicleSpec(system_id=number, model=each, autopilot=autopilot, parameters=parameters, gps=gps)
        for number, each in enumerate(models, 1)
    ]
    return in_a_row(launched(members, launch), heading_deg=heading_deg)


def launched(vehicles: Sequence[VehicleSpec], launch: str | None) -> tuple[VehicleSpec, ...]:
    """The vehicles, with a launch method for the aircraft among them; None: each aircraft's own.

    Raises:
        ValueError: a launch of multicopters.
        AirframeError: a model can't be used.
    """
    kinds = [load_airframe(vehicle.model).kind for vehicle in vehicles]
    if launch is not None and AirframeKind.FIXED_WING not in kinds:
        names = ", ".join(str(name) for name in dict.fromkeys(vehicle.model for vehicle in vehicles))
        raise ValueError(
            f"launch {launch!r} is for aircraft, and there is none among {names}; "
            "leave it out, or choose the model of an aircraft, such as aerosonde"
        )
    return tuple(
        replace(vehicle, launch=launch if kind is AirframeKind.FIXED_WING else None)
        for vehicle, kind in zip(vehicles, kinds, strict=True)
    )
