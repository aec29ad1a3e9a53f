"""The missions of this package, and users' own missions."""

import importlib
import importlib.util
import inspect
import traceback
from collections.abc import Iterator, Mapping
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any, Final

from autopilot_bridge.errors import BridgeError
from flightsim.foundation.plug_ins import plug_ins
from missions.base.mission import Mission
from missions.base.options import FlightOptions
from missions.base.report import Report
from missions.catalogue import GROUP, NAMES, OTHERS, PATTERNS
from missions.errors import MissionError, PlanError
from missions.pattern_search import curves
from missions.pattern_search.for_vehicle import flight_for_vehicle
from missions.pattern_search.mission import PatternMission
from missions.plan_files.mission import FileMission
from missions.plan_files.suffixes import SUFFIXES as MISSION_FILES
from missions.vehicle.limits import Limits
from missions.vehicle.vehicle import Vehicle


class _NamedMissions(Mapping[str, Mission[Any]]):
    """The missions by name; only those that are used are imported."""

    def __getitem__(self, name: str) -> Mission[Any]:
        if name in PATTERNS:
            entry = PATTERNS[name]
            return PatternMission(name, getattr(curves, entry.curve), getattr(curves, entry.size))
        module, kind = OTHERS[name]
        made: Mission[Any] = getattr(importlib.import_module(module), kind)()
        return made

    def __iter__(self) -> Iterator[str]:
        return iter(NAMES)

    def __len__(self) -> int:
        return len(NAMES)


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
    """A mission by name, of this package or of a user's, a user's own by path (anything ending in .py), or a
    mission file.

    Raises:
        PlanError: the mission does not exist; the message lists the known ones.
    """
    if name.endswith(".py"):
        return ScriptMission(Path(name))
    if Path(name).suffix.lower() in MISSION_FILES:
        return FileMission(Path(name))
    if name in NAMES:
        return MISSIONS[name]
    others = plug_ins(GROUP)
    if name not in others:
        raise PlanError(
            f"mission {name!r} is not known; there are {', '.join((*NAMES, *others))}, "
            f"or the path of a file: Python (.py), or a mission file ({', '.join(MISSION_FILES)})"
        )
    return _of_package(others[name])


def _of_package(point: EntryPoint) -> Mission[Any]:
    """A mission that a user's package names.

    Raises:
        PlanError: it can't be made, or is none.
    """
    try:
        made = point.load()()
    except PlanError:
        raise
    except Exception as error:
        text = f"{type(error).__name__}: {error}"
        raise PlanError(f"mission {point.name!r} of {point.value} can't be loaded: {text}") from error
    if not isinstance(made, Mission):
        raise PlanError(f"mission {point.name!r} of {point.value} makes no `missions.Mission`")
    return made
