"""Compares estimates with references: errors over time, and their statistics over the time in the air."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from estimators.airborne import ALWAYS, airborne_spans, duration_s, within
from estimators.references import (
    AUTOPILOT,
    COMPARED,
    TRUTH,
    Column,
    ErrorFigures,
    Reference,
    error_figures,
    errors,
    home_of,
    lacking_references,
    references,
    target_reference,
    targets_reference,
)
from estimators.runner import EstimateTable, Runner
from estimators.user_choices import Against
from flightsim.foundation.geodesy import GeodeticPosition

if TYPE_CHECKING:
    from estimators.logs import Log

AGAINST: Final[Mapping[str, Sequence[str]]] = {
    Against.AUTOPILOT: (AUTOPILOT,),
    Against.TRUTH: (TRUTH,),
    Against.BOTH: (AUTOPILOT, TRUTH),
}
"""The references that estimates can be compared with, the main one first."""

OSPA_CUTOFF_M: Final = 20.0
"""Distance at which an estimate and a target of a set count as different, metres."""
_TARGET: Final = "target"


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The estimates of one subject, compared.

    Attributes:
        label: "vehicle 1", "target 3", "targets" (sets).
        subject: system id; 0 for a target.
        time_us: (n,) vehicle time of the estimates; it restarts with each boot.
        boot: (n,) number of each estimate's boot.
        estimates: (n,) columns by name.
        references: by name of the reference and of the column, at the estimates' times; NaN: not known.
        sources: messages from which each reference is taken.
        counted: (n,) estimates made in the air.
        airborne_s: total time in the air.
        airborne_from: the source of the time in the air.
        figures: error statistics by name of the reference.
        not_compared: reason why there are no figures; "" if there are.
        group: kind of things of which this is one, drawn together; "": drawn alone.
    """

    label: str
    subject: int
    time_us: NDArray[np.int64]
    boot: NDArray[np.int64]
    estimates: Mapping[str, Column]
    references: Mapping[str, Mapping[str, Column]]
    sources: Mapping[str, Sequence[str]]
    counted: NDArray[np.bool_]
    airborne_s: float
    airborne_from: str
    figures: Mapping[str, Sequence[ErrorFigures]]
    not_compared: str
    group: str = ""

    @property
    def reference(self) -> str | None:
        """Name of the reference of the main figures; None if there is none."""
        return next((name for name, figures in self.figures.items() if figures), None)

    def errors(self, reference: str, column: str) -> Column:
        """Estimate minus reference."""
        return errors(column, self.estimates[column], self.references[reference][column])


def comparisons(logs: "Sequence[Log]", runner: Runner, against: str = Against.BOTH) -> list[Comparison]:
    """Compare the estimates of a runner with the references in its logs.

    Args:
        logs: logs that the runner processed.
        runner: a runner that has finished.
        against: one of `AGAINST`.

    Returns:
        One comparison for each vehicle or target that has estimates.

    Raises:
        ValueError: `against` is not one of `AGAINST`.
    """
    if against not in AGAINST:
        raise ValueError(f"against {against!r} is not accepted; there are {', '.join(AGAINST)}")
    found = []
    for table in runner.tables.values():
        if table.alternatives_of:
            found += _first_alternatives(logs, runner, table)
            continue
        if table.of_sets:
            found += [
                _compared_sets(logs, runner, table, subject, AGAINST[against])
                for subject in sorted({*table.subject.tolist()})
            ]
            continue
        numbers = (
            table[_TARGET].astype(np.int64) if _TARGET in table.columns else np.zeros(len(table), np.int64)
        )
        subjects = table.subject
        for subject, number in sorted({*zip(subjects.tolist(), numbers.tolist(), strict=True)}):
            rows = np.flatnonzero((subjects == subject) & (numbers == number))
            found.append(_compared(logs, runner, table, rows, subject, number, AGAINST[against]))
    return found


