"""Checks of logs and runs against limits and another run, with a report for continuous integration."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from estimators.errors import EstimatorError
from estimators.flown_track import flown_tracks
from estimators.log_replay import replay
from estimators.logs import Log, LogError, Table, open_log, report_of
from estimators.reports.summary import assess
from flightsim.foundation.plain_text import plain_text
from missions.errors import PlanError
from missions.flown.run_folder import LOG_NAME
from missions.runs.limits import OF_MESSAGES, Limit, Limits, Statistic
from missions.runs.run import Run, open_run

__all__ = ["CheckedRun", "Verdict", "check_run", "junit"]

Value = float | str | bool
_PATH_STEP_M: Final = 0.25  # between the points of a golden track's path

_STATISTICS: Final[Mapping[Statistic, Callable[[NDArray[np.float64]], Any]]] = {
    Statistic.LARGEST: lambda values: np.max(np.abs(values)),
    Statistic.LEAST: np.min,
    Statistic.MOST: np.max,
    Statistic.MEAN: np.mean,
    Statistic.RMS: lambda values: np.sqrt(np.mean(np.square(values))),
    Statistic.LAST: lambda values: values[-1],
}


class NotMeasured(Exception):
    """A quantity is not in a log or run; the message says why."""


class CheckedRun:
    """A run folder, or a log alone.

    Args:
        path: the folder, or the log.

    Raises:
        PlanError: there is no such run.
        LogError: the log can't be read.
    """

    def __init__(self, path: Path) -> None:
        if not path.exists():
            raise PlanError(f"{path} does not exist; give a run folder or a log")
        self.path = path
        self.run: Run | None = open_run(path) if path.is_dir() else None
        self.log: Log = open_log(path / LOG_NAME if path.is_dir() else path)
        self._assessed: dict[str, Mapping[str, Any]] = {}

    @cached_property
    def _report(self) -> Mapping[str, Any]:
        return report_of(self.log).to_dict()

    def value(self, limit: Limit, golden: "CheckedRun | None" = None) -> Value:
        """The value of a quantity.

        Args:
            limit: which one.
            golden: the run from whose track distances are measured.

        Raises:
            NotMeasured: it is not in the run.
        """
        try:
            if limit.summary is not None:
                if self.run is None:
                    raise NotMeasured(f"{self.path} is a log and has no summary; give a run folder")
                return _entry(self.run.summary, limit.summary, "summary.json")
            if limit.log is not None:
                return _entry(self._report, limit.log, "log info")
            if limit.estimator is not None and limit.figure is not None:
                return _entry(self._assessment(limit.estimator), limit.figure, f"replay of {limit.estimator}")
            if limit.track is not None:
                return self._from_track(limit.track, golden)
            return self._of_message(limit)
        except (LogError, EstimatorError) as error:
            raise NotMeasured(str(error)) from error

    def _assessment(self, name: str) -> Mapping[str, Any]:
        if name not in self._assessed:
            done = replay(self.log, name)
            self._assessed[name] = assess(
                done.fleet, [self.log], failure=done.failure, supplies=done.supplies
            ).figures
        return self._assessed[name]

    def _of_message(self, limit: Limit) -> float:
        table = self.log.table(
            limit.message or "",
            system_id=limit.system_id,
            component_id=limit.component_id,
            instance=limit.instance,
        )
        time_s = table.time_us * 1e-6
        low, high = limit.from_s, limit.to_s
        inside = (time_s >= (-math.inf if low is None else low)) & (
            time_s < (math.inf if high is None else high)
        )
        table = table.select(inside)
        if limit.statistic in OF_MESSAGES:
            return _of_times(limit.statistic, table)
        values = table.si(limit.field or "")
        values = values[np.isfinite(values)]
        if not len(values):
            raise NotMeasured(f"no {limit.message} with a finite {limit.field} in that time")
        return float(_STATISTICS[limit.statistic](values))

    def _from_track(self, statistic: Statistic, golden: "CheckedRun | None") -> float:
        if golden is None:
            raise NotMeasured("a golden run is needed")
        before = {(track.system_id, track.boot): track for track in flown_tracks(golden.log)}
        distances = []
        for track in flown_tracks(self.log):
            other = before.get((track.system_id, track.boot))
            if other is None:
                raise NotMeasured(f"{golden.path} has no track of vehicle {track.system_id}")
            path = np.vstack([_path(other.pos_ned_m()[part]) for part in other.parts])
            known = np.isfinite(path).all(axis=1)
            places = track.pos_ned_m(other.home)
            distances.append(cKDTree(path[known]).query(places[np.isfinite(places).all(axis=1)])[0])
        return float(_STATISTICS[statistic](np.concatenate(distances)))


def _path(places_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points along a line through places, a quarter of a metre apart at most."""
    if len(places_m) < 2:
        return places_m
    along_m = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(places_m, axis=0), axis=1))))
    at_m = np.linspace(0.0, along_m[-1], 2 + int(along_m[-1] / _PATH_STEP_M))
    return np.column_stack([np.interp(at_m, along_m, column) for column in places_m.T])


