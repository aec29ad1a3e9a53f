"""A study: a trial, its row, the design of its parameters, and what its summary shows."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, Generic, TypeVar

from missions.errors import PlanError
from missions.studies.design import Design, Value
from missions.studies.results import Results
from missions.studies.rows import RowSchema

__all__ = ["MAX_RUNS", "Study", "Trial", "Trials", "run_of"]

Parameters = TypeVar("Parameters")
Row = TypeVar("Row")

MAX_RUNS: Final = 1_000_000
"""Runs per cell. The seeds of run k of the study with seed S is S * MAX_RUNS + k: studies with different
seeds have no seed in common.
"""
_SEED_LIMIT: Final = (2**63 - 1) // MAX_RUNS


def run_of(seed: int) -> tuple[int, int]:
    """The study's seed and the number of the run, from the seed of a trial."""
    return divmod(seed, MAX_RUNS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Study(Generic[Parameters, Row]):
    """A Monte Carlo study. Every trial is a function of its parameters and its seed alone.

    Attributes:
        name: name for users and for file names.
        trial: computes one row. It may raise: the trial is then a row with the error. A flight is flown by
            `missions.studies.flights.fly_trial`, in a folder of its own.
        row: dataclass of the result. Its fields are numbers, True or False, texts, each with or without
            `| None`, sequences of numbers (`tuple[float, ...]`) or numbers by name (`Mapping[str, float]`).
        design: the cells, and the parameters that are drawn for each run.
        parameters: dataclass that `trial` receives, made from the values by name; None: it receives them as a
            mapping.
        runs: default number of runs per cell.
        success: field of the row that is True for a successful trial; "": every trial with a row is. Other
            trials count in the success rate, and not in the figures.
        metrics: fields of the row that are summarised and drawn; None: all numbers.
        baseline: index of the cell that the others are compared with, in pairs of equal seeds.
        description: one sentence for the summary.
        options: what the study was built with, for `study.json`: a resumed study must have the same.
        warm_up: called once in each worker before its first trial, to compile or load kernels.
        command: the command that repeats one trial by itself, from its parameters and seed; None: the
            study's own command for one trial.
        summarise: entries that `summary.json` has besides those of every study.
        report: lines of the table; None: the table of every study.
        draw: draws pictures into a new folder; None: the picture of every study.
        files: files of users that the trials need; they travel to the nodes of a cluster.
    """

    name: str
    trial: Callable[[Parameters, int], Row]
    row: type[Row]
    design: Design = field(default_factory=Design)
    parameters: type[Parameters] | None = None
    runs: int = 100
    success: str = ""
    metrics: Sequence[str] | None = None
    baseline: int = 0
    description: str = ""
    options: Mapping[str, Value | None] = field(default_factory=dict)
    warm_up: Callable[[], object] | None = None
    command: Callable[[Mapping[str, Value], int], str] | None = None
    summarise: Callable[[Results], Mapping[str, Any]] | None = None
    report: Callable[[Results], Sequence[str]] | None = None
    draw: Callable[[Results, Path], None] | None = None
    files: Sequence[Path] = ()

    def __post_init__(self) -> None:
        schema = RowSchema.of(self.row)
        if not self.name or not all(c.isalnum() or c in "-_." for c in self.name):
            raise PlanError(f"name {self.name!r} is not accepted; letters, digits, '-', '_' and '.' are")
        if not callable(self.trial):
            raise PlanError(f"trial {self.trial!r} is not a function of (parameters, seed)")
        if not 1 <= self.runs <= MAX_RUNS:
            raise PlanError(f"`runs` {self.runs} is not in 1..{MAX_RUNS}")
        double = sorted(self.design.names & schema.names)
        if double:
            raise PlanError(f"{', '.join(double)}: a parameter and a field of the row; rename one of them")
        if self.success and schema.kinds.get(self.success) is not bool:
            raise PlanError(
                f"success {self.success!r} is not a field of {self.row.__name__} that is True or False"
            )
        unknown = set(self.metrics or ()) - schema.names
        if unknown:
            raise PlanError(f"metrics {', '.join(sorted(unknown))}: {self.row.__name__} has no such field")
        if not 0 <= self.baseline < len(self.design.cells):
            raise PlanError(f"baseline {self.baseline} is not a cell; there are {len(self.design.cells)}")
        if self.parameters is not None:
            self._check_parameters(self.parameters)

    def _check_parameters(self, kind: type[Parameters]) -> None:
        sampled = self.design.drawn(0, 1)
        for cell in self.design.cells:
            values = {**cell, **{name: float(drawn[0]) for name, drawn in sampled.items()}}
            try:
                kind(**values)
            except TypeError as error:
                known = [f.name for f in fields(kind)]  # type: ignore[arg-type]
                raise PlanError(
                    f"the design's {sorted(values)} do not make {kind.__name__}({', '.join(known)})"
                ) from error

    @property
    def schema(self) -> RowSchema:
        """The columns of the row."""
        return RowSchema.of(self.row)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trial:
    """One trial.

    Attributes:
        index: its number in the study: run by run, and in a run cell by cell.
        cell: index of its cell.
        run: number of its run.
        seed: its seed, the same in all cells of a run.
        values: its parameters by name.
    """

    index: int
    cell: int
    run: int
    seed: int
    values: Mapping[str, Value]


class Trials:
    """All trials of a study, by number.

    Args:
        study: the study.
        runs: number of runs per cell.
        seed: seed of the study.

    Raises:
        PlanError: a number is not accepted.
    """

    def __init__(self, study: Study[Any, Any], runs: int, seed: int) -> None:
        if not 1 <= runs <= MAX_RUNS:
            raise PlanError(f"`runs` {runs} is not in 1..{MAX_RUNS}")
        if not 0 <= seed < _SEED_LIMIT:
            raise PlanError(f"`seed` {seed} is not in 0..{_SEED_LIMIT - 1}")
        self.study, self.runs, self.seed = study, runs, seed
        self._cells = study.design.cells
        self._drawn = study.design.drawn(seed, runs)

    def __len__(self) -> int:
        return self.runs * len(self._cells)

    def __getitem__(self, index: int) -> Trial:
        if not 0 <= index < len(self):
            raise IndexError(f"trial {index} is not in 0..{len(self) - 1}")
        run, cell = divmod(index, len(self._cells))
        drawn = {name: float(values[run]) for name, values in self._drawn.items()}
        return Trial(
            index=index,
            cell=cell,
            run=run,
            seed=self.seed * MAX_RUNS + run,
            values=MappingProxyType({**self._cells[cell], **drawn}),
        )

    def fingerprint(self) -> str:
        """Text that differs for studies whose rows do not belong together."""
        study = self.study
        content = [
            study.name,
            study.design.fingerprint(),
            self.runs,
            self.seed,
            study.schema.text(),
            _plain(study),
        ]
        return hashlib.blake2b(json.dumps(content).encode(), digest_size=16).hexdigest()


def _plain(study: Study[Any, Any]) -> list[list[Any]]:
    return [[name, value] for name, value in sorted(study.options.items())]
