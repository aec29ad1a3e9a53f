"""Missions, and the runs that fly them: on an embedded SITL, or on any vehicle.

from missions import FlightOptions, RunRequest, fly

result = fly("lissajous", RunRequest(options=FlightOptions(width_m=60.0, height_m=60.0)))
print(result.outcome, result.summary["path_rms_error_m"], result.folder)

"""

from typing import TYPE_CHECKING, Final

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from missions.embedded import occupancy_world, orbit_world
    from missions.errors import MissionError, PlanError
    from missions.library import MISSIONS, find_mission
    from missions.mission import Mission
    from missions.occupancy.options import OccupancyOptions
    from missions.options import FlightOptions, MissionOptions, Via
    from missions.orbit.options import OrbitOptions
    from missions.runs.request import RunRequest
    from missions.runs.session import RunResult, fly
    from missions.vehicle.setpoint import Setpoint
    from missions.vehicle.vehicle import Vehicle

__all__ = [
    "MISSIONS",
    "FlightOptions",
    "Mission",
    "MissionError",
    "MissionOptions",
    "OccupancyOptions",
    "OrbitOptions",
    "PlanError",
    "RunRequest",
    "RunResult",
    "Setpoint",
    "Vehicle",
    "Via",
    "find_mission",
    "fly",
    "occupancy_world",
    "orbit_world",
]

_MODULES: Final = {
    "MISSIONS": "missions.library",
    "FlightOptions": "missions.options",
    "Mission": "missions.mission",
    "MissionError": "missions.errors",
    "MissionOptions": "missions.options",
    "OccupancyOptions": "missions.occupancy.options",
    "OrbitOptions": "missions.orbit.options",
    "PlanError": "missions.errors",
    "RunRequest": "missions.runs.request",
    "RunResult": "missions.runs.session",
    "Setpoint": "missions.vehicle.setpoint",
    "Vehicle": "missions.vehicle.vehicle",
    "Via": "missions.options",
    "find_mission": "missions.library",
    "fly": "missions.runs.session",
    "occupancy_world": "missions.embedded",
    "orbit_world": "missions.embedded",
}

__getattr__ = lazy_exports(__name__, _MODULES)
