"""The world: vehicles, air, sensors. Uses no MAVLink, no sockets and no wall clock."""

from typing import TYPE_CHECKING, Final

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from flightsim.airframe_file import known_models, load_airframe
    from flightsim.environment import Environment, Turbulence
    from flightsim.home import Home
    from flightsim.world import World
    from flightsim.world_spec import FaultSpec, VehicleSpec, WorldSpec

__all__ = [
    "Environment",
    "FaultSpec",
    "Home",
    "Turbulence",
    "VehicleSpec",
    "World",
    "WorldSpec",
    "known_models",
    "load_airframe",
]

_MODULES: Final = {
    "Environment": "flightsim.environment",
    "FaultSpec": "flightsim.world_spec",
    "Home": "flightsim.home",
    "Turbulence": "flightsim.environment",
    "VehicleSpec": "flightsim.world_spec",
    "World": "flightsim.world",
    "WorldSpec": "flightsim.world_spec",
    "known_models": "flightsim.airframe_file",
    "load_airframe": "flightsim.airframe_file",
}

__getattr__ = lazy_exports(__name__, _MODULES)
