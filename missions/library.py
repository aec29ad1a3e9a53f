"""The missions of this package, and users' own missions."""

import importlib.util
import inspect
import traceback
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from autopilot_bridge.errors import BridgeError
from missions.base.mission import Mission
from missions.base.options import FlightOptions
from missions.base.report import Report
from missions.errors import MissionError, PlanError
from missions.pattern_search.curves import (
    expanding_square_curve,
    lissajous_curve,
    lissajous_size,
    parallel_sweep_curve,
    sector_curve,
    sector_size,
    square_size,
    sweep_size,
)
from missions.pattern_search.for_vehicle import flight_for_vehicle
from missions.pattern_search.mission import PatternMission
from missions.plan_files.mission import FileMission
from missions.plan_files.suffixes import SUFFIXES as MISSION_FILES
from missions.vehicle.limits import Limits
from missions.vehicle.vehicle import Vehicle


def _orbit() -> Mission[Any]:
    from missions.orbit.mission import OrbitMission

    return OrbitMission()


def _occupancy() -> Mission[Any]:
    from missions.occupancy.mission import OccupancyMission

    return OccupancyMission()


def _multi_target() -> Mission[Any]:
    from missions.multi_target.mission import MultiTargetMission

    return MultiTargetMission()


def _vision_search() -> Mission[Any]:
    from missions.vision_search.mission import VisionSearchMission

    return VisionSearchMission()


def _handoff() -> Mission[Any]:
    from missions.handoff.mission import HandoffMission

    return HandoffMission()


def _survey() -> Mission[Any]:
    from missions.survey.mission import SurveyMission

    return SurveyMission()


class _NamedMissions(Mapping[str, Mission[Any]]):
    """The missions by name; only those that are used are imported."""

    _MAKERS: Final[Mapping[str, Callable[[], Mission[Any]]]] = MappingProxyType(
        {
            "lissajous": lambda: PatternMission("lissajous", lissajous_curve, lissajous_size),
            "sector": lambda: PatternMission("sector", sector_curve, sector_size),
            "parallel-sweep": lambda: PatternMission("parallel-sweep", parallel_sweep_curve, sweep_size),
            "expanding-square": lambda: PatternMission(
                "expanding-square", expanding_square_curve, square_size
            ),
            "orbit": _orbit,
            "occupancy": _occupancy,
            "multi-target": _multi_target,
            "handoff": _handoff,
            "survey": _survey,
            "vision-search": _vision_search,
        }
    )

    def __init__(self) -> None:
        self._made: dict[str, Mission[Any]] = {}

    def __getitem__(self, name: str) -> Mission[Any]:
        if name not in self._made:
            self._made[name] = self._MAKERS[name]()
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._MAKERS)

    def __len__(self) -> int:
        return len(self._MAKERS)


MISSIONS: Final[Mapping[str, Mission[Any]]] = _NamedMissions()
"""The missions with a name on the command line."""


class ScriptMission(Mission[FlightOptions]):
    """A user's own mission: a Python file with `async def fly(vehicle, options)`.

    The file may have a class `Mission` instead, made without arguments, with `async def fly(self, vehicle,
    options)` and, optionally, `def check(self, options)`, which raises `PlanError`. Each vehicle of a team
    flies it; `options.index` is the number of the vehicle.

    Raises:
        PlanError: the file can't be read, or has neither.
    """

    def __init__(self, path: Path) -> None:
        self.name = path.stem
        module = _load(path)
        holder: Any = module
        if not hasattr(module, "fly") and inspect.isclass(getattr(module, "Mission", None)):
            holder = module.Mission()
        fly = getattr(holder, "fly", None)
        if not inspect.iscoroutinefunction(fly):
            raise PlanError(
                f"{path} has neither `async def fly(vehicle, options)` nor a class `Mission` with it; add one"
            )
        self._fly = fly
        self._file = str(path)
        self._resolved = path.resolve()
        self._check = getattr(holder, "check", None)

    def adapted(self, options: FlightOptions, limits: Limits) -> FlightOptions:
        return flight_for_vehicle(options, limits)

    def check(self, options: FlightOptions, limits: Limits) -> None:
        if self._check is not None:
            self._check(options)

    async def fly(self, vehicle: Vehicle, options: FlightOptions) -> Report | None:
        try:
            returned: Report | None = await self._fly(vehicle, options)
        except (MissionError, PlanError, BridgeError):
            raise
        except Exception as error:
            frames = traceback.extract_tb(error.__traceback__)
            line = next(
                (f.lineno for f in reversed(frames) if Path(f.filename).resolve() == self._resolved), "?"
            )
            raise MissionError(f"{self._file}, line {line}: {type(error).__name__}: {error}") from error
        return returned


def _load(path: Path) -> Any:
    if not path.is_file():
        raise PlanError(f"mission file {path} does not exist")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise PlanError(f"mission file {path} is not Python; its name must end in .py")
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise PlanError(f"mission file {path} can't be loaded: {type(error).__name__}: {error}") from error
    return module


def find_mission(name: str) -> Mission[Any]:
    """A mission by name, a user's own by path (anything ending in .py), or a mission file.

    Raises:
        PlanError: the mission does not exist; the message lists the known ones.
    """
    if name.endswith(".py"):
        return ScriptMission(Path(name))
    if Path(name).suffix.lower() in MISSION_FILES:
        return FileMission(Path(name))
    known = MISSIONS.get(name)
    if known is None:
        raise PlanError(
            f"mission {name!r} is not known; there are {', '.join(MISSIONS)}, "
            f"or the path of a file: Python (.py), or a mission file ({', '.join(MISSION_FILES)})"
        )
    return known
