"""Running a study from beginning to end: its folder, an engine, and the rows as they come."""

import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any, Final

import numpy as np

from autopilot_bridge.clock.pacing import wall_time_s
from estimators.html_table import html_table
from missions.errors import MissionError, PlanError
from missions.process.ending import signal_of
from missions.studies.engine import Engine, Progress
from missions.studies.folder import SUMMARY, RowWriter, StudyFolder
from missions.studies.inline import Inline
from missions.studies.job import Job
from missions.studies.options import KeepLogs
from missions.studies.page import REPORT, study_page
from missions.studies.picture import draw_study
from missions.studies.results import Results
from missions.studies.study import Study, Trial, Trials
from missions.studies.summary import study_table, summary_of
from missions.studies.trial_runner import Scratch, parameters_of, succeeded

__all__ = ["StudyResult", "read_results", "run_study", "run_trial"]

TABLE: Final = "table.txt"


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyResult:
    """A study after it has ended.

    Attributes:
        results: its rows, or those that it has.
        summary: contents of `summary.json`.
        table: lines of `table.txt`.
        folder: its folder, a path or URI.
        outcome: "completed", "interrupted" or "failed".
        reason: why it is not complete.
        signal: the signal that interrupted it; 0: none.
    """

    results: Results
    summary: Mapping[str, Any]
    table: Sequence[str]
    folder: str
    outcome: str
    reason: str = ""
    signal: int = 0

    def _repr_html_(self) -> str:
        """The table of its figures, for notebooks."""
        title = f"study {self.results.name}: {self.outcome}{': ' if self.reason else ''}{self.reason}"
        rows = [("folder", self.folder), ("trials", self.results.table.num_rows)]
        text = escape("\n".join(self.table))
        return f"{html_table(title, rows)}<pre>{text}</pre>"


def run_trial(
    study: Study[Any, Any], index: int, *, runs: int | None = None, seed: int = 0
) -> dict[str, Any]:
    """Run one trial of a study in this process.

    Args:
        study: the study.
        index: number of the trial, as in column `trial`.
        runs, seed: those of the study that it is from.

    Returns:
        its parameters and its row by name.

    Raises:
        IndexError: there is no such trial.
        Exception: the trial's own error.
    """
    trials = Trials(study, study.runs if runs is None else runs, seed)
    trial = trials[index]
    with Scratch():
        values = study.schema.values(study.trial(parameters_of(study, trial), trial.seed))
    return {
        "trial": trial.index, "run": trial.run, "seed": trial.seed, **trial.values,
        **dict(zip(study.schema.kinds, values, strict=True)),
    }  # fmt: skip


def run_study(
    study: Study[Any, Any],
    *,
    runs: int | None = None,
    seed: int = 0,
    engine: Engine | None = None,
    out: Path | str | None = None,
    resume: Path | str | None = None,
    keep_logs: KeepLogs | str = KeepLogs.NONE,
    time_limit_s: float | None = None,
    picture: bool = True,
    command: str = "",
    repeat: Callable[[Trial], str] | None = None,
    arguments: Mapping[str, Any] | None = None,
    on_progress: Callable[[Progress], object] = lambda _progress: None,
) -> StudyResult:
    """Run a study, or what is missing of one. Its rows are the same for every engine.

    Ctrl-C ends it with the rows that it has. Everything that it has computed is kept in its folder after an
    interruption, an error and a kill, and `resume` continues there.

    Args:
        study: the study.
        runs: number of runs per cell; None: the study's default, or that of the resumed study.
        seed: seed of the study.
        engine: where trials are run; None: in this process.
        out: folder, a path or the URI of a file system of `pyarrow.fs`; None: the next `runs/<study>-<n>`.
        resume: folder of a study that is to be continued, in place of `out`.
        keep_logs: which trials' files are kept: "none", "failed" or "all".
        time_limit_s: wall time after which a trial is terminated.
        picture: whether to draw pictures.
        command: the command line, for the summary.
        repeat: the command that repeats a trial by itself; None: `run_trial`, unless the study has a command.
        arguments: what the command line needs to build the study again, for `study.json`.
        on_progress: called with the progress, several times a second.

    Raises:
        PlanError: a value is not accepted, the folder can't be used, or it is another study's.
        MissionError: the engine can't start. The folder keeps what was there before.
    """
    engine = Inline() if engine is None else engine
    if time_limit_s is not None and not time_limit_s > 0.0:
        raise PlanError(f"`time_limit_s` {time_limit_s:g} is not possible; give more than 0 s")
    keep = KeepLogs(keep_logs)
    resumed = None if resume is None else StudyFolder.opened(resume)
    if resumed is not None and out is not None:
        raise PlanError("`out` and `resume` are given; leave one of them out")
    before = None if resumed is None else resumed.identity()
    if runs is None:
        runs = study.runs if before is None else int(before["runs"])
    trials = Trials(study, runs, seed)
    job = Job(trials=trials, keep_logs=keep, time_limit_s=time_limit_s)
    if before is not None:
        _require_same(before, trials, str(resume))
    folder = StudyFolder.created(out, study.name) if resumed is None else resumed
    with folder:
        if before is None:
            try:
                folder.write_identity(identity_of(trials, command, arguments))
            except MissionError:
                folder.give_back()
                raise
        session = _Session(trials, job, engine, folder, command=command, repeat=repeat, picture=picture)
        return session.run(on_progress)


