"""Flights of missions on real firmware as rows, and the table of them."""

import itertools
import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from benchmarks.firmware_cases import CASES

EMULATED: Final = 0.0
"""In a row's place of the speed: flown on the emulated autopilot."""
FLIGHTS: Final = 2
_LEAST_FLOWN_M: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Session:
    """One mission on one vehicle: flown twice on a firmware, or once on the emulated autopilot."""

    firmware: str
    vehicle: str
    speed: float
    mission: str

    @property
    def flights(self) -> int:
        """How often the mission is flown."""
        return 1 if self.speed == EMULATED else FLIGHTS

    @property
    def name(self) -> str:
        """For folders and people."""
        speed = "emulated" if self.speed == EMULATED else f"x{self.speed:g}"
        return f"{self.firmware}-{self.vehicle}-{speed}-{self.mission}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One flight; figures as the run's summary.json has them.

    Attributes:
        outcome: of the summary; "refused": it failed before the takeoff; "no run": there is no summary;
            "timeout": it had to be ended.
        well: it ended as expected.
    """

    firmware: str
    vehicle: str
    speed: float
    mission: str
    flight: int
    outcome: str
    exit_code: int | None
    well: bool
    path_rms_m: float | None = None
    path_max_m: float | None = None
    waypoints_passed: int | None = None
    waypoints: int | None = None
    sim_time_s: float | None = None
    wall_s: float = 0.0
    reason: str = ""
    folder: str = ""

    @property
    def key(self) -> tuple[str, str, float, str, int]:
        """What was flown."""
        return self.firmware, self.vehicle, self.speed, self.mission, self.flight


def sessions(
    vehicles: Iterable[tuple[str, str]], speeds: Iterable[float], missions: Iterable[str]
) -> list[Session]:
    """What to fly, at real time first; the long flights of planes first, so that jobs end together.

    Args:
        vehicles: (firmware, vehicle).
        speeds: times real time; `EMULATED` for the emulated autopilot.
        missions: names of cases.
    """
    found = [
        Session(firmware=firmware, vehicle=vehicle, speed=speed, mission=mission)
        for speed, mission, (firmware, vehicle) in itertools.product(speeds, missions, vehicles)
        if vehicle in CASES[mission].vehicles and not (speed == EMULATED and CASES[mission].refused)
    ]
    return sorted(found, key=lambda s: (s.speed or math.inf, s.vehicle == "copter", CASES[s.mission].refused))


def row_of(
    session: Session, flight: int, folder: Path, exit_code: int | None, said: str, wall_s: float
) -> Row:
    """The row of a flight that has ended.

    Args:
        folder: of the run.
        exit_code: of `flightstack fly`; None: it had to be ended.
        said: its output: the reason where there is no summary.
    """
    file = folder / "summary.json"
    summary: Mapping[str, Any] = json.loads(file.read_text(encoding="utf-8")) if file.exists() else {}
    block: Mapping[str, Any] = (summary.get("vehicles") or [{}])[0]
    passes: Mapping[str, Any] = block.get("waypoints") or {}
    flown = (summary.get("distance_m") or 0.0) >= _LEAST_FLOWN_M
    outcome = str(summary.get("outcome") or "no run")
    reason = str(summary.get("reason") or "") or ("" if exit_code == 0 else said.strip()[-300:])
    if exit_code is None:
        outcome = "timeout"
    elif exit_code != 0 and not flown and reason:
        outcome = "refused"
    well = outcome == "refused" if CASES[session.mission].refused else exit_code == 0
    return Row(
        **asdict(session),
        flight=flight,
        outcome=outcome,
        exit_code=exit_code,
        well=well,
        path_rms_m=summary.get("path_rms_error_m"),
        path_max_m=summary.get("path_max_error_m"),
        waypoints_passed=passes.get("passed"),
        waypoints=passes.get("count"),
        sim_time_s=summary.get("sim_time_s"),
        wall_s=round(wall_s, 1),
        reason=reason,
        folder=str(folder),
    )


def rows_in(file: Path) -> dict[tuple[str, str, float, str, int], Row]:
    """The newest row of each flight; a line that was cut off by an interruption is left out."""
    found = {}
    for line in file.read_text(encoding="utf-8").splitlines() if file.exists() else ():
        try:
            row = Row(**json.loads(line))
        except (json.JSONDecodeError, TypeError):
            continue
        found[row.key] = row
    return found


def table(rows: Mapping[tuple[str, str, float, str, int], Row]) -> str:
    """The rows as a table: a line for each session, beside the emulated flight."""
    lines = [
        "| firmware | vehicle | speed | mission | flight 1 | flight 2 | emulated |",
        "|---|---|---|---|---|---|---|",
    ]
    order = list(CASES)
    shown = sorted({row.key[:4] for row in rows.values()}, key=lambda k: (k[:3], order.index(k[3])))
    for firmware, vehicle, speed, mission in shown:
        flown = (firmware, vehicle, EMULATED, mission, 1) in rows
        if speed == EMULATED and any(
            k[:2] == (firmware, vehicle) and k[3] == mission and k[2] for k in shown
        ):
            continue
        flights = [rows.get((firmware, vehicle, speed, mission, flight)) for flight in (1, 2)]
        if speed == EMULATED:
            flights = [None, None]
        emulated = rows[firmware, vehicle, EMULATED, mission, 1] if flown else None
        cells = [cell(row) for row in (*flights, emulated)]
        at = "-" if speed == EMULATED else f"{speed:g}"
        lines.append(f"| {firmware} | {vehicle} | {at} | {mission} | {' | '.join(cells)} |")
    bad = [row for row in rows.values() if not row.well]
    lines += ["", f"{len(rows)} flights, {len(bad)} not as expected."]
    for row in bad:
        name = Session(firmware=row.firmware, vehicle=row.vehicle, speed=row.speed, mission=row.mission).name
        lines.append(f"- {name}, flight {row.flight}: {row.outcome}: {' '.join(row.reason.split())[:300]}")
    return "\n".join(lines) + "\n"


def cell(row: Row | None) -> str:
    """One flight in the table."""
    if row is None:
        return ""
    parts = [row.outcome if row.well else f"**{row.outcome}**"]
    parts.append(f"exit {'-' if row.exit_code is None else row.exit_code}")
    if row.path_rms_m is not None and row.path_max_m is not None:
        parts.append(f"{row.path_rms_m:.2f} / {row.path_max_m:.2f} m")
    if row.waypoints is not None:
        parts.append(f"{row.waypoints_passed} of {row.waypoints}")
    return ", ".join(parts)