def _first_alternatives(logs: "Sequence[Log]", runner: Runner, table: EstimateTable) -> list[Comparison]:
    """The most probable alternative for each thing over time; the truth about such things is not in logs."""
    numbers = table[table.alternatives_of]
    found = []
    for number in np.unique(numbers[np.isfinite(numbers)]).astype(int).tolist():
        rows = np.flatnonzero((table.target_index == 0) & (numbers == number))
        compared = _compared(logs, runner, table, rows, 0, number, ())
        label = f"{table.alternatives_of} {number}"
        reason = f"logs have no reference for the column {table.alternatives_of}"
        found.append(replace(compared, label=label, group=table.alternatives_of, not_compared=reason))
    return found


def _compared(
    logs: "Sequence[Log]",
    runner: Runner,
    table: EstimateTable,
    rows: NDArray[np.intp],
    subject: int,
    number: int,
    wanted: Sequence[str],
) -> Comparison:
    time_us, boot = table.time_us[rows], table.boot[rows]
    if subject:  # a team's common time; the log has the vehicle's own time
        time_us = time_us - runner.common_us(0, subject)
    estimates = dict(zip(table.columns, table.values[rows].T.copy(), strict=True))
    compared = [name for name in COMPARED if name in estimates]
    counted = np.zeros(len(rows), dtype=np.bool_)
    known: dict[str, dict[str, Column]] = {}
    sources: dict[str, list[str]] = {}
    airborne_s, airborne_from = 0.0, ""
    log = _log_of(logs, subject)
    boots = [None] if log is None or not subject else _boots_with_estimates(log, runner, subject)
    for index, number_in_log in enumerate(boots):
        here = boot == index if len(boots) > 1 else np.ones(len(rows), dtype=np.bool_)
        times = time_us[here]
        if subject and log is not None:
            spans, airborne_from = airborne_spans(log, subject, number_in_log)
            found = references(log, subject, origin=runner.estimator.origin, boot=number_in_log)
        else:
            spans, airborne_from = [ALWAYS], "all of the log"
            found = _target_references(logs, runner, number)
        counted[here] = within(spans, times)
        airborne_s += duration_s(spans, times)
        for name in wanted:
            reference = found.get(name)
            shared = [c for c in compared if reference is not None and c in reference.columns]
            if reference is None or not shared:
                continue
            columns = known.setdefault(name, {})
            sources[name] = list(dict.fromkeys(reference.columns[c].source for c in shared))
            for column in shared:
                at = columns.setdefault(column, np.full(len(rows), np.nan))
                at[here] = reference.columns[column].at(times)
    figures = {}
    for name in (n for n in wanted if n in known):
        made = [
            error_figures(column, errors(column, estimates[column], at), counted)
            for column, at in known[name].items()
        ]
        figures[name] = [item for item in made if item is not None]
    return Comparison(
        label=f"vehicle {subject}" if subject else f"target {number}",
        subject=subject,
        time_us=time_us,
        boot=boot,
        estimates=estimates,
        references=known,
        sources=sources,
        counted=counted,
        airborne_s=airborne_s,
        airborne_from=airborne_from,
        figures=figures,
        not_compared=""
        if any(figures.values())
        else _why_not(log, subject, table.columns, wanted, bool(known), counted, airborne_from),
    )


