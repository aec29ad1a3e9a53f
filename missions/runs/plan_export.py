"""A mission written to a file of a ground station instead of being flown."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from flightsim.foundation.geodesy import GeodeticPosition
from missions.base.mission import Mission
from missions.base.options import MissionOptions
from missions.base.request import RunRequest
from missions.errors import MissionError, PlanError
from missions.kind import VehicleKind
from missions.plan_files.files import check_suffix, write_mission_file
from missions.process.ending import EndedBySignal
from missions.runs.session import COMPLETED, INTERRUPTED, fly
from missions.vehicle.limits import Limits
from missions.vehicle.vehicle import Vehicle


def export_plan(mission: Mission[Any], request: RunRequest, path: Path) -> int:
    """Write the plan that a mission would upload to its vehicle; returns the number of items.

    Only the home and the limits are requested from the vehicle, embedded or elsewhere. A vehicle in flight is
    not affected.

    Raises:
        PlanError: the mission uploads no plan or can't be flown, the file can't be written, or parameters are
            to be set on a vehicle that is not embedded.
        MissionError: no message is received from the vehicle, or it is not ready.
        KeyboardInterrupt: the user interrupted it.
    """

    check_suffix(path)
    if request.options.vehicles > 1:
        raise PlanError("a mission file is for one vehicle; leave `vehicles` out")
    if type(mission).plan_items is Mission.plan_items:
        raise PlanError(f"mission {mission.name} is not flown by uploaded waypoints; there is no file of it")
    if request.connect and request.parameters:
        raise PlanError(
            "parameters are set before a flight, and this is none: leave `parameters` out, or set them first "
            "with flightstack vehicle params load"
        )
    exported = _Exported(mission, path)
    with TemporaryDirectory() as folder:
        request_with_plan = replace(
            request, out=Path(folder) / "run", picture=False, confirm=None, estimator=None, max_error_m=None
        )
        result = fly(exported, request_with_plan)
    if result.outcome == INTERRUPTED:
        raise EndedBySignal(result.signal)
    if result.outcome != COMPLETED:
        raise MissionError(result.reason)
    return exported.count


class _Exported(Mission[MissionOptions]):
    """A mission that writes its plan to a file instead of flying."""

    commands = False

    def __init__(self, mission: Mission[Any], path: Path) -> None:
        self.name = mission.name
        self.kinds = mission.kinds
        self.world_defaults = mission.world_defaults
        self.count = 0
        self._mission, self._path = mission, path

    def adapted(self, options: MissionOptions, limits: Limits) -> MissionOptions:
        adapted: MissionOptions = self._mission.adapted(options, limits)
        return adapted

    def check(self, options: MissionOptions, limits: Limits) -> None:
        self._mission.check(options, limits)

    def check_place(self, options: MissionOptions, limits: Limits, home: GeodeticPosition) -> None:
        self._mission.check_place(options, limits, home)

    async def fly(self, vehicle: Vehicle, options: MissionOptions) -> None:
        if vehicle.kind is VehicleKind.FIXED_WING:
            vehicle.wing.note_runway()
        items = await self._mission.plan_items(vehicle, options)
        write_mission_file(
            self._path,
            tuple(items),
            vehicle.home,
            firmware=vehicle.autopilot,
            kind=vehicle.kind,
            speed_m_s=getattr(options, "speed_m_s", 5.0),
        )
        self.count = len(items)
