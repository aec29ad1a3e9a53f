"""Missions, and the runs that fly them: on an embedded SITL, or on any vehicle.

from missions import FlightOptions, RunRequest, fly

result = fly("lissajous", RunRequest(options=FlightOptions(width_m=60.0, height_m=60.0)))
print(result.outcome, result.summary["path_rms_error_m"], result.folder)

"""

from typing import TYPE_CHECKING, Final

from flightsim.foundation.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from missions.base.mission import Mission
    from missions.base.options import FlightOptions, MissionOptions, Via
    from missions.base.request import RunRequest
    from missions.errors import MissionError, PlanError
    from missions.library import MISSIONS, find_mission
    from missions.occupancy.options import OccupancyOptions
    from missions.occupancy.world import occupancy_world
    from missions.orbit.options import OrbitOptions
    from missions.orbit.world import orbit_world
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
    "FlightOptions": "missions.base.options",
    "Mission": "missions.base.mission",
    "MissionError": "missions.errors",
    "MissionOptions": "missions.base.options",
    "OccupancyOptions": "missions.occupancy.options",
    "OrbitOptions": "missions.orbit.options",
    "PlanError": "missions.errors",
    "RunRequest": "missions.base.request",
    "RunResult": "missions.runs.session",
    "Setpoint": "missions.vehicle.setpoint",
    "Vehicle": "missions.vehicle.vehicle",
    "Via": "missions.base.options",
    "find_mission": "missions.library",
    "fly": "missions.runs.session",
    "occupancy_world": "missions.occupancy.world",
    "orbit_world": "missions.orbit.world",
}

__getattr__ = lazy_exports(__name__, _MODULES)
