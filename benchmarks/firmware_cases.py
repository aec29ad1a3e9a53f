"""The missions that are flown on real firmware, and the files that two of them are flown from.

Sizes are as small as the simulators' vehicles can turn in, so that the whole set can be flown in real time.
The emulated aircraft is larger and faster: it flies patterns as large as its own turns need.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_plan import MissionItem
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.plan_files.wpl import format_wpl
from missions.vehicle.wing import Approach

PLAN: Final = "PLAN"
SCRIPT: Final = "SCRIPT"
HOMES: Final[Mapping[str, GeodeticPosition]] = MappingProxyType(
    {
        "px4": GeodeticPosition(lat_deg=47.397742, lon_deg=8.545594, alt_m=489.4),
        "ardupilot": GeodeticPosition(lat_deg=-35.363262, lon_deg=149.165237, alt_m=584.0),
    }
)
"""Where the simulators of both firmwares stand."""
EMULATED_MODELS: Final = {"copter": "iris", "plane": "aerosonde"}
_HEIGHTS_M: Final = {"copter": 15.0, "plane": 80.0}
_SIDES_M: Final = {"copter": 30.0, "plane": 500.0}
_SPEEDS_M_S: Final[Mapping[tuple[str, str], tuple[float, float]]] = MappingProxyType(
    {
        ("px4", "copter"): (4.0, 3.0),
        ("ardupilot", "copter"): (4.0, 3.0),
        ("px4", "plane"): (15.0, 14.0),
        ("ardupilot", "plane"): (22.0, 20.0),
    }
)
_SCRIPTS: Final = {
    "copter": """
import math

from missions.vehicle import Setpoint


async def fly(vehicle, options):
    await vehicle.wait_ready()
    await vehicle.takeoff(10.0)
    await vehicle.goto_ned(10.0, 0.0, -10.0)
    await vehicle.follow(
        lambda t: Setpoint(position_ned_m=(10.0 * math.cos(0.3 * t), 10.0 * math.sin(0.3 * t), -10.0))
        if t < 20.0
        else None,
        rate_hz=25.0,
    )
    await vehicle.return_to_launch()
""",
    "plane": """
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame


async def fly(vehicle, options):
    await vehicle.wait_ready()
    vehicle.wing.note_runway()
    await vehicle.takeoff(80.0)
    frame = LocalFrame(vehicle.home)
    lat, lon, alt = frame.geodetic_from_ned(250.0, 250.0, -90.0)
    place = GeodeticPosition(lat_deg=lat, lon_deg=lon, alt_m=alt)
    await vehicle.wing.loiter(place, radius_m=120.0, clockwise=False)
    await vehicle.clock.sleep(40.0)
    await vehicle.wing.land_along()
""",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One mission.

    Attributes:
        arguments: of `flightstack fly`.
        sizes: what else it is given on a vehicle of a firmware, by (firmware, vehicle).
        vehicles: that fly it.
        refused: neither firmware's simulator has what it needs (camera, survey magnetometer), so a refusal
            before the takeoff is what is expected.
    """

    arguments: tuple[str, ...]
    sizes: Mapping[tuple[str, str], tuple[str, ...]] = field(default_factory=lambda: MappingProxyType({}))
    vehicles: tuple[str, ...] = ("copter", "plane")
    refused: bool = False

    def arguments_on(self, firmware: str, vehicle: str, folder: Path) -> list[str]:
        """Its arguments on a vehicle; makes the files they name."""
        made = {PLAN: plan_file, SCRIPT: script_file}
        texts = (*self.arguments, *self.sizes.get((firmware, vehicle), ()))
        return [str(made[text](firmware, vehicle, folder)) if text in made else text for text in texts]

    def emulated_arguments(self, firmware: str, vehicle: str, folder: Path) -> list[str]:
        """Its arguments on the emulated vehicle of the same firmware and class."""
        sizes = self.sizes if vehicle == "copter" else {}
        case = Case(arguments=self.arguments, sizes=sizes)
        model = ["--autopilot", firmware, "--model", EMULATED_MODELS[vehicle]]
        return [*case.arguments_on(firmware, vehicle, folder), *model]


def _sizes(copter: str, px4_plane: str, arduplane: str) -> Mapping[tuple[str, str], tuple[str, ...]]:
    return MappingProxyType(
        {
            ("px4", "copter"): tuple(copter.split()),
            ("ardupilot", "copter"): tuple(copter.split()),
            ("px4", "plane"): tuple(px4_plane.split()),
            ("ardupilot", "plane"): tuple(arduplane.split()),
        }
    )


