"""The mission from a mission file."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.base.mission import Mission, WorldDefaults
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.plan_files.document import MissionDocument, PlannedHome
from missions.plan_files.file_flight import FileFlight
from missions.plan_files.files import read_mission_file
from missions.plan_files.flight import check_distance, own_speed_m_s
from missions.plan_files.options import FileOptions, Then
from missions.plan_files.route import placed, route_of
from missions.planning.outline import Outline
from missions.vehicle.limits import FixedWingLimits, Limits
from missions.vehicle.vehicle import Vehicle

_MODELS: Final = {VehicleKind.MULTICOPTER: "iris", VehicleKind.FIXED_WING: "aerosonde"}


class FileMission(Mission[FileOptions]):
    """A mission file, flown unchanged.

    Attributes:
        document: contents of the file.

    Raises:
        PlanError: the file can't be read, or its contents can't be flown.
    """

    def __init__(self, path: Path) -> None:
        self.document = document = read_mission_file(path)
        self.name = path.stem
        kind = document.kind or VehicleKind.MULTICOPTER
        self.kinds = (kind,) if document.kind else (VehicleKind.MULTICOPTER, VehicleKind.FIXED_WING)
        self.world_defaults = WorldDefaults(
            model=_MODELS[kind], autopilot=document.firmware, home=_home_text(document)
        )

    def adapted(self, options: FileOptions, limits: Limits) -> FileOptions:
        heights = [-stop.position_ned_m[2] for stop in route_of(self.document, self._plan_home).stops]
        return options.unless_chosen(altitude_m=max(heights, default=options.altitude_m))

    def check(self, options: FileOptions, limits: Limits) -> None:
        for name in options.arguments:
            raise PlanError(
                f"`arguments` {name}: {self.document.path} takes none; they are for missions of your own"
            )
        home = self.document.home
        self.document.check_heights(
            None if home is None else home.alt_m, below_home_allowed=options.allow_below_home
        )
        wings = isinstance(limits, FixedWingLimits)
        kind = VehicleKind.FIXED_WING if wings else VehicleKind.MULTICOPTER
        if self.document.kind not in (None, kind):
            raise PlanError(
                f"{self.document.path} is for a {self.document.kind}, and the vehicle is a {kind}; choose "
                "another vehicle (`model`, `connect`), or plan it for this one"
            )
        if wings and not self.document.lands and options.then is None:
            raise PlanError(
                f"{self.document.path} does not land; add a landing, or say what comes after it: `then=land` "
                "(along the runway, at home) or `then=return` (by its parameters an aircraft may circle over "
                "home then; PX4 asks for a landing in the plan, unless MIS_TKO_LAND_REQ is 0 or 1)"
            )
        if options.time_limit_s is None and route_of(self.document, self._plan_home).endless:
            raise PlanError(
                f"{self.document.path} jumps back for ever; say when it ends with `time_limit_s` SECONDS"
            )

    def check_place(self, options: FileOptions, limits: Limits, home: GeodeticPosition) -> None:
        check_distance(route_of(self.document, home), self.document.path, home)
        self.document.check_heights(home.alt_m, below_home_allowed=options.allow_below_home)

    def flight(self, vehicles: Sequence[Vehicle], options: Sequence[FileOptions]) -> FileFlight:
        return FileFlight(self.document, vehicles, options)

    async def remarks(self, vehicle: Vehicle, options: FileOptions) -> Sequence[str]:
        if options.then is Then.LAND or (self.document.lands and not self.document.returns):
            return ()
        reason = await vehicle.return_end.stays_because()
        if not reason:
            return ()
        # its advice is of no use for a plan that the vehicle would not fly
        items = placed(self.document.items, vehicle.home, vehicle.firmware.unset)
        await vehicle.plans.refuse_infeasible(items, self.document.fence)
        return (
            f"the flight ends in the air: after its return it {vehicle.return_end.stay} over home "
            f"({reason}); `then=land` lands it",
        )

    async def plan_items(self, vehicle: Vehicle, options: FileOptions) -> Sequence[MissionItem]:
        return self.document.items

    async def outline(self, vehicle: Vehicle, options: FileOptions) -> Outline:
        route = route_of(self.document, vehicle.home)
        return Outline(
            points_ned_m=tuple(stop.position_ned_m for stop in route.stops),
            duration_s=options.time_limit_s
            if route.endless
            else route.duration_s(own_speed_m_s(self.document, vehicle.kind)),
            plan_home=None if self.document.home is None else self.document.home.place,
            fence=self.document.fence,
        )

    @property
    def _plan_home(self) -> GeodeticPosition:
        home = self.document.home or PlannedHome(lat_deg=0.0, lon_deg=0.0, alt_m=None)
        return home.place


def _home_text(document: MissionDocument) -> str | None:
    """The file's home for an embedded world, with the heading to the mission's first place. An altitude that
    the file does not know is empty.
    """
    home = document.home
    if home is None:
        return None
    altitude = "" if home.alt_m is None else f"{home.alt_m:.3f}"
    place = f"{home.lat_deg:.9f},{home.lon_deg:.9f},{altitude}"
    for stop in route_of(document, home.place).stops:
        north, east, _ = stop.position_ned_m
        if math.hypot(north, east) > 5.0:
            heading_deg = math.degrees(math.atan2(east, north)) % 360.0
            return f"{place},{heading_deg:.3f}"
    return place
