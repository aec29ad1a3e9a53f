"""The folder of a study: what it is, its rows as they come, its tables and its files.

It may be on any file system of `pyarrow.fs`. Every file is whole or absent: local files get their name when
they are complete, and objects of a store appear when they are complete.
"""

import io
import json
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Final, Self

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from filelock import BaseFileLock, FileLock, Timeout
from pyarrow import fs

from missions.errors import MissionError, PlanError
from missions.flown.run_folder import create_run_folder, finite
from missions.studies.rows import FIGURES, TIMING, TrialOutcome, TrialResult
from missions.studies.study import Trials

__all__ = ["RowWriter", "StudyFolder", "columns_of"]

IDENTITY: Final = "study.json"
ROWS: Final = "rows.parquet"
TIMES: Final = "timing.parquet"
PARTS: Final = "parts"
LOGS: Final = "logs"
SUMMARY: Final = "summary.json"
_LOCK: Final = ".lock"
_FORMAT: Final = 1
_OBJECT_STORES: Final = ("s3", "gcs", "abfs")


file_system: Final = fs.FileSystem.from_uri
"""File system and path of a URI."""


class StudyFolder:
    """A study's folder. Make it with `created` or `opened`.

    Attributes:
        text: the folder as the user named it.
    """

    def __init__(self, system: fs.FileSystem, path: str, text: str) -> None:
        self._fs, self._path, self.text = system, path.rstrip("/"), text
        self._local = Path(path) if isinstance(system, fs.LocalFileSystem) else None
        self._lock: BaseFileLock | None = None

    @classmethod
    def created(cls, out: Path | str | None, name: str) -> Self:
        """A new, empty folder.

        Args:
            out: path, or URI of a file system of `pyarrow.fs`; None: the next `runs/<name>-<n>`.
            name: name of the study.

        Raises:
            PlanError: it is not empty, or can't be created.
        """
        if out is None or not _is_uri(out):
            path = create_run_folder(None if out is None else Path(out), name)
            return cls(fs.LocalFileSystem(), str(path), str(path))
        folder = cls._at(out)
        try:
            if folder._names(""):
                raise PlanError(f"{out} is not empty, and nothing is overwritten; choose another `out`")
            folder._fs.create_dir(folder._path, recursive=True)
        except OSError as error:
            raise PlanError(f"can't make the folder {out}: {error}; choose another `out`") from error
        return folder

    @classmethod
    def opened(cls, place: Path | str) -> Self:
        """The folder of an existing study.

        Raises:
            PlanError: there is no study in it.
        """
        folder = cls._at(place)
        if not folder.has(IDENTITY):
            raise PlanError(f"{place} has no study: there is no {IDENTITY} in it")
        return folder

    @classmethod
    def _at(cls, place: Path | str) -> Self:
        if not _is_uri(place):
            return cls(fs.LocalFileSystem(), str(place), str(place))
        try:
            system, path = file_system(str(place))
        except (OSError, ValueError) as error:
            raise PlanError(f"{place} is not a place for results: {error}") from error
        return cls(system, path, str(place))

    def __enter__(self) -> Self:
        """Claim the folder for this process.

        Raises:
            PlanError: another process computes this study now.
        """
        if self._local is not None:
            self._lock = FileLock(self._local / _LOCK)
            try:
                self._lock.acquire(blocking=False)
            except Timeout as error:
                raise PlanError(
                    f"another process computes the study in {self.text} now; wait for its end"
                ) from error
        return self

    def __exit__(self, *_: object) -> None:
        if self._lock is not None and self._local is not None:
            with suppress(OSError):
                (self._local / _LOCK).unlink()
            self._lock.release()
            self._lock = None

    def has(self, name: str) -> bool:
        """Whether there is such a file."""
        try:
            found = self._fs.get_file_info(self._full(name))
        except OSError as error:
            raise PlanError(f"can't read {self.text}: {error}") from error
        return bool(found.type == fs.FileType.File)

    def read(self, name: str) -> bytes:
        """Contents of a file."""
        with self._fs.open_input_stream(self._full(name)) as stream:
            return bytes(stream.read())

    def write(self, name: str, content: bytes) -> None:
        """Write a file, or replace it.

        Raises:
            MissionError: it can't be written. What was there is kept.
        """
        try:
            self._write(name, content)
        except OSError as error:
            raise MissionError(
                f"can't write {self.text}/{name}: {error.strerror or error}; check the disk"
            ) from error

    def _write(self, name: str, content: bytes) -> None:
        if self._local is not None:
            path = self._local / name
            path.parent.mkdir(parents=True, exist_ok=True)
            part = path.with_name(f".{path.name}.part{os.getpid()}")
            try:
                part.write_bytes(content)
                part.replace(path)
            except OSError:
                with suppress(OSError):
                    part.unlink()
                raise
            return
        full = self._full(name)
        if self._fs.type_name in _OBJECT_STORES:
            with self._fs.open_output_stream(full) as stream:
                stream.write(content)
            return
        self._fs.create_dir(full.rpartition("/")[0], recursive=True)
        with self._fs.open_output_stream(f"{full}.part") as stream:
            stream.write(content)
        self._fs.move(f"{full}.part", full)

    def write_json(self, name: str, content: Mapping[str, Any]) -> None:
        """Write a JSON file. Numbers that are not finite become null."""
        self.write(name, (json.dumps(finite(content), indent=2, allow_nan=False) + "\n").encode())

    def identity(self) -> dict[str, Any]:
        """What the study in this folder is.

        Raises:
            PlanError: the file can't be read.
        """
        try:
            found = json.loads(self.read(IDENTITY))
        except (OSError, ValueError) as error:
            raise PlanError(f"{self.text}/{IDENTITY} can't be read: {error}") from error
        if not isinstance(found, dict) or found.get("format") != _FORMAT:
            raise PlanError(f"{self.text}/{IDENTITY} is of another version of this program")
        return found

    def write_identity(self, identity: Mapping[str, Any]) -> None:
        """Say what the study in this folder is."""
        self.write_json(IDENTITY, {"format": _FORMAT, **identity})

    def tables(self) -> tuple[pa.Table, pa.Table] | None:
        """The rows and the timing of all finished trials, in the order of the trials; None: there are none.

        Raises:
            PlanError: a file is damaged.
        """
        if self.has(ROWS) and self.has(TIMES):
            return self._table(ROWS), self._table(TIMES)
        parts = [self._table(f"{PARTS}/{name}") for name in self._names(PARTS) if name.endswith(".parquet")]
        if not parts:
            return None
        table = pa.concat_tables(parts).sort_by("trial").combine_chunks()
        numbers = table["trial"].to_numpy()
        table = table.filter(pa.array(np.diff(numbers, prepend=-1) > 0))  # each trial once
        timing = table.select(["trial", *TIMING.names])
        return _flat(table.drop_columns(TIMING.names)), timing

    def write_tables(self, table: pa.Table, timing: pa.Table) -> None:
        """Write the tables of a complete study in place of its parts."""
        self.write(TIMES, parquet(timing))
        self.write(ROWS, parquet(table))
        with suppress(OSError):
            self._fs.delete_dir(self._full(PARTS))

    def part_names(self) -> list[str]:
        """Names of the part files."""
        return [name for name in self._names(PARTS) if name.endswith(".parquet")]

    def give_back(self) -> None:
        """Remove the folder, if nothing is in it."""
        if self._local is not None:
            with suppress(OSError):
                (self._local / _LOCK).unlink()
            with suppress(OSError):
                self._local.rmdir()

    def _table(self, name: str) -> pa.Table:
        try:
            return pq.read_table(io.BytesIO(self.read(name)))
        except (OSError, pa.ArrowException) as error:
            raise PlanError(f"{self.text}/{name} can't be read: {error}") from error

    def _names(self, folder: str) -> list[str]:
        selector = fs.FileSelector(self._full(folder), allow_not_found=True)
        return sorted(info.base_name for info in self._fs.get_file_info(selector))

    def _full(self, name: str) -> str:
        return f"{self._path}/{name}" if name else self._path


