"""Rows of a study: the columns of a row's dataclass, the outcome of a trial, and both as Arrow tables."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum, StrEnum
from types import MappingProxyType
from typing import Any, Final, Self, get_origin, get_type_hints

import pyarrow as pa

from flightsim.foundation.options import without_none
from missions.errors import PlanError
from missions.studies.design import Value

__all__ = ["FIGURES", "NUMBERS", "RowSchema", "TrialOutcome", "TrialResult"]


class TrialOutcome(StrEnum):
    """How a trial ended."""

    DONE = "done"
    """It has a row."""
    FAILED = "failed"
    """It raised an error."""
    TIMED_OUT = "timed out"
    """It did not end within the time limit."""
    LOST = "lost"
    """Its worker process was killed, in each of the attempts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialResult:
    """The outcome of one trial.

    Attributes:
        index: number of the trial.
        outcome: how it ended.
        error: reason why there is no row; "" otherwise.
        values: values of the row in the order of its fields; None: there is no row.
        versions: the software of the worker.
        wall_time_s: time that the trial took.
        worker: host and process that computed it.
        attempts: how often it was begun.
        files: files that are kept, by name in the trial's folder.
    """

    index: int
    outcome: TrialOutcome
    error: str = ""
    values: tuple[Any, ...] | None = None
    versions: str = ""
    wall_time_s: float = 0.0
    worker: str = ""
    attempts: int = 1
    files: tuple[tuple[str, bytes], ...] = ()


NUMBERS: Final = "numbers"
FIGURES: Final = "figures"
Kind = type | str
_ARROW: Final[Mapping[Kind, pa.DataType]] = MappingProxyType(
    {
        bool: pa.bool_(),
        int: pa.int64(),
        float: pa.float64(),
        str: pa.string(),
        NUMBERS: pa.list_(pa.float64()),
        FIGURES: pa.map_(pa.string(), pa.float64()),
    }
)
RESERVED: Final = ("trial", "cell", "run", "seed", "outcome", "error", "command", "versions")
TIMING: Final = pa.schema([("wall_time_s", pa.float64()), ("worker", pa.string()), ("attempts", pa.int64())])
"""Columns that differ from one execution to the next."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RowSchema:
    """The columns of a row.

    Attributes:
        kinds: kind of each field: bool, int, float, str, `NUMBERS` (a sequence of numbers) or `FIGURES`
            (numbers by name).
    """

    kinds: Mapping[str, Kind]

    @classmethod
    def of(cls, row: type) -> Self:
        """The columns of a dataclass.

        Raises:
            PlanError: it is no dataclass, or a field is of a type that has no column.
        """
        if not (isinstance(row, type) and is_dataclass(row)):
            raise PlanError(f"row {row!r} is not a dataclass; give the class of the trial's result")
        hints = get_type_hints(row)
        kinds = {f.name: _kind_of(row, f.name, hints[f.name]) for f in fields(row)}
        taken = sorted(set(kinds) & {*RESERVED, *TIMING.names})
        if taken:
            raise PlanError(
                f"{row.__name__}.{', '.join(taken)}: the study has a column of this name; rename it"
            )
        return cls(kinds=MappingProxyType(kinds))

    @property
    def names(self) -> frozenset[str]:
        """Names of the columns."""
        return frozenset(self.kinds)

    def text(self) -> list[list[str]]:
        """Names and kinds as text."""
        return [[name, kind if isinstance(kind, str) else kind.__name__] for name, kind in self.kinds.items()]

    def values(self, row: Any) -> tuple[Any, ...]:
        """The values of a row as plain Python, in the order of the fields.

        Raises:
            TypeError: it is not a row of the study, or a value is not of its field's type.
        """
        found = []
        for name, kind in self.kinds.items():
            if not hasattr(row, name):
                raise TypeError(f"the trial returned {type(row).__name__}, which has no field {name}")
            value = getattr(row, name)
            try:
                found.append(None if value is None else _plain(kind, value))
            except (TypeError, ValueError) as error:
                expected = kind if isinstance(kind, str) else kind.__name__
                raise TypeError(f"{name} = {value!r} is not accepted: {expected} is") from error
        return tuple(found)

    def table_schema(self, parameters: Mapping[str, Value]) -> pa.Schema:
        """Columns of the study's table without the timing.

        Args:
            parameters: values of one trial, for their types.
        """
        return pa.schema(
            [
                ("trial", pa.int64()),
                ("cell", pa.int64()),
                ("run", pa.int64()),
                ("seed", pa.int64()),
                *((name, _ARROW[type(value)]) for name, value in parameters.items()),
                ("outcome", pa.string()),
                ("error", pa.string()),
                *((name, _ARROW[kind]) for name, kind in self.kinds.items()),
                ("command", pa.string()),
                ("versions", pa.string()),
            ]
        )


def _kind_of(row: type, name: str, hint: Any) -> Kind:
    hint, _ = without_none(hint)
    origin = get_origin(hint)
    if isinstance(hint, type) and origin is None:
        if issubclass(hint, Enum):
            return str
        for kind in (bool, int, float, str):
            if issubclass(hint, kind):
                return kind
    if origin is not None and isinstance(origin, type):
        if issubclass(origin, Mapping):
            return FIGURES
        if issubclass(origin, Sequence):
            return NUMBERS
    raise PlanError(
        f"{row.__name__}.{name}: {hint} has no column; accepted are bool, int, float, str, each with | None, "
        "tuple[float, ...] and Mapping[str, float]"
    )


def _plain(kind: Kind, value: Any) -> Any:
    if kind == NUMBERS:
        return [float(number) for number in value]
    if kind == FIGURES:
        return {str(name): None if number is None else float(number) for name, number in value.items()}
    if kind is int and int(value) != value:
        raise TypeError("it has a fraction")
    assert isinstance(kind, type)
    return kind(value)