def _of_times(statistic: Statistic, table: Table) -> float:
    if statistic is Statistic.COUNT:
        return float(len(table))
    if len(table) < 2:
        raise NotMeasured(f"{len(table)} {table.name} in that time; two are needed")
    steps_s = np.diff(np.sort(table.time_us)) * 1e-6
    if statistic is Statistic.LONGEST_GAP_S:
        return float(steps_s.max())
    return float(len(steps_s) / max(float(steps_s.sum()), 1e-6))


def _entry(figures: Mapping[str, Any], path: str, where: str) -> Value:
    """An entry of nested tables and lists: "vehicles.0.distance_m".

    Raises:
        NotMeasured: there is none, or it is no number, text or flag.
    """
    found: Any = figures
    for part in path.split("."):
        if isinstance(found, Mapping) and part in found:
            found = found[part]
        elif isinstance(found, (list, tuple)) and part.isdigit() and int(part) < len(found):
            found = found[int(part)]
        else:
            there = ", ".join(map(str, found)) if isinstance(found, Mapping) else "no such entry"
            raise NotMeasured(f"no {path!r} in {where}: {part!r} is not there ({there})")
    if not isinstance(found, (bool, int, float, str)):
        raise NotMeasured(f"{path!r} in {where} is {'null' if found is None else 'no single value'}")
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """The result of one check.

    Attributes:
        name: the check.
        run: the log or folder.
        value: what was measured; None: nothing.
        failures: why it failed, one text for each bound; empty: it passed.
    """

    name: str
    run: str
    value: Value | None
    failures: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The verdict in a line."""
        value = () if self.value is None else (_written(self.value),)
        return (
            f"{'FAILED' if self.failures else 'passed'}  {self.name}: {'; '.join((*value, *self.failures))}"
        )


def check_run(path: Path, limits: Limits, against: Path | None = None) -> list[Verdict]:
    """Check a run folder or a log.

    Args:
        path: the folder, or the log.
        limits: the checks.
        against: another run folder or log, for checks that compare.

    Raises:
        PlanError: there is no such run, or a check compares and there is nothing to compare with.
        LogError: a log can't be read.
    """
    comparing = [limit for limit in limits.check if limit.compares]
    if comparing and against is None:
        raise PlanError(f"the check '{comparing[0].title}' compares with another run; give `against`")
    if against is not None and not comparing:
        raise PlanError("no check compares (within, within_share, track); leave `against` out")
    run = CheckedRun(path)
    golden = None if against is None else CheckedRun(against)
    return [_verdict(run, limit, golden) for limit in limits.check]


def _verdict(run: CheckedRun, limit: Limit, golden: CheckedRun | None) -> Verdict:
    made = partial(Verdict, name=limit.title, run=str(run.path))
    try:
        value = run.value(limit, golden)
        failures = [*_bounds(limit, value)]
        if golden is not None and (limit.within is not None or limit.within_share is not None):
            failures += _differences(limit, value, golden.value(limit))
    except NotMeasured as error:
        return made(value=None, failures=(f"not measured: {error}",))
    return made(value=value, failures=tuple(failures))


def _bounds(limit: Limit, value: Value) -> list[str]:
    if limit.equals is not None:
        return [] if value == limit.equals else [f"it is not {_written(limit.equals)}"]
    if isinstance(value, str):
        return [f"{value!r} is no number"] if limit.least is not None or limit.most is not None else []
    failures = []
    if limit.least is not None and not value >= limit.least:
        failures.append(f"less than {limit.least:g}")
    if limit.most is not None and not value <= limit.most:
        failures.append(f"more than {limit.most:g}")
    return failures


def _differences(limit: Limit, value: Value, golden: Value) -> list[str]:
    if isinstance(value, str) or isinstance(golden, str):
        return [] if value == golden else [f"it was {_written(golden)}"]
    away = abs(value - golden)
    failures = []
    if limit.within is not None and not away <= limit.within:
        failures.append(f"it was {golden:g}: {away:.3g} away, more than {limit.within:g}")
    if limit.within_share is not None and not away <= limit.within_share * abs(golden):
        failures.append(f"it was {golden:g}: {away:.3g} away, more than {limit.within_share:g} of it")
    return failures


def _written(value: Value) -> str:
    return repr(value) if isinstance(value, (str, bool)) else f"{value:.6g}"


def junit(verdicts: Sequence[Verdict]) -> bytes:
    """The verdicts as a JUnit file, a suite for each run."""
    suites = ElementTree.Element("testsuites", name="flightstack check")
    for run in dict.fromkeys(verdict.run for verdict in verdicts):
        own = [verdict for verdict in verdicts if verdict.run == run]
        failed = sum(bool(verdict.failures) for verdict in own)
        counts = {"tests": str(len(own)), "failures": str(failed), "errors": "0", "skipped": "0"}
        suite = ElementTree.SubElement(suites, "testsuite", {"name": run} | counts)
        for verdict in own:
            case = ElementTree.SubElement(suite, "testcase", classname=run, name=verdict.name, time="0")
            if verdict.failures:
                text = plain_text("; ".join(verdict.failures))  # without characters that XML can't have
                ElementTree.SubElement(case, "failure", message=text, type="limit").text = text
    return ElementTree.tostring(suites, encoding="utf-8", xml_declaration=True)