_WAYPOINTS: Final = ("--via", "waypoints")
_SETPOINTS: Final = ("--via", "setpoints")
_SECTOR: Final = _sizes("--size 40", "--size 400", "--size 800")
_SWEEP: Final = _sizes("--size 40", "--size 360", "--size 720")
_SQUARE: Final = _sizes("--size 40", "--size 360", "--size 720")
_PLANE: Final = ("plane",)
CASES: Final[Mapping[str, Case]] = MappingProxyType(
    {
        "lissajous": Case(
            arguments=("lissajous", *_WAYPOINTS),
            # bends of L2 that ArduPlane's path guidance follows make a pattern of 1.7 km
            sizes=_sizes("--pattern L2 --size 40", "--pattern L2 --size 800", "--pattern L1 --size 400"),
        ),
        "lissajous-setpoints": Case(
            arguments=("lissajous", *_SETPOINTS),
            sizes=_sizes("--pattern L2 --size 40", "--pattern L2 --size 800", "--pattern L2 --size 1000"),
        ),
        "sector": Case(arguments=("sector", *_WAYPOINTS), sizes=_SECTOR),
        "sector-setpoints": Case(arguments=("sector", *_SETPOINTS), sizes=_SECTOR, vehicles=_PLANE),
        "parallel-sweep": Case(arguments=("parallel-sweep", *_WAYPOINTS), sizes=_SWEEP),
        "parallel-sweep-setpoints": Case(
            arguments=("parallel-sweep", *_SETPOINTS), sizes=_SWEEP, vehicles=_PLANE
        ),
        "expanding-square": Case(arguments=("expanding-square", *_WAYPOINTS), sizes=_SQUARE),
        "expanding-square-setpoints": Case(
            arguments=("expanding-square", *_SETPOINTS), sizes=_SQUARE, vehicles=_PLANE
        ),
        "plan-file": Case(arguments=(PLAN,)),
        "script": Case(arguments=(SCRIPT,)),
        "orbit": Case(arguments=("orbit", "--target", "200,100", "--duration", "60"), refused=True),
        "occupancy": Case(arguments=("occupancy", "--size", "800"), refused=True),
    }
)


def script_file(_firmware: str, vehicle: str, folder: Path) -> Path:
    """A user's own mission."""
    file = folder / "script.py"
    file.write_text(_SCRIPTS[vehicle], encoding="utf-8")
    return file


def plan_file(firmware: str, vehicle: str, folder: Path) -> Path:
    """A square with changes of speed between its waypoints (QGC WPL 110), around the firmware's own home."""
    home, side_m, height_m = HOMES[firmware], _SIDES_M[vehicle], _HEIGHTS_M[vehicle]
    frame, relative = LocalFrame(home), dialect.MAV_FRAME_GLOBAL_RELATIVE_ALT
    fast_m_s, slow_m_s = _SPEEDS_M_S[firmware, vehicle]

    def place(north_m: float, east_m: float) -> MissionItem:
        lat, lon, _ = frame.geodetic_from_ned(north_m, east_m, 0.0)
        return MissionItem(command=dialect.MAV_CMD_NAV_WAYPOINT, frame=relative, x=lat, y=lon, z=height_m)

    def speed(speed_m_s: float) -> MissionItem:
        return MissionItem(
            command=dialect.MAV_CMD_DO_CHANGE_SPEED,
            frame=dialect.MAV_FRAME_MISSION,  # PX4 refuses it in a frame of places
            param1=1.0 if vehicle == "copter" else 0.0,
            param2=speed_m_s,
            param3=-1.0,
        )

    takeoff = MissionItem(
        command=dialect.MAV_CMD_NAV_TAKEOFF,
        frame=relative,
        param1=12.0 if vehicle == "plane" else 0.0,
        x=home.lat_deg,
        y=home.lon_deg,
        z=height_m,
    )
    items = [
        *(takeoff, speed(fast_m_s), place(side_m, 0.0), speed(slow_m_s), place(side_m, side_m)),
        *(place(0.0, side_m), speed(fast_m_s), place(0.0, 0.0)),
    ]
    if vehicle == "plane":
        items += Approach(place=home, heading_rad=0.0).items()
    else:
        items.append(
            MissionItem(command=dialect.MAV_CMD_NAV_RETURN_TO_LAUNCH, frame=dialect.MAV_FRAME_MISSION)
        )
    file = folder / "square.waypoints"
    file.write_text(format_wpl(items, home), encoding="utf-8")
    return file
