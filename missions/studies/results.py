"""The results of a study as arrays, for summaries and pictures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from missions.studies.rows import TrialOutcome

__all__ = ["Results"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Results:
    """The rows of a study, or those that it has so far.

    Attributes:
        name: name of the study.
        table: one row for each finished trial, in the order of the trials. Columns: `trial`, `cell`, `run`,
            `seed`, the parameters, `outcome`, `error`, the fields of the row, `command`, `versions`.
        timing: columns `trial`, `wall_time_s`, `worker`, `attempts`, in the same order.
        cells: parameters of each cell.
        sampled: names of the parameters that were drawn for each run.
        fields: names of the row's fields.
        runs: number of runs per cell.
        seed: seed of the study.
        options: what the study was built with.
        success: field that is True for a successful trial; "": every trial with a row is.
        metrics: fields that are summarised; None: all numbers.
        baseline: index of the cell that others are compared with.
        description: one sentence about the study.
    """

    name: str
    table: pa.Table
    timing: pa.Table
    cells: tuple[Mapping[str, Any], ...]
    sampled: tuple[str, ...] = ()
    fields: tuple[str, ...]
    runs: int
    seed: int
    options: Mapping[str, Any] = field(default_factory=dict)
    success: str = ""
    metrics: Sequence[str] | None = None
    baseline: int = 0
    description: str = ""

    @property
    def complete(self) -> bool:
        """Whether every trial has ended."""
        return self.table.num_rows == self.runs * len(self.cells)

    def count(self, outcome: TrialOutcome) -> int:
        """Number of trials that ended so."""
        return int(pc.sum(pc.equal(self.table["outcome"], outcome.value)).as_py() or 0)

    def without_row(self) -> list[dict[str, Any]]:
        """The trials without a row: number, outcome, error and command."""
        chosen = self.table.filter(pc.not_equal(self.table["outcome"], TrialOutcome.DONE.value))
        found: list[dict[str, Any]] = chosen.select(["trial", "outcome", "error", "command"]).to_pylist()
        return found

    def values(self, name: str, length: int = 0) -> Array:
        """Values of a column, or of a number by name (`figures.key`), as an array.

        Args:
            name: of the column.
            length: least length of the sequences of a column of sequences. Without it, the length is that of
                the longest row, and 0 when no trial has a row.

        Returns:
            (cells, runs), or (cells, runs, length) for a column of sequences. True is 1, False is 0. NaN
            where a trial has no row, or no value.
        """
        column = self.table[name]
        if pa.types.is_list(column.type):
            return self._placed_sequences(column, length)
        if pa.types.is_boolean(column.type):
            column = column.cast(pa.int8())
        numbers = column.cast(pa.float64()).to_numpy(zero_copy_only=False)
        placed = np.full((len(self.cells), self.runs), np.nan)
        placed[self._cell, self._run] = numbers
        return placed

    @property
    def succeeded(self) -> NDArray[np.bool_]:
        """(cells, runs) of the trials that were successful."""
        done = np.zeros((len(self.cells), self.runs), dtype=np.bool_)
        good = pc.equal(self.table["outcome"], TrialOutcome.DONE.value)
        if self.success:
            good = pc.and_(good, pc.fill_null(self.table[self.success], False))
        done[self._cell, self._run] = good.to_numpy(zero_copy_only=False)
        return done

    @property
    def finished(self) -> NDArray[np.bool_]:
        """(cells, runs) of the trials that have ended, successful or not."""
        ended = np.zeros((len(self.cells), self.runs), dtype=np.bool_)
        ended[self._cell, self._run] = True
        return ended

    @property
    def seed_of_run(self) -> NDArray[np.int64]:
        """(runs,) seed of each run; -1 for a run without a finished trial."""
        seeds = np.full(self.runs, -1, dtype=np.int64)
        seeds[self._run] = self.table["seed"].to_numpy()
        return seeds

    def numeric_fields(self) -> list[str]:
        """Columns of the row that are single numbers, without those that are True or False."""
        return [
            f.name
            for f in self.table.schema
            if f.name.partition(".")[0] in self.fields
            and (pa.types.is_floating(f.type) or pa.types.is_integer(f.type))
        ]

    def flags(self) -> list[str]:
        """Columns of the row that are True or False."""
        return [f.name for f in self.table.schema if f.name in self.fields and pa.types.is_boolean(f.type)]

    @property
    def _cell(self) -> NDArray[np.int64]:
        return np.asarray(self.table["cell"].to_numpy())

    @property
    def _run(self) -> NDArray[np.int64]:
        return np.asarray(self.table["run"].to_numpy())

    def _placed_sequences(self, column: pa.ChunkedArray, length: int) -> Array:
        lists = column.to_pylist()
        length = max(length, *(len(numbers) for numbers in lists if numbers is not None), 0)
        placed = np.full((len(self.cells), self.runs, length), np.nan)
        for cell, run, numbers in zip(self._cell, self._run, lists, strict=True):
            if numbers is not None:
                placed[cell, run, : len(numbers)] = numbers
        return placed
