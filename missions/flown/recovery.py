"""Summary and picture of a flight whose program has ended without them, from the log that is left.

What the mission knew (its options, the commanded path, what it found) is not in the log: the result has what
the vehicles reported, and the truth where the log has it.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from numpy.typing import NDArray

from autopilot_bridge.clock import unix_time_us
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import metres
from estimators.logs import open_log, report_of
from missions.errors import MissionError, PlanError
from missions.flown.records import FlightRecords
from missions.flown.run_folder import (
    LOG_NAME,
    PICTURE_NAME,
    SUMMARY_NAME,
    create_run_folder,
    team_figures,
    vehicle_summary,
    versions,
    whole,
    write_summary,
)
from missions.flown.score import FlightScore, score
from missions.kind import KIND_OF_TYPE
from missions.vehicle.firmware_records import FIRMWARE_NAMES, FIRMWARES
from missions.vehicle.notes import FlightNotes, Phase

__all__ = ["Recovery", "recover"]

_QUIET_S: Final = 5.0  # a log that was written to within this time may be that of a run in progress
_FLIGHT: Final = "flight"


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery:
    """What was made from a log.

    Attributes:
        folder: the folder of the files.
        written: their names.
        summary: contents of `summary.json`.
    """

    folder: Path
    written: tuple[str, ...]
    summary: Mapping[str, Any]


def recover(path: Path, out: Path | None = None, *, picture: bool = True) -> Recovery:
    """Complete a run folder, or make a folder with the results of a telemetry log. Nothing is overwritten.

    Args:
        path: a run folder without summary or picture, or a telemetry log.
        out: folder for the results of a log; None: `runs/<name of the log>-<n>`.
        picture: whether to draw `track.png`.

    Raises:
        PlanError: the path or `out` can't be used.
        MissionError: the log has no flight, its run is still going, or a file can't be written.
        BridgeError: the log can't be read.
    """
    log = path / LOG_NAME if path.is_dir() else path
    if path.is_dir() and out is not None:
        raise PlanError(f"`out` is for the results of a log; {path} is a run folder, which is completed")
    if not log.is_file():
        raise PlanError(f"{log} does not exist; give a run folder or a telemetry log")
    names: tuple[str, ...] = (SUMMARY_NAME, PICTURE_NAME) if picture else (SUMMARY_NAME,)
    if path.is_dir() and not (names := tuple(name for name in names if not (path / name).exists())):
        raise MissionError(f"{path} has its summary and picture, and nothing is overwritten")
    if path.is_dir() and (age_s := unix_time_us() * 1e-6 - log.stat().st_mtime) < _QUIET_S:
        raise MissionError(
            f"{log} was written to {max(0.0, age_s):.0f} s ago: its run may be going on; try again in some "
            "seconds"
        )
    flights, summary = _flights(log)
    folder = path if path.is_dir() else create_run_folder(out, path.stem)
    try:
        if SUMMARY_NAME in names:
            write_summary(folder, summary)
        if PICTURE_NAME in names:
            from missions.flown.picture import draw_run

            with whole(folder / PICTURE_NAME):
                draw_run(folder / PICTURE_NAME, _title(summary), flights)
    except OSError as error:
        raise MissionError(
            f"can't write all of {folder}: {error.strerror or error}; check the disk"
        ) from error
    return Recovery(folder=folder, written=names, summary=summary)


def _flights(log: Path) -> tuple[list[tuple[FlightNotes, FlightScore]], dict[str, Any]]:
    """The vehicles of a log with their scores, and the summary.

    Raises:
        MissionError: no vehicle in it reported where it was.
    """
    opened = open_log(log)
    if opened.format != "tlog":
        raise PlanError(f"{log} is a log of format {opened.format}; accepted: telemetry logs (.tlog)")
    report = report_of(opened)
    records = FlightRecords.from_tlog(log)
    flights, blocks, states = [], [], []
    for vehicle in report.vehicles:
        notes = _notes(records, vehicle.system_id)
        if notes is None:
            continue
        own = score(records, notes)
        flights.append((notes, own))
        states.append(_last_state(records, notes))
        blocks.append(vehicle_summary(notes, own) | {"firmware": vehicle.firmware, "last_state": states[-1]})
    if not flights:
        raise MissionError(
            f"{log} has no vehicle with PX4 or ArduPilot that reports its position; nothing was written"
        )
    ends = "; ".join(
        f"vehicle {notes.system_id}: {text}" for (notes, _), text in zip(flights, states, strict=True)
    )
    sim_time_s = max((phase.end_us - phase.start_us) * 1e-6 for notes, _ in flights for phase in notes.phases)
    summary = {
        "mission": None,
        "vehicle": None,
        "autopilot": flights[0][0].autopilot,
        "outcome": "interrupted",
        "reason": f"made from the log: its program ended without a summary; the log ends with {ends}",
        "sim_time_s": round(sim_time_s, 6),
        **team_figures(blocks),
        "vehicles": blocks,
        "message_counts": records.message_counts,
        "versions": versions(),
        "log": str(log),
    }
    return flights, summary


def _notes(records: FlightRecords, system_id: int) -> FlightNotes | None:
    """What the log says of a vehicle; None: missions don't fly it, or its position was not received."""
    heartbeats = records.table("HEARTBEAT", system_id, 1)
    positions = records.table("GLOBAL_POSITION_INT", system_id, 1)
    if not len(heartbeats) or not len(positions):
        return None
    name = FIRMWARE_NAMES.get(int(heartbeats["autopilot"][-1]))
    kind = KIND_OF_TYPE.get(int(heartbeats["type"][-1]))
    if name is None or kind is None:
        return None
    notes = FlightNotes(system_id=system_id, autopilot=name, kind=str(kind))
    times_ms = positions["time_boot_ms"]
    start_us, end_us = int(times_ms.min()) * 1000, int(times_ms.max()) * 1000
    notes.phases.append(Phase(name=_FLIGHT, start_us=start_us, end_us=end_us))
    return notes


def _last_state(records: FlightRecords, notes: FlightNotes) -> str:
    """Mode, height and arming at the end of the log."""
    heartbeat: NDArray[Any] = records.table("HEARTBEAT", notes.system_id, 1)[-1]
    position: NDArray[Any] = records.table("GLOBAL_POSITION_INT", notes.system_id, 1)[-1]
    kind = KIND_OF_TYPE[int(heartbeat["type"])]
    mode = FIRMWARES[notes.autopilot, kind].mode_name(int(heartbeat["custom_mode"]))
    armed = int(heartbeat["base_mode"]) & dialect.MAV_MODE_FLAG_SAFETY_ARMED
    height_m = metres(float(position["relative_alt"]))
    return f"mode {mode}, {height_m:.1f} m above home, {'armed' if armed else 'disarmed'}"


def _title(summary: Mapping[str, Any]) -> str:
    figures = f"{summary['distance_m']:.0f} m in {summary['sim_time_s']:.0f} s (interrupted)"
    return f"from the log, {summary['autopilot']}\n{figures}"
