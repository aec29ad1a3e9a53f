"""Reading and writing mission files by their suffix."""

from pathlib import Path

from autopilot_bridge.mission_plan import MissionItem
from estimators.errors import LogError
from estimators.logs.new_file import new_file
from flightsim.foundation.geodesy import GeodeticPosition
from missions.errors import PlanError
from missions.kind import VehicleKind
from missions.plan_files import qgc_plan, wpl
from missions.plan_files.document import MissionDocument
from missions.plan_files.suffixes import PLAN, SUFFIXES
from missions.plan_files.validation import validated


def read_mission_file(path: Path) -> MissionDocument:
    """Read a mission file that some vehicle can fly.

    Raises:
        PlanError: names the file, the item, the value and what is accepted.
    """
    if path.suffix.lower() == PLAN:
        return validated(qgc_plan.read_plan(path))
    return validated(wpl.read_wpl(path))


def check_suffix(path: Path) -> None:
    """Refuse a name with the wrong suffix, of an existing file, or in a folder that does not exist."""
    if path.suffix.lower() not in SUFFIXES:
        raise PlanError(f"mission file {path}: suffix {path.suffix!r}; accepted: {', '.join(SUFFIXES)}")
    if path.exists():
        raise PlanError(f"{path} is there already, and nothing is overwritten; choose another name")
    if not path.parent.is_dir():
        raise PlanError(f"mission file {path}: there is no folder {path.parent}")


def write_mission_file(
    path: Path,
    items: tuple[MissionItem, ...],
    home: GeodeticPosition,
    *,
    firmware: str,
    kind: VehicleKind,
    speed_m_s: float,
) -> None:
    """Write a mission in the format of the suffix. After an error no file remains.

    Raises:
        PlanError: the suffix is unknown, or the file exists or can't be written.
    """
    # imported only for writing, because the modules of logs are slow to load

    check_suffix(path)
    if path.suffix.lower() == PLAN:
        text = qgc_plan.format_plan(items, home, firmware=firmware, kind=kind, speed_m_s=speed_m_s)
    else:
        text = wpl.format_wpl(items, home)
    try:
        with new_file(path) as part:
            part.write_text(text, encoding="utf-8")
    except LogError as error:
        raise PlanError(f"mission file: {error}") from error
