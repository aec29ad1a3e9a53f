"""The checks of a vehicle before a mission is flown with it."""

import asyncio
import math
from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from autopilot_bridge.fence_shapes import FenceShape, fence_shapes, outside_shapes
from autopilot_bridge.mission_plan import MissionItem, MissionType
from flightsim.foundation.geodesy import LocalFrame
from flightsim.foundation.geodetic_position import NorthEast
from missions.errors import MissionError
from missions.kind import VehicleKind
from missions.planning.outline import Outline
from missions.preflight.endurance import PARAMETERS as ENDURANCE_PARAMETERS
from missions.preflight.endurance import Endurance, endurance_finding, reported_endurance
from missions.preflight.finding import Finding, Level, ok, problem, warning
from missions.preflight.health import health_findings, remote_control_received
from missions.preflight.lost_link import PARAMETERS, lost_link, lost_link_words
from missions.preflight.settings import (
    FENCE_PARAMETERS,
    RULES,
    areas_watched,
    fence,
    settings_findings,
    shapes_join,
)
from missions.preflight.snapshot import FILTER_STATUS, Snapshot, usual
from missions.vehicle.vehicle import Vehicle

FARTHEST_M: Final = 10_000.0
_FAR_M: Final = 1000.0
_PLAN_HOME_M: Final = 200.0
_REQUESTED: Final = ("SYS_STATUS", "GPS_RAW_INT", "BATTERY_STATUS", "RC_CHANNELS")
_SHOWN: Final = (
    *_REQUESTED,
    *(kind.msgname for kind in FILTER_STATUS.values()),
    "HEARTBEAT",
    "HOME_POSITION",
    "GLOBAL_POSITION_INT",
)
_LISTEN_S: Final = 1.5
_PARAMETERS_AT_ONCE: Final = 4

_STEP_M: Final = 5.0


def first_outside(
    shapes: tuple[FenceShape, ...], way: Iterable[NorthEast], *, join: bool
) -> NorthEast | None:
    """The first point of a path (straight between its points) that a fence forbids; None: the whole path is
    inside.

    Args:
        shapes: shapes of the fence, north and east of home.
        way: points of the path, north and east of home, m.
        join: whether being inside one of several inclusion shapes is enough.
    """
    last: NorthEast | None = None
    for point in way:
        start = point if last is None else last
        steps = 1 if last is None else max(1, math.ceil(math.dist(start, point) / _STEP_M))
        for k in range(1, steps + 1):
            f = k / steps
            here = (start[0] + f * (point[0] - start[0]), start[1] + f * (point[1] - start[1]))
            if outside_shapes(shapes, here, join=join):
                return here
        last = point
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """The findings about one vehicle."""

    system_id: int
    findings: tuple[Finding, ...]

    @property
    def problems(self) -> tuple[Finding, ...]:
        """The findings that prevent the flight."""
        return tuple(f for f in self.findings if f.level is Level.PROBLEM)