def _compared_sets(
    logs: "Sequence[Log]", runner: Runner, table: EstimateTable, subject: int, wanted: Sequence[str]
) -> Comparison:
    """Sets of targets, each against the set of the true targets: their numbers, and OSPA of their places."""
    rows = np.flatnonzero(table.subject == subject)
    index, all_us, values = table.target_index[rows], table.time_us[rows], table.values[rows]
    first = np.flatnonzero(index <= 0)  # the row with which each set begins
    time_us = all_us[first]
    sizes = np.add.reduceat(index >= 0, first).astype(np.float64)
    estimates = {"targets": sizes}
    known: dict[str, dict[str, Column]] = {}
    figures: dict[str, list[ErrorFigures]] = {}
    counted: NDArray[np.bool_] = np.ones(len(first), dtype=np.bool_)
    places = {"north_m", "east_m"} <= {*table.columns}
    if places and TRUTH in wanted:
        from estimators.tracking.ospa import ospa  # its kernels are compiled for sets only

        truth = _true_targets(logs, runner, time_us)
        columns = [table.columns.index("north_m"), table.columns.index("east_m")]
        found = np.split(values[:, columns], first[1:])
        there = np.isfinite(truth[:, :, 0])
        counted = np.asarray(there.any(axis=1), dtype=np.bool_)
        estimates["ospa_m"] = np.array(
            [
                ospa(one[np.isfinite(one[:, 0])], true[here], cutoff=OSPA_CUTOFF_M) if any_there else np.nan
                for one, true, here, any_there in zip(found, truth, there, counted, strict=True)
            ]
        )
        if counted.any():
            known[TRUTH] = {"targets": there.sum(axis=1).astype(np.float64), "ospa_m": np.zeros(len(first))}
            made = [
                error_figures(name, estimates[name] - column, counted)
                for name, column in known[TRUTH].items()
            ]
            figures[TRUTH] = [item for item in made if item is not None]
    return Comparison(
        label="targets" if not subject else f"targets of vehicle {subject}",
        subject=subject,
        time_us=time_us,
        boot=table.boot[rows][first],
        estimates=estimates,
        references=known,
        sources={TRUTH: ["HIL_STATE_QUATERNION"]} if known else {},
        counted=counted,
        airborne_s=duration_s([ALWAYS], time_us),
        airborne_from="all of the log",
        figures=figures,
        not_compared=""
        if figures
        else "the log has no true targets for north_m, east_m"
        if places
        else "sets are compared by north_m and east_m, which their columns lack",
    )


def _true_targets(logs: "Sequence[Log]", runner: Runner, time_us: NDArray[np.int64]) -> NDArray[np.float64]:
    for log in logs:
        origin = runner.estimator.origin or next(
            (place for s in log.systems if (place := home_of(log, s)) is not None), None
        )
        truth = targets_reference(log, time_us, origin=origin)
        if truth.shape[1]:
            return truth
    return np.full((len(time_us), 0, 2), np.nan)


def _why_not(
    log: "Log | None",
    subject: int,
    columns: Sequence[str],
    wanted: Sequence[str],
    referenced: bool,
    counted: NDArray[np.bool_],
    airborne_from: str,
) -> str:
    """The reason why estimates have no errors, as text."""
    compared = [column for column in columns if column in COMPARED]
    if not compared:
        known = ", ".join(COMPARED)
        return f"no reference for its columns {', '.join(columns)}; there are references for {known}"
    if not referenced:
        what = " and ".join({AUTOPILOT: "of the autopilot", TRUTH: "of the truth"}[name] for name in wanted)
        lacking = [] if log is None or not subject else lacking_references(log, subject, compared)
        tail = f" (no {', no '.join(lacking)})" if lacking and AUTOPILOT in wanted else ""
        return f"the log has nothing {what} for {', '.join(compared)}{tail}"
    if not counted.any():
        return f"no estimate was made in the air: {airborne_from}"
    return "estimates and references have no time in common"


def _log_of(logs: "Sequence[Log]", subject: int) -> "Log | None":
    """The log that contains a vehicle."""
    return next((log for log in logs if subject in log.systems), logs[0] if logs else None)


def _boots_with_estimates(log: "Log", runner: Runner, system_id: int) -> list[int | None]:
    """Boots of the log, numbered as in the runner: those in which it received a message."""
    numbers = [boot.number for boot in log.boots if boot.system_id == system_id]
    if len(numbers) < 2:
        return [None]
    known = {key.name for key in log.keys}
    names = sorted(runner.names & known)
    return [n for n in numbers if any(log.has(name, system_id=system_id, boot=n) for name in names)]


def _target_references(logs: "Sequence[Log]", runner: Runner, number: int) -> dict[str, Reference]:
    origin: GeodeticPosition | None = runner.estimator.origin
    for log in logs:
        if origin is None:
            origin = next((place for s in log.systems if (place := home_of(log, s)) is not None), None)
        reference = target_reference(log, number, origin=origin)
        if reference is not None:
            return {TRUTH: reference}
    return {}
