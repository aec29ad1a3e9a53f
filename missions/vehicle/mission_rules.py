"""The rules by which a vehicle's firmware would refuse to fly a mission, applied before its upload.

PX4 acknowledges a mission that it then refuses to fly, and names the reason by an event that few clients
decode; ArduPilot refuses to arm, or to enter AUTO. The rules are those of
`autopilot_bridge.mission_feasibility`, with the vehicle's own parameters.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from autopilot_bridge.fence_shapes import UnwrappedPolygon, fence_shapes, outside_shapes
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mission_feasibility import ardupilot, px4
from autopilot_bridge.mission_plan import MissionItem
from autopilot_bridge.mission_wire import GLOBAL_FRAMES
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.vehicle.link import VehicleLink
from missions.vehicle.parameters import VehicleParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class _Situation:
    """What the rules judge.

    Attributes:
        items: the mission, without ArduPilot's home.
        fence: geofence that is uploaded with it; empty: the vehicle keeps its own.
        home: home of the vehicle.
        landed: it stands on the ground.
    """

    items: Sequence[MissionItem]
    fence: Sequence[MissionItem]
    home: GeodeticPosition
    landed: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rules:
    """The rules of one firmware for one class of vehicle.

    Attributes:
        parameters: parameters that they depend on, with the values that count where there is none.
        problems: why the vehicle would not fly the mission, in its own words.
    """

    parameters: Mapping[str, float]
    problems: Callable[[_Situation, Mapping[str, float]], tuple[str, ...]]


_FENCE_PARAMETERS: Final = MappingProxyType({"GF_MAX_HOR_DIST": 0.0, "GF_MAX_VER_DIST": 0.0})  # 0: no limit


_ACROSS: Final = (
    "a polygon of the geofence lies across 180 degrees of longitude, where PX4 takes the other way round the "
    "earth; divide it there into two polygons"
)


def _px4(kind: VehicleKind) -> _Rules:
    wings = kind is VehicleKind.FIXED_WING
    own = {name: value for name, value in px4.PARAMETERS.items() if wings or name != "FW_LND_ANG"}

    def problems(situation: _Situation, parameters: Mapping[str, float]) -> tuple[str, ...]:
        shapes = fence_shapes(situation.fence, LocalFrame(situation.home), unwrapped=True)
        apart = (_ACROSS,) if any(isinstance(shape, UnwrappedPolygon) for shape in shapes) else ()
        return apart or px4.mission_problems(
            situation.items,
            px4.Px4MissionRules.of({**px4.PARAMETERS, **parameters}, fixed_wing=wings),
            home_alt_m=situation.home.alt_m,
            landed=situation.landed,
            outside=_outside(situation, parameters),
        )

    return _Rules(parameters=MappingProxyType({**own, **_FENCE_PARAMETERS}), problems=problems)


def _outside(situation: _Situation, parameters: Mapping[str, float]) -> Callable[[MissionItem], bool]:
    """Whether an item lies outside the geofence that is uploaded, or outside the limits around home."""
    home, frame = situation.home, LocalFrame(situation.home)
    shapes = fence_shapes(situation.fence, frame, unwrapped=True)
    reach_m, height_limit_m = (parameters[name] or math.inf for name in _FENCE_PARAMETERS)

    def outside(item: MissionItem) -> bool:
        north_m, east_m, _ = frame.ned_from_geodetic(item.x, item.y, home.alt_m)
        height_m = item.z - home.alt_m if item.frame in GLOBAL_FRAMES else item.z
        beyond = math.hypot(north_m, east_m) >= reach_m or height_m >= height_limit_m
        return beyond or outside_shapes(shapes, (north_m, east_m), join=True)

    return outside


_RULES: Final[Mapping[tuple[str, VehicleKind], _Rules]] = MappingProxyType(
    {
        ("px4", VehicleKind.MULTICOPTER): _px4(VehicleKind.MULTICOPTER),
        ("px4", VehicleKind.FIXED_WING): _px4(VehicleKind.FIXED_WING),
        ("ardupilot", VehicleKind.MULTICOPTER): _Rules(
            parameters=ardupilot.COPTER_PARAMETERS,
            problems=lambda situation, parameters: ardupilot.copter_problems(
                situation.items, parameters, landed=situation.landed
            ),
        ),
        ("ardupilot", VehicleKind.FIXED_WING): _Rules(
            parameters=ardupilot.PLANE_PARAMETERS,
            problems=lambda situation, parameters: ardupilot.plane_problems(situation.items, parameters),
        ),
    }
)


async def refuse_infeasible(
    link: VehicleLink,
    parameters: VehicleParameters,
    items: Sequence[MissionItem],
    fence: Sequence[MissionItem] = (),
) -> None:
    """Refuse a mission that the vehicle would store and then not fly.

    Args:
        link, parameters: of the vehicle, whose home is known.
        items: the mission as it is sent, without ArduPilot's home.
        fence: geofence that is uploaded with it.

    Raises:
        PlanError: gives the firmware's reasons and the parameters that they depend on.
    """
    rules = _RULES[link.firmware.name, link.kind]
    on_ground = link.landed_state == dialect.MAV_LANDED_STATE_ON_GROUND
    situation = _Situation(items=items, fence=fence, home=link.home, landed=on_ground or not link.armed)
    values = {name: await parameters.read_or(name, usual) for name, usual in rules.parameters.items()}
    problems = rules.problems(situation, values)
    if problems:
        shown = ", ".join(f"{name} {value:g}" for name, value in values.items())
        raise PlanError(
            f"the vehicle ({link.firmware.name}, {link.kind}) would not fly this mission: "
            f"{'; '.join(problems)} (it has {shown}); nothing was uploaded. Change the plan, or the "
            "parameter that requires it"
        )