class _Session:
    """One execution of a study, from the first missing trial to the summary."""

    def __init__(
        self,
        trials: Trials,
        job: Job,
        engine: Engine,
        folder: StudyFolder,
        *,
        command: str,
        repeat: Callable[[Trial], str] | None,
        picture: bool,
    ) -> None:
        self._study, self._trials, self._job, self._engine = trials.study, trials, job, engine
        self._folder, self._command, self._repeat, self._picture = folder, command, repeat, picture
        self._started_s = wall_time_s()
        found = folder.tables()
        self._had: set[int] = set() if found is None else set(found[0]["trial"].to_pylist())
        self._failed = 0
        if found is not None:
            earlier = read_results(folder)
            self._failed = len(self._had) - int(np.count_nonzero(earlier.succeeded))
        self._done = 0

    def run(self, on_progress: Callable[[Progress], object]) -> StudyResult:
        """Compute what is missing, and write the summary."""
        missing = [index for index in range(len(self._trials)) if index not in self._had]
        outcome, reason, by_signal = "completed", "", 0
        if missing:
            try:
                self._compute(missing, on_progress)
            except KeyboardInterrupt as interrupt:
                outcome = reason = "interrupted"
                by_signal = signal_of(interrupt)
            except MissionError as error:
                outcome, reason = "failed", str(error)
                if self._folder.tables() is None:
                    raise
        return self._concluded(outcome, reason, by_signal)

    def _compute(self, missing: Sequence[int], on_progress: Callable[[Progress], object]) -> None:
        writer = RowWriter(self._folder, self._trials, self._repeating)
        first_s: float | None = None
        try:
            for result in self._engine.results(self._job, missing):
                now_s = wall_time_s()
                if result is not None:
                    first_s = now_s if first_s is None else first_s
                    writer.add(result)
                    self._done += 1
                    self._failed += result.values is None or not succeeded(self._study, result.values)
                writer.tick(now_s)
                on_progress(self._progress(first_s, now_s))
        finally:
            interrupted = sys.exc_info()[0] is not None
            try:
                writer.flush()
            except MissionError:
                if not interrupted:
                    raise

    def _progress(self, first_s: float | None, now_s: float) -> Progress:
        since_s = 0.0 if first_s is None else now_s - first_s
        return Progress(
            trials=len(self._trials),
            done=len(self._had) + self._done,
            failed=self._failed,
            rate_hz=(self._done - 1) / since_s if since_s > 0.0 else 0.0,
        )

    def _repeating(self, trial: Trial) -> str:
        """The command that repeats a trial by itself."""
        if self._study.command is not None:
            return self._study.command(trial.values, trial.seed)
        if self._repeat is not None:
            return self._repeat(trial)
        return f"run_trial(STUDY, {trial.index}, runs={self._trials.runs}, seed={self._trials.seed})"

    def _concluded(self, outcome: str, reason: str, by_signal: int) -> StudyResult:
        """Write tables, summary and pictures of the rows that there are."""

        found = self._folder.tables()
        if found is None:  # interrupted before the first row
            raise KeyboardInterrupt
        results = read_results(self._folder)
        wall_s = wall_time_s() - self._started_s
        summary = summary_of(
            self._study, results, engine=self._engine, outcome=outcome, reason=reason, wall_time_s=wall_s
        )
        summary["command"] = self._command
        table = list(study_table(self._study, results, summary))
        try:
            if results.complete:
                self._folder.write_tables(*found)
            self._folder.write(TABLE, ("\n".join(table) + "\n").encode())
            self._folder.write_json(SUMMARY, summary)
            if self._picture:
                pictures = self._draw(results)
                page = study_page(results, summary, table, pictures, outcome=outcome, reason=reason)
                self._folder.write(REPORT, page.encode())
        except MissionError as error:
            outcome, reason = "failed", "; ".join(filter(None, (reason, str(error))))
        return StudyResult(
            results=results,
            summary=summary,
            table=table,
            folder=self._folder.text,
            outcome=outcome,
            reason=reason,
            signal=by_signal,
        )

    def _draw(self, results: Results) -> dict[str, bytes]:
        """Write the pictures; returns them by name."""
        drawn = {}
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as made:
            (draw_study if self._study.draw is None else self._study.draw)(results, Path(made))
            for path in sorted(Path(made).iterdir()):
                drawn[path.name] = path.read_bytes()
                self._folder.write(path.name, drawn[path.name])
        return drawn