class RowWriter:
    """Writes rows into a study's folder, in part files.

    A part is written when rows have waited for a second, or for a hundredth of the time that this process has
    worked: a study that is killed loses no more than that, and has some hundred parts.

    Args:
        folder: the study's folder.
        trials: its trials.
        command: the command that repeats a trial, by number.
    """

    def __init__(self, folder: StudyFolder, trials: Trials, command: Mapping[int, str] | Any) -> None:
        self._folder, self._trials, self._command = folder, trials, command
        self._rows: list[TrialResult] = []
        self._number = max((int(name.split("-")[1].split(".")[0]) for name in folder.part_names()), default=0)
        self._schema = trials.study.schema.table_schema(trials[0].values)
        self._started_s: float | None = None
        self._written_s = 0.0
        self.bytes_written = 0

    def add(self, result: TrialResult) -> None:
        """Take a row. Files that are kept are written at once.

        Raises:
            MissionError: a file can't be written.
        """
        self._rows.append(result)
        for name, content in result.files:
            self._folder.write(f"{LOGS}/trial-{result.index:06d}/{name}", content)

    def tick(self, now_s: float) -> None:
        """Write a part, if it is time.

        Args:
            now_s: wall clock.

        Raises:
            MissionError: it can't be written.
        """
        if self._started_s is None:
            self._started_s = self._written_s = now_s
        if self._rows and now_s - self._written_s >= max(1.0, 0.01 * (now_s - self._started_s)):
            self.flush()
            self._written_s = now_s

    def flush(self) -> None:
        """Write all rows that were taken.

        Raises:
            MissionError: they can't be written; they are kept for the next attempt.
        """
        if not self._rows:
            return
        content = parquet(columns_of(self._rows, self._trials, self._schema, self._command))
        self._folder.write(f"{PARTS}/part-{self._number + 1:06d}.parquet", content)
        self._number += 1
        self.bytes_written += len(content)
        self._rows.clear()


