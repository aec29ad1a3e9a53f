"""A run: the folder with the log, the summary and the picture. Existing files are never overwritten."""

import json
import math
import platform
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import metadata
from pathlib import Path
from typing import Any, Final

from missions.errors import PlanError
from missions.flown.score import FlightScore
from missions.vehicle.notes import FlightNotes

EPOCH_UNIX_US: Final = 1_735_689_600_000_000
"""2025-01-01T00:00:00Z: time 0 of embedded flights in the log, so that equal flights give equal logs."""

LOG_NAME: Final = "flight.tlog"
SUMMARY_NAME: Final = "summary.json"
PICTURE_NAME: Final = "track.png"
RUNS: Final = Path("runs")
_PACKAGES: Final = ("flightstack", "jsbsim", "numpy", "numba", "pymavlink")


def create_run_folder(out: Path | None, mission: str, runs: Path = RUNS) -> Path:
    """Create the folder of a new run.

    Args:
        out: the requested folder; it must not exist, or must be empty. None: `runs/<mission>-<n>` with the
            next free number.
        mission: name of the mission.
        runs: folder of the numbered runs.

    Raises:
        PlanError: the folder is not empty, or can't be created.
    """
    try:
        if out is not None:
            out.mkdir(parents=True, exist_ok=True)
            if any(out.iterdir()):
                raise PlanError(f"{out} is not empty, and nothing is overwritten; choose another `out`")
            return out
        runs.mkdir(parents=True, exist_ok=True)
        number = 1
        while True:
            try:
                folder = runs / f"{mission}-{number}"
                folder.mkdir()
                return folder
            except FileExistsError:
                number += 1
    except OSError as error:
        raise PlanError(
            f"can't make the run folder {out or runs}: {error.strerror}; choose another `out`"
        ) from error


def versions() -> dict[str, str]:
    """Versions of the software that affects a flight."""
    found = {"python": platform.python_version()}
    for package in _PACKAGES:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed"
    if found["flightstack"] == "not installed":
        found["flightstack"] = _checkout_version() or found["flightstack"]
    return found


def _checkout_version() -> str | None:
    """The version in `pyproject.toml`, when the program runs from a checkout."""
    try:
        text = (Path(__file__).resolve().parents[1] / "pyproject.toml").read_text(encoding="utf-8")
        project = tomllib.loads(text)["project"]
    except (OSError, KeyError, tomllib.TOMLDecodeError):
        return None
    return str(project["version"]) if project.get("name") == "flightstack" else None


def _rounded(value: float | None, digits: int = 4) -> float | None:
    return None if value is None or not math.isfinite(value) else round(value, digits)


WITHIN: Final = "within the acceptance radius"
POOR: Final = "poor"


def tracking(notes: FlightNotes, score: FlightScore) -> str | None:
    """How a commanded path was followed: everywhere within the acceptance radius, or not; None: not measured.

    A waypoint counts as reached within the acceptance radius, so the user accepts this error. A vehicle that
    was farther off the path has not flown it, even if it continued to the end.
    """
    if notes.commanded is None or score.path_max_error_m is None:
        return None
    return WITHIN if score.path_max_error_m <= notes.commanded.acceptance_m else POOR


