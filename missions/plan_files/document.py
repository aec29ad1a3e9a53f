"""A mission file as data, independent of its format."""

from dataclasses import dataclass
from pathlib import Path
from typing import Final

from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.vehicle.heights import refuse_low_items
from missions.vehicle.items import item_name

NAV_WAYPOINT: Final = 16
NAV_LOITER_UNLIM: Final = 17
NAV_LOITER_TURNS: Final = 18
NAV_LOITER_TIME: Final = 19
NAV_RETURN_TO_LAUNCH: Final = 20
NAV_LAND: Final = 21
NAV_TAKEOFF: Final = 22
NAV_LOITER_TO_ALT: Final = 31
NAV_SPLINE_WAYPOINT: Final = 82
NAV_DELAY: Final = 93
DO_JUMP: Final = 177
DO_CHANGE_SPEED: Final = 178
DO_LAND_START: Final = 189

INT_FRAMES: Final = {0: 5, 3: 6, 10: 11}
"""Global frames in files -> the same frames with integer coordinates, as in items."""
PLAIN_FRAMES: Final = {whole: plain for plain, whole in INT_FRAMES.items()}

LOITERS: Final = frozenset({NAV_LOITER_UNLIM, NAV_LOITER_TURNS, NAV_LOITER_TIME, NAV_LOITER_TO_ALT})


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedHome:
    """Home of a mission file.

    Attributes:
        lat_deg, lon_deg: its place.
        alt_m: altitude above mean sea level; None: the file does not know it.
    """

    lat_deg: float
    lon_deg: float
    alt_m: float | None

    @classmethod
    def of(cls, place: GeodeticPosition) -> "PlannedHome":
        """A home whose altitude is known."""
        return cls(lat_deg=place.lat_deg, lon_deg=place.lon_deg, alt_m=place.alt_m)

    @property
    def place(self) -> GeodeticPosition:
        """The place, at mean sea level where the altitude is not known."""
        return GeodeticPosition(lat_deg=self.lat_deg, lon_deg=self.lon_deg, alt_m=self.alt_m or 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionDocument:
    """The contents of a mission file.

    Attributes:
        path: path of the file.
        items: the mission, without a home item; DO_JUMP names its target by the index in this tuple.
        fence, rally: items of the geofence and of the rally points.
        home: planned home; None: not in the file.
        zero_is_here: items of every command at latitude and longitude 0 stay at the place before them, as
            ArduPilot has it; otherwise only takeoffs, landings and circles do.
        kind: class of vehicle that the plan is for; None: not in the file.
        firmware: "px4" or "ardupilot"; None: not in the file, or any firmware.
        cruise_speed_m_s, hover_speed_m_s: speeds that the planner assumed in fixed-wing and in hovering
            flight.
    """

    path: Path
    items: tuple[MissionItem, ...]
    fence: tuple[MissionItem, ...] = ()
    rally: tuple[MissionItem, ...] = ()
    home: PlannedHome | None = None
    zero_is_here: bool = False
    kind: VehicleKind | None = None
    firmware: str | None = None
    cruise_speed_m_s: float | None = None
    hover_speed_m_s: float | None = None

    def item_name(self, index: int) -> str:
        """Name of an item with the number that ground stations use: "item 3 (NAV_WAYPOINT)"."""
        return item_name(index, self.items[index].command)

    def refuse(self, index: int, why: str) -> PlanError:
        """An error that names an item."""
        return PlanError(f"{self.path}: {self.item_name(index)}: {why}")

    def check_heights(self, home_alt_m: float | None, *, below_home_allowed: bool) -> None:
        """Refuse items and rally points below home, unless that is allowed, and those below the ground.

        Args:
            home_alt_m: altitude of home above mean sea level; None: not known, and only heights in other
                frames are checked.
            below_home_allowed: the user allows heights below home.

        Raises:
            PlanError: names the file, the items and their altitudes.
        """
        try:
            refuse_low_items(self.items, home_alt_m, below_home_allowed=below_home_allowed)
            refuse_low_items(
                self.rally,
                home_alt_m,
                below_home_allowed=below_home_allowed,
                name=lambda index, _command: f"rally point {index + 1}",
            )
        except PlanError as error:
            raise PlanError(f"{self.path}: {error}") from None

    @property
    def returns(self) -> bool:
        """Whether the mission ends with a return, and not with a landing."""
        commands = [item.command for item in self.items]
        return NAV_RETURN_TO_LAUNCH in commands and NAV_LAND not in commands

    @property
    def lands(self) -> bool:
        """Whether the mission itself ends the flight: by a landing, or by a return."""
        commands = [item.command for item in self.items]
        return NAV_LAND in commands or NAV_RETURN_TO_LAUNCH in commands