Confirm = Callable[[Sequence[Look]], Coroutine[Any, Any, bool]]
"""Receives the findings and returns whether to fly. It is a coroutine, so that the link is serviced
meanwhile.
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedFlight:
    """What is known of the mission that a vehicle is to fly.

    Attributes:
        mission: its name.
        kinds: kinds of vehicles that can fly it.
        autopilot: flavour that it was planned for; None: any.
        outline: its path and duration; None: not known.
    """

    mission: str
    kinds: Sequence[VehicleKind]
    autopilot: str | None
    outline: Outline | None


async def look(
    vehicle: Vehicle,
    planned_flight: PlannedFlight,
    simulation_proof: str = "",
    endurance: Endurance | None = None,
) -> Look:
    """Check a vehicle that is ready to arm, and the mission to be flown with it.

    Args:
        planned_flight: the mission.
        simulation_proof: what proves that the vehicle is a simulation; "": nothing.
        endurance: how long its battery lasts; None: as it reports.
    """
    snapshot, fence_items = await _snapshot(vehicle)
    outline = planned_flight.outline
    planned = () if outline is None else outline.fence
    own_fence = planned or tuple(fence_items)
    findings = [
        *_match(vehicle, planned_flight, simulation_proof),
        *health_findings(snapshot),
        fence(snapshot, len(planned)),
        *_way(vehicle, outline, own_fence, snapshot.parameters),
        endurance_finding(outline, endurance or reported_endurance(snapshot)),
        *settings_findings(snapshot),
        _lost_link(vehicle, snapshot),
    ]
    return Look(system_id=vehicle.system_id, findings=tuple(findings))


async def confirmed(looks: Sequence[Look], confirm: Confirm) -> None:
    """Ask for confirmation; heartbeats continue meanwhile.

    Raises:
        MissionError: the flight was not confirmed.
    """
    if await confirm(looks):
        return
    problems = [
        f"vehicle {found.system_id}: {f.subject}: {f.text}" for found in looks for f in found.problems
    ]
    raise MissionError("not flown: " + ("; ".join(problems) if problems else "not confirmed"))


async def _snapshot(vehicle: Vehicle) -> tuple[Snapshot, list[MissionItem]]:
    filter_status = FILTER_STATUS[vehicle.autopilot]
    for name in (*_REQUESTED, filter_status.msgname):
        if vehicle.link.message(name) is None:
            await vehicle.commands.set_message_rate(name, 2.0)
    reports: list[Mapping[str, Any]] = []  # reports of the navigation filter
    with vehicle.link.messages(filter_status) as stream:
        await vehicle.clock.sleep(_LISTEN_S)
        parameters = await _parameters(vehicle)
        try:
            fence_items = await vehicle.plans.download_plan(MissionType.FENCE)
        except MissionError:  # an autopilot without a fence
            fence_items = []
        while (status := stream.take()) is not None:
            reports.append(status.to_dict())
    messages: dict[str, Mapping[str, Any]] = {}
    for name in _SHOWN:
        message = vehicle.link.message(name)
        if message is not None:
            messages[name] = message.to_dict()
    if reports:
        messages[filter_status.msgname] = usual(reports)
    return Snapshot(
        flavour=vehicle.autopilot,
        kind=vehicle.kind,
        messages=messages,
        texts=tuple(text.text for text in vehicle.link.texts.newest),
        parameters=parameters,
        fence_items=len(fence_items),
    ), fence_items


async def _parameters(vehicle: Vehicle) -> dict[str, float]:
    """The parameters for the checks, as far as the vehicle has them; read in small groups, for slow lines."""
    names = dict.fromkeys(
        (
            *(r.name for r in RULES[vehicle.autopilot] if r.kind in (None, vehicle.kind)),
            *FENCE_PARAMETERS[vehicle.autopilot],
            *PARAMETERS[vehicle.autopilot, vehicle.kind],
            *ENDURANCE_PARAMETERS[vehicle.autopilot],
        )
    )
    gate = asyncio.Semaphore(_PARAMETERS_AT_ONCE)

    async def read(name: str) -> float | None:
        async with gate:
            value = await vehicle.parameters.read_or(name, math.nan)
        return None if math.isnan(value) else value

    values = await asyncio.gather(*(read(name) for name in names))
    return {name: value for name, value in zip(names, values, strict=True) if value is not None}


def _match(vehicle: Vehicle, flight: PlannedFlight, simulation_proof: str) -> list[Finding]:
    text = f"{vehicle.autopilot} {vehicle.kind}, system id {vehicle.system_id}, mode {vehicle.mode}; "
    text += f"simulated: {simulation_proof}" if simulation_proof else "nothing proves that it is simulated"
    findings = []
    if vehicle.kind not in flight.kinds:
        kinds = " or a ".join(flight.kinds)
        findings.append(
            problem("vehicle", f"{text}; {flight.mission} is for a {kinds}", "choose the right one")
        )
    if flight.autopilot not in (None, vehicle.autopilot):
        findings.append(
            warning(
                "vehicle", f"{text}; {flight.mission} was planned for {flight.autopilot}", "see that it fits"
            )
        )
    return findings or [ok("vehicle", text)]


def _way(
    vehicle: Vehicle, outline: Outline | None, items: Sequence[MissionItem], parameters: Mapping[str, float]
) -> list[Finding]:
    """Findings about the mission's path: near home, and inside the fence."""
    if outline is None or not outline.points_ned_m:
        return [warning("way", "the mission does not state where it flies", "check it yourself")]
    points = outline.points_ned_m
    farthest_m = max(math.hypot(n, e) for n, e, _ in points)
    highest_m = max(-d for _, _, d in points)
    text = f"up to {farthest_m:.0f} m from home and {highest_m:.0f} m above it"
    findings = []
    if farthest_m > FARTHEST_M:
        findings.append(problem("way", text, "it seems to be for another place"))
    elif farthest_m > _FAR_M:
        findings.append(warning("way", text, "see that the link reaches as far"))
    else:
        findings.append(ok("way", text))
    if outline.plan_home is not None:
        place = outline.plan_home
        north, east, _ = LocalFrame(vehicle.home).ned_from_geodetic(place.lat_deg, place.lon_deg, place.alt_m)
        away_m = math.hypot(north, east)
        if away_m > _PLAN_HOME_M:
            findings.append(
                warning(
                    "way", f"the plan's home is {away_m:.0f} m from the vehicle's", "see that it fits here"
                )
            )
    watched = areas_watched(vehicle.autopilot, parameters)
    unwrapped = vehicle.firmware.unwrapped_fences
    shapes = fence_shapes(items, LocalFrame(vehicle.home), unwrapped=unwrapped) if watched else ()
    join = shapes_join(vehicle.autopilot, parameters)
    outside = first_outside(shapes, [(n, e) for n, e, _ in points], join=join)
    if outside is not None:
        findings.append(
            problem(
                "way",
                f"leaves the geofence {outside[0]:.0f} m north and {outside[1]:.0f} m east of home",
                "change the plan or the fence",
            )
        )
    limits = (
        ("GF_MAX_HOR_DIST", farthest_m, bool(parameters.get("GF_MAX_HOR_DIST"))),
        ("GF_MAX_VER_DIST", highest_m, bool(parameters.get("GF_MAX_VER_DIST"))),
        ("FENCE_RADIUS", farthest_m, _fence_type(parameters, 2)),
        ("FENCE_ALT_MAX", highest_m, _fence_type(parameters, 1)),
    )
    for name, reach_m, counts in limits:
        if counts and reach_m > parameters.get(name, math.inf):
            findings.append(
                problem(
                    "way", f"{reach_m:.0f} m is beyond {name} {parameters[name]:g} m", "change one of them"
                )
            )
    return findings


def _fence_type(parameters: Mapping[str, float], bit: int) -> bool:
    return bool(parameters.get("FENCE_ENABLE")) and bool(int(parameters.get("FENCE_TYPE", 0.0)) & bit)


def _lost_link(vehicle: Vehicle, snapshot: Snapshot) -> Finding:
    words = lost_link_words(vehicle.autopilot, vehicle.kind, snapshot.parameters)
    vehicle.notes.lost_link = "; ".join(words)
    received = remote_control_received(snapshot)
    return lost_link(words, vehicle.autopilot, snapshot.parameters, received=received)
