"""The data of a run that has ended, from its folder: tables, tracks, estimates, pictures."""

import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from estimators.errors import EstimatorError
from estimators.flown_track import flown_tracks
from estimators.html_table import html_table
from estimators.library import estimator_class, parameters_from
from estimators.log_replay import replay
from estimators.logs import Log, open_log
from estimators.logs.arrow import arrow_of_columns, arrow_table
from estimators.references import AUTOPILOT, TRUTH
from missions.errors import PlanError
from missions.flown.run_folder import LOG_NAME, SUMMARY_NAME

if TYPE_CHECKING:
    import pyarrow as pa

__all__ = ["Pictures", "Run", "open_run"]

_HEADLINES: Final = (
    "mission",
    "vehicle",
    "autopilot",
    "seed",
    "sim_time_s",
    "distance_m",
    "path_rms_error_m",
)


@dataclass(frozen=True, kw_only=True)
class Run:
    """A run that has ended, and its folder. Tables are Arrow tables: `to_pandas()` makes a data frame.

    Attributes:
        outcome: "completed", "failed" or "interrupted".
        reason: why it failed; "" otherwise.
        folder: the run folder.
        summary: contents of `summary.json`.
    """

    outcome: str
    reason: str
    folder: Path
    summary: Mapping[str, Any]

    @cached_property
    def log(self) -> Log:
        """Its log.

        Raises:
            LogError: there is none, or it can't be read.
        """
        return open_log(self.folder / LOG_NAME)

    def table(
        self, name: str, *, system_id: int | None = None, component_id: int | None = None, si: bool = True
    ) -> "pa.Table":
        """Messages of one component with their vehicle time `time_us`.

        Args:
            name: "ATTITUDE".
            system_id, component_id: ids of the sender; None is sufficient if only one component sent it.
            si: SI units and radians, else the units of the wire. The metadata of each field has its unit.

        Raises:
            LogError: the log has no such message, or several components sent it.
        """
        return arrow_table(self.log.table(name, system_id=system_id, component_id=component_id), si=si)

    def track(self, system_id: int | None = None, *, truth: bool = False) -> "pa.Table":
        """Where the vehicles were: `system_id`, `boot`, `time_s`, `lat_deg`, `lon_deg`, `alt_m`, `north_m`,
        `east_m` and `height_m` from the first vehicle's home, `roll_deg`, `pitch_deg`, `yaw_deg`.

        Args:
            system_id: the only vehicle; None: all.
            truth: the simulator's truth in place of what the autopilots reported.

        Raises:
            NothingThere: the log has no such positions.
        """
        tracks = flown_tracks(self.log, system_id, source=TRUTH if truth else AUTOPILOT)
        made = []
        for track in tracks:
            ned_m = track.pos_ned_m(tracks[0].home)
            columns = {
                "system_id": np.full(len(ned_m), track.system_id),
                "boot": np.full(len(ned_m), track.boot),
                "time_s": track.time_us * 1e-6,
                "lat_deg": track.lat_deg, "lon_deg": track.lon_deg, "alt_m": track.alt_m,
                "north_m": ned_m[:, 0], "east_m": ned_m[:, 1], "height_m": -ned_m[:, 2],
                "roll_deg": np.degrees(track.roll_rad), "pitch_deg": np.degrees(track.pitch_rad),
                "yaw_deg": np.degrees(track.yaw_rad),
            }  # fmt: skip
            made.append(columns)
        return arrow_of_columns(made)

    def estimates(self, estimator: str, settings: Sequence[str] = (), *, kind: str = "") -> "pa.Table":
        """What an estimator makes of the run's log: vehicle time `time_us`, `boot`, `subject` (system id; 0
        for a target) and its columns, whose names have their units.

        Args:
            estimator: its name, or the path of a user's file.
            settings: its parameters as NAME=VALUE; none: those with which it flew, if it did.
            kind: class of the estimates; "": the estimator makes one kind only.

        Raises:
            EstimatorError: there is no such estimator, parameter or kind, or the log lacks what it needs.
        """
        found = estimator_class(estimator)
        flown = self.summary.get("estimator") or {}
        if not settings and flown.get("estimator") == found.NAME:
            settings = flown.get("settings", ())
        parameters = parameters_from(found, settings)
        done = replay(self.log, lambda: found(parameters))
        tables = [t for runner in done.fleet.runners.values() for t in runner.tables.values() if len(t)]
        kinds = sorted({table.name for table in tables})
        if not tables:
            lacking = [text for texts in done.lacking.values() for text in texts]
            why = done.failure or "; ".join(lacking) or "it made no estimate"
            raise EstimatorError(f"no estimates of {estimator} from {self.log.path}: {why}")
        if len(kinds) > 1 and not kind:
            raise EstimatorError(
                f"{estimator} makes several kinds of estimates; give `kind`, {' or '.join(kinds)}"
            )
        chosen = [table for table in tables if kind in ("", table.name)]
        if not chosen:
            raise EstimatorError(f"{estimator} makes no {kind}; accepted: {', '.join(kinds)}")
        made = []
        for table in chosen:
            columns = {"time_us": table.time_us, "boot": table.boot, "subject": table.subject}
            if table.of_sets:
                columns["target_index"] = table.target_index
            made.append(columns | dict(zip(table.columns, table.values.T, strict=True)))
        return arrow_of_columns(made)

    def show(self) -> "Pictures":
        """The pictures of the run, which a notebook shows."""
        return Pictures(tuple(sorted(self.folder.glob("*.png"))))

    def _repr_html_(self) -> str:
        summary = self.summary
        rows = [("outcome", self.outcome), *([("reason", self.reason)] if self.reason else [])]
        rows += [(name, summary[name]) for name in _HEADLINES if summary.get(name) is not None]
        rows.append(("folder", str(self.folder)))
        return html_table(f"run {self.folder.name}", rows)


@dataclass(frozen=True, slots=True)
class Pictures:
    """Pictures that a notebook shows.

    Attributes:
        paths: their PNG files.
    """

    paths: tuple[Path, ...]

    def _repr_html_(self) -> str:
        return "".join(
            f'<img alt="{escape(path.name)}" style="max-width: 100%" '
            f'src="data:image/png;base64,{b64encode(path.read_bytes()).decode()}">'
            for path in self.paths
        )


def open_run(folder: Path | str) -> Run:
    """A run that was flown earlier.

    Args:
        folder: its folder, with `summary.json`.

    Raises:
        PlanError: it is no run folder.
    """
    path = Path(folder) / SUMMARY_NAME
    try:
        summary = json.loads(path.read_text(encoding="utf-8"))
        outcome, reason = str(summary["outcome"]), str(summary["reason"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise PlanError(
            f"{folder} is no folder of a run: {path.name} can't be read; give the folder that a flight has "
            "written, or complete it by `flightstack report`"
        ) from error
    return Run(outcome=outcome, reason=reason, folder=Path(folder), summary=summary)
