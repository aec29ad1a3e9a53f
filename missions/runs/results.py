"""What a run has given: its outcome, its summary and its picture."""

from collections.abc import Mapping
from dataclasses import asdict, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from missions.base.mission import Mission
from missions.base.report import Debriefing, Report
from missions.base.request import RunRequest
from missions.flown.records import FlightRecords
from missions.flown.run_folder import team_figures, versions, wind_words
from missions.flown.score import score
from missions.runs.flight import Flight
from missions.runs.vehicle_opening import Stage

COMPLETED: Final = "completed"
FAILED: Final = "failed"
INTERRUPTED: Final = "interrupted"


def debrief(
    request: RunRequest, records: FlightRecords, flight: Flight, stage: Stage, *, completed: bool
) -> Debriefing:
    """What a mission's report is made of, after the flight.

    Args:
        completed: the mission came to its end.
    """
    notes = [vehicle.notes for vehicle in flight.vehicles if vehicle.notes.system_id]
    targets_ne_m = None if request.world is None else request.world.magnetic_targets_ne_m
    return Debriefing(
        records=records,
        flights=[(n, score(records, n)) for n in notes],
        options=request.options if flight.mission is None else flight.mission.options[0],
        completed=completed,
        max_error_m=request.max_error_m,
        target_ne_m=targets_ne_m[0] if targets_ne_m else None,
        targets_ne_m=targets_ne_m,
        pictures_of=stage.pictures_of,
    )


def draw(path: Path, text: str, report: Report, debriefing: Debriefing) -> None:
    """Draw `track.png`."""
    if report.draw is not None:
        report.draw(path, text)
        return
    from missions.flown.picture import draw_run  # Matplotlib

    draw_run(path, text, list(debriefing.flights), report.overlay)


def time_stamp_faults(flight: Flight) -> list[str]:
    """What was wrong with the time stamps that a flight is judged by, one text for each vehicle."""
    faults = ((v.notes.system_id, v.link.time_stamp_faults()) for v in flight.vehicles)
    return [
        f"{text} (system {system_id}), and the flight is judged by them" for system_id, text in faults if text
    ]


def missed_check(request: RunRequest, blocks: list[dict[str, Any]]) -> str:
    """The check that a completed flight has failed, as text; "" if none."""
    most_m = request.max_error_m
    for block in blocks:
        error_m = block["path_max_error_m"]
        if most_m is None:
            break
        if error_m is None:
            return f"vehicle {block['system_id']} flew no path whose error `max_error_m` could limit"
        if error_m > most_m:
            return (
                f"the path error of vehicle {block['system_id']} was {error_m:.2f} m at most, more than "
                f"`max_error_m` {most_m:g} m"
            )
    return ""


def summary_of(
    mission: Mission[Any],
    request: RunRequest,
    debriefing: Debriefing,
    report: Report,
    blocks: list[dict[str, Any]],
    outcome: str,
    reason: str,
    sim_time_s: float,
    wall_time: float,
) -> dict[str, Any]:
    """The content of `summary.json`.

    Args:
        blocks: those of the vehicles.
        outcome, reason: as in `RunResult`.
        sim_time_s, wall_time: how long the run took, s.
    """
    notes = [n for n, _ in debriefing.flights]
    options = {
        key: str(value) if isinstance(value, StrEnum) else value
        for key, value in asdict(replace(debriefing.options, arguments={}, centre=None, given=None)).items()
        if value is not None
    }
    left_out_names = list(
        dict.fromkeys((*request.left_out_parameters, *(p for n in notes for p in n.left_out_parameters)))
    )
    world = None if request.connect else request.embedded_world
    vehicles = () if world is None else world.vehicles
    summary: dict[str, Any] = {
        "mission": mission.name,
        "vehicle": "remote"
        if world is None
        else ",".join(dict.fromkeys(str(spec.model) for spec in vehicles)),
        "autopilot": notes[0].autopilot if notes else vehicles[0].autopilot if vehicles else None,
        "firmware": None if request.firmware is None or world is None else str(request.firmware),
        "seed": None if world is None else world.seed,
        "outcome": outcome,
        "reason": reason,
        "sim_time_s": round(sim_time_s, 6),
        "wall_time_s": round(wall_time, 3),
        "speedup": round(sim_time_s / max(wall_time, 1e-9), 2),
        **team_figures(blocks),
        "vehicles": blocks,
        "message_counts": debriefing.records.message_counts,
        "versions": versions(),
        "options": options | {"arguments": dict(request.options.arguments)},
        "parameters": {n: value for n, value in request.parameters.items() if n not in left_out_names},
        "parameters_left_out": left_out_names,
        "connect": list(request.connect),
        "command": request.command,
    }
    summary["planned_wind_m_s"] = request.planning_wind_m_s
    if world is not None:
        summary["wind"] = {
            "speed_m_s": world.air.wind_speed_m_s,
            "from_deg": world.air.wind_from_deg,
            "profile": world.air.profile.law.value,
            "turbulence": world.air.turbulence.value,
        }
        summary["gps"] = ",".join(dict.fromkeys(spec.gps for spec in vehicles))
    return summary | {name: value for name, value in report.figures.items() if name not in summary}


def title(mission: Mission[Any], report: Report, summary: Mapping[str, Any]) -> str:
    """Title of the picture of a run: mission, result, and wind if known."""
    parts = [report.title or mission.name, summary["autopilot"]]
    rms = summary["path_rms_error_m"]
    figures = f"{summary['distance_m']:.0f} m in {summary['sim_time_s']:.0f} s"
    if rms is not None:
        figures += f", path error {rms:.2f} m RMS, {summary['path_max_error_m']:.2f} m at most"
    if summary["outcome"] != COMPLETED:
        figures += f" ({summary['outcome']})"
    lines = [", ".join(parts), figures]
    if "wind" in summary:
        lines.append(wind_words(summary["wind"]))
    return "\n".join(lines)