def columns_of(rows: Sequence[TrialResult], trials: Trials, schema: pa.Schema, command: Any) -> pa.Table:
    """Rows as a table, with the columns of the timing at the end."""
    chosen = [trials[row.index] for row in rows]
    fields = list(trials.study.schema.kinds.items())
    none = (None,) * len(fields)
    values = [none if row.values is None else row.values for row in rows]
    columns: dict[str, list[Any]] = {
        "trial": [trial.index for trial in chosen],
        "cell": [trial.cell for trial in chosen],
        "run": [trial.run for trial in chosen],
        "seed": [trial.seed for trial in chosen],
        **{name: [trial.values[name] for trial in chosen] for name in chosen[0].values},
        "outcome": [row.outcome.value for row in rows],
        "error": [row.error for row in rows],
        **{
            name: [_mapped(row[k]) if kind == FIGURES else row[k] for row in values]
            for k, (name, kind) in enumerate(fields)
        },
        "command": [command(trial) for trial in chosen],
        "versions": [row.versions for row in rows],
        "wall_time_s": [row.wall_time_s for row in rows],
        "worker": [row.worker for row in rows],
        "attempts": [row.attempts for row in rows],
    }
    whole = pa.schema([*schema, *TIMING])
    return pa.table([pa.array(columns[f.name], f.type) for f in whole], schema=whole)


def _mapped(figures: Mapping[str, float] | None) -> list[tuple[str, float]] | None:
    return None if figures is None else list(figures.items())


def parquet(table: pa.Table) -> bytes:
    """A table as the bytes of a Parquet file; the same table gives the same bytes."""
    sink = io.BytesIO()
    pq.write_table(table, sink, compression="zstd")
    return sink.getvalue()


def _flat(table: pa.Table) -> pa.Table:
    """The table with a column for each of the numbers by name: `figures.key`."""
    columns: dict[str, Any] = {}
    for name in table.column_names:
        column = table[name]
        if not pa.types.is_map(column.type):
            columns[name] = column
            continue
        rows = [None if row is None else dict(row) for row in column.to_pylist()]
        for key in sorted({key for row in rows if row is not None for key in row}):
            numbers = [None if row is None else row.get(key) for row in rows]
            columns[f"{name}.{key}"] = pa.array(numbers, pa.float64())
    return pa.table(columns)


def lost_outcomes() -> tuple[str, ...]:
    """Outcomes of trials without a row."""
    return tuple(outcome.value for outcome in TrialOutcome if outcome is not TrialOutcome.DONE)


def _is_uri(place: Path | str) -> bool:
    return isinstance(place, str) and "://" in place