def identity_of(trials: Trials, command: str, arguments: Mapping[str, Any] | None) -> dict[str, Any]:
    """Contents of `study.json`."""
    study = trials.study
    return {
        "study": study.name,
        "fingerprint": trials.fingerprint(),
        "runs": trials.runs,
        "seed": trials.seed,
        "trials": len(trials),
        "cells": [dict(cell) for cell in study.design.cells],
        "sampled": list(study.design.sampled),
        "sampling": str(study.design.sampling),
        "fields": study.schema.text(),
        "success": study.success,
        "metrics": None if study.metrics is None else list(study.metrics),
        "baseline": study.baseline,
        "description": study.description,
        "options": dict(study.options),
        "arguments": dict(arguments or {}),
        "command": command,
    }


def _require_same(before: Mapping[str, Any], trials: Trials, place: str) -> None:
    """Raise PlanError if the study in a folder is another one; the message says what differs."""
    now = identity_of(trials, "", None)
    if before.get("fingerprint") == now["fingerprint"]:
        return
    for key in ("study", "seed", "runs", "options", "cells", "sampled", "sampling", "fields"):
        if before.get(key) != now[key]:
            raise PlanError(
                f"{place} has another study: its {key} {_short(before.get(key))} is not {_short(now[key])}; "
                "continue it with what it was begun with, or start a new one"
            )
    raise PlanError(f"{place} has another study: its distributions differ; start a new one")


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def read_results(place: StudyFolder | Path | str) -> Results:
    """The results in a study's folder, complete or not.

    Raises:
        PlanError: there is no study, or it has no rows yet.
    """
    folder = place if isinstance(place, StudyFolder) else StudyFolder.opened(place)
    identity = folder.identity()
    found = folder.tables()
    if found is None:
        raise PlanError(f"{folder.text} has no rows yet")
    metrics = identity["metrics"]
    return Results(
        name=identity["study"],
        table=found[0],
        timing=found[1],
        cells=tuple(identity["cells"]),
        sampled=tuple(identity["sampled"]),
        fields=tuple(name for name, _ in identity["fields"]),
        runs=identity["runs"],
        seed=identity["seed"],
        options=identity["options"],
        success=identity["success"],
        metrics=None if metrics is None else tuple(metrics),
        baseline=identity["baseline"],
        description=identity["description"],
    )
