"""A vehicle's description beside its JSBSim model: actuators, truth and limits, from TOML."""

from flightsim.airframe_file import known_models, load_airframe, package_aircraft
from flightsim.airframe_types import (
    ActuatorChannel,
    Airframe,
    AirframeError,
    AirframeKind,
    FlightLimits,
    LaunchKind,
    LaunchParameters,
    Role,
)

__all__ = [
    "ActuatorChannel",
    "Airframe",
    "AirframeError",
    "AirframeKind",
    "FlightLimits",
    "LaunchKind",
    "LaunchParameters",
    "Role",
    "known_models",
    "load_airframe",
    "package_aircraft",
]