def vehicle_summary(notes: FlightNotes, score: FlightScore) -> dict[str, Any]:
    """The figures of one vehicle's flight."""
    block: dict[str, Any] = {
        "system_id": notes.system_id,
        "autopilot": notes.autopilot,
        "distance_m": _rounded(score.distance_m, 2),
        "error_reference": score.reference,
        "path_rms_error_m": _rounded(score.path_rms_error_m),
        "path_max_error_m": _rounded(score.path_max_error_m),
        "altitude_rms_error_m": _rounded(score.altitude_rms_error_m),
        "path_rms_error_absolute_m": _rounded(score.path_rms_error_absolute_m),
        "path_rms_error_estimate_m": _rounded(score.path_rms_error_estimate_m),
        "max_attitude_error_deg": _rounded(score.max_attitude_error_deg),
        "max_attitude_tracking_error_deg": _rounded(score.max_attitude_tracking_error_deg),
        "acceptance_m": None if notes.commanded is None else round(notes.commanded.acceptance_m, 3),
        "tracking": tracking(notes, score),
        "left": None if notes.left is None else notes.left.record(),
        "link_losses": [
            {"start_s": loss.start_us / 1e6, "end_s": None if loss.end_us is None else loss.end_us / 1e6}
            for loss in notes.link_losses
        ],
        "warnings": list(notes.warnings),
        "not_received_s": round(sum(end - begin for begin, end in score.gaps_s), 3),
        "gaps": [{"start_s": round(begin, 3), "end_s": round(end, 3)} for begin, end in score.gaps_s],
        "left_out": dict(score.left_out),
        "progress": _rounded(notes.progress),
        "phases": [
            {"name": p.name, "start_s": p.start_us / 1e6, "end_s": p.end_us / 1e6} for p in notes.phases
        ],
    }
    if notes.commanded is not None:
        home = notes.commanded.origin
        block["home"] = {"lat_deg": home.lat_deg, "lon_deg": home.lon_deg, "alt_m": home.alt_m}
    if score.waypoint_misses_m and notes.commanded is not None:
        acceptance_m = notes.commanded.acceptance_m
        misses = [miss for miss in score.waypoint_misses_m if math.isfinite(miss)]
        block["waypoints"] = {
            "count": len(notes.commanded.waypoints_ned_m),
            "acceptance_m": round(acceptance_m, 3),
            "largest_miss_m": _rounded(max(misses, default=math.nan), 3),
            "passed": sum(miss <= acceptance_m for miss in misses),
            "not_received": len(score.waypoint_misses_m) - len(misses),
        }
    return block


def team_figures(blocks: list[dict[str, Any]]) -> dict[str, Any]:
    """Figures of the whole run: those of a single vehicle, or the sum or the worst value of a team."""

    def worst(key: str) -> float | None:
        known = [block[key] for block in blocks if block[key] is not None]
        return max(known) if known else None

    keys = ("path_rms_error_m", "path_max_error_m", "max_attitude_error_deg")
    return {
        "distance_m": round(sum(block["distance_m"] or 0.0 for block in blocks), 2),
        **{key: worst(key) for key in keys},
    }


def write_summary(folder: Path, summary: Mapping[str, Any]) -> Path:
    """Write `summary.json`; after an error no file remains. Numbers that are not finite become null."""
    text = json.dumps(finite(summary), indent=2, allow_nan=False) + "\n"
    path = folder / SUMMARY_NAME
    with whole(path), path.open("x", encoding="utf-8") as file:
        file.write(text)
    return path


def replace_summary(folder: Path, summary: Mapping[str, Any]) -> None:
    """Replace the summary of this run. If it can't be written, there is none."""
    path = folder / SUMMARY_NAME
    with suppress(OSError):
        path.unlink(missing_ok=True)
        write_summary(folder, summary)


@contextmanager
def whole(path: Path) -> Iterator[None]:
    """Context that removes an incomplete new file when writing fails, for example on a full disk."""
    try:
        yield
    except FileExistsError:  # another process has written it completely
        raise
    except OSError:
        path.unlink(missing_ok=True)
        raise


def finite(value: Any) -> Any:
    """A value for JSON: numbers that are not finite, also in mappings and sequences, become None."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: finite(entry) for key, entry in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [finite(entry) for entry in value]
    return value


def wind_words(wind: Mapping[str, Any]) -> str:
    """Text about the wind of an embedded flight, from the entry `wind` of `summary.json`."""
    speed_m_s, turbulence = wind["speed_m_s"], wind["turbulence"]
    steady = f"wind {speed_m_s:g} m/s from {wind['from_deg']:g} degrees" if speed_m_s else "no steady wind"
    if speed_m_s and wind["profile"] != "uniform":
        steady += f" at 10 m, {wind['profile']} profile"
    if turbulence == "none":
        return steady if speed_m_s else "still air"
    return f"{steady}, {turbulence} turbulence"
