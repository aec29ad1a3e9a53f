"""In a flight no mission and no estimator can reach the world's description or its truth.

The test walks the objects of our packages that a mission, its vehicle, options and notes refer to, and
those that the estimators of the flight refer to. Links, clocks and the event loop are the border: their
public interfaces lead to bytes and times only (the import arrows of tests/test_architecture.py hold on
both sides).
"""

import functools
import gc
import types
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from autopilot_bridge.sitl import Sitl
from estimators.interface import Estimator
from flightsim.payload import GroundTargetParameters, Static
from flightsim.world_spec import FaultSpec, FaultUnit, WorldSpec
from missions.base.mission import Mission
from missions.base.options import FlightOptions
from missions.embedded.sitl import EmbeddedSitl
from missions.occupancy.mission import OccupancyMission
from missions.occupancy.options import OccupancyOptions
from missions.occupancy.world import occupancy_world
from missions.orbit.mission import OrbitMission
from missions.orbit.options import OrbitOptions
from missions.orbit.world import orbit_world
from missions.runs.session import RunRequest, fly
from missions.worlds.payloads import CAMERA, carrying

OURS = ("flightsim", "autopilot_bridge", "estimators", "missions", "tests")
BORDER = ("autopilot_bridge.links", "autopilot_bridge.clock")
MISSIONS = ("handoff", "multi_target", "occupancy", "orbit", "pattern_search", "survey", "vision_search")
HIDDEN = (
    *(
        "flightsim",
        "autopilot_bridge.sitl",
        "autopilot_bridge.autopilot",
        "missions.embedded",
        "missions.worlds",
    ),
    *(f"missions.{name}.world" for name in MISSIONS),
)
CONTAINERS = (dict, list, tuple, set, frozenset, deque, types.MappingProxyType)


def is_in(kind: type, packages: Iterable[str]) -> bool:
    return any(f"{kind.__module__}.".startswith(f"{package}.") for package in packages)


def instances(*classes: type) -> list[Any]:
    """All objects of these classes. There are millions of objects, of few types: types are compared."""
    items = gc.get_objects()
    kinds = {kind for kind in set(map(type, items)) if issubclass(kind, classes)}
    return [item for item in items if type(item) in kinds]


def neighbours(item: Any) -> Iterable[Any]:
    """What code that has an object can get from it, without modules and frames."""
    if isinstance(item, types.MethodType):
        return (item.__self__, item.__func__)
    if isinstance(item, types.FunctionType):
        cells = [cell.cell_contents for cell in item.__closure__ or () if cell != types.CellType()]
        return (*cells, *(item.__defaults__ or ()), *(item.__kwdefaults__ or {}).values())
    if isinstance(item, functools.partial):
        return (item.func, *item.args, *item.keywords.values())
    if isinstance(item, CONTAINERS) or is_in(type(item), OURS):
        return gc.get_referents(item)
    return ()


def reachable(*roots: Any) -> list[Any]:
    found: dict[int, Any] = {}
    waiting = list(roots)
    while waiting:
        item = waiting.pop()
        if id(item) in found or isinstance(item, type | types.ModuleType):
            continue
        found[id(item)] = item
        if not is_in(type(item), BORDER):
            waiting.extend(neighbours(item))
    return list(found.values())


def hidden(items: Iterable[Any], truths: Iterable[np.ndarray] = ()) -> set[str]:
    """Names of types among the objects that belong to the world, and "truth" for its arrays."""
    names = {
        type(item).__qualname__
        for item in items
        if is_in(type(item), HIDDEN) and not is_in(type(item), ("flightsim.foundation",))
    }
    arrays = [item for item in items if isinstance(item, np.ndarray)]
    shared = any(np.shares_memory(array, truth) for array in arrays for truth in truths)
    return names | ({"truth"} if shared else set())


class Spy(Mission[Any]):
    """Walks what it can reach in the air, and what the estimators of the flight can."""

    name = "spy"
    kinds = Mission.kinds

    def __init__(self) -> None:
        self.seen: list[set[str]] = []
        self.walked: list[int] = []
        self.estimators = 0
        gc.collect()
        # those of other tests in this process, which something may still refer to
        self.earlier = {id(item) for item in instances(Estimator, Sitl)}

    async def fly(self, vehicle: Any, options: Any) -> None:
        await vehicle.takeoff(10.0)
        await vehicle.clock.sleep(2.0)
        (sitl,) = (item for item in instances(Sitl) if id(item) not in self.earlier)
        truths = [simulated.vehicle.truth for simulated in sitl.vehicles]
        gc.collect()  # instances that were made to read their needs
        running = [item for item in instances(Estimator) if id(item) not in self.earlier]
        self.estimators = len(running)
        for roots in ((self, vehicle, options, vehicle.notes), running):
            items = reachable(*roots)
            self.walked.append(len(items))
            self.seen.append(hidden(items, truths))
        await vehicle.land()


@pytest.mark.parametrize("autopilot", ["px4", pytest.param("ardupilot", marks=pytest.mark.slow)])
def test_a_flight_keeps_its_world_from_mission_and_estimator(autopilot: str, tmp_path: Any) -> None:
    world = occupancy_world(
        WorldSpec.of_team(
            autopilot=autopilot,
            targets=(GroundTargetParameters(motion=Static(north_m=5.0, east_m=0.0)),),
            faults=(FaultSpec(unit=FaultUnit.MAG, start_s=1000.0),),
        ),
        OccupancyOptions(),
    )
    spy = Spy()
    request = RunRequest(
        options=FlightOptions(),
        world=carrying(world, CAMERA),
        out=tmp_path / "run",
        picture=False,
        estimator="attitude",
    )
    result = fly(spy, request)
    assert result.outcome == "completed", result.reason
    assert spy.seen == [set(), set()]
    assert spy.walked[0] > 200
    assert spy.estimators == 1


@dataclass
class Leak:
    kept: Any


def test_the_walk_finds_what_is_hidden_in_attributes_containers_and_closures() -> None:
    world = WorldSpec()
    truth = np.zeros(3)
    assert hidden(reachable(Leak({"a": [world]}))) >= {"WorldSpec", "VehicleSpec"}
    assert "WorldSpec" in hidden(reachable(Leak(lambda: world)))
    assert "WorldSpec" in hidden(reachable(Leak(functools.partial(print, world))))
    assert hidden(reachable(Leak(truth[1:])), [truth]) == {"truth"}
    assert hidden(reachable(Leak(np.zeros(3))), [truth]) == set()
    sitl = EmbeddedSitl(world)
    assert {"EmbeddedSitl", "Sitl", "WorldSpec"} <= hidden(reachable(sitl), ())
    sitl.close()
    sitl.loop.close()


@pytest.mark.parametrize(
    ("mission", "options", "world_of"),
    [
        (OrbitMission(), OrbitOptions(), orbit_world),
        (OccupancyMission(), OccupancyOptions(), occupancy_world),
    ],
)
def test_missions_and_options_do_not_change_when_their_world_is_made(
    mission: Any, options: Any, world_of: Any
) -> None:
    """The true target is drawn or placed in the world only: neither mission nor options keep it."""
    before = vars(mission).copy()
    world_of(WorldSpec(seed=5), options)
    assert vars(mission) == before
    assert hidden(reachable(mission, options)) == set()
