"""Sources of MAVLink messages made from logs that are not MAVLink streams.

Every table of the file stays readable under its own name. The data that estimators need are also available as
MAVLink messages, in MAVLink's units.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators.logs.columns import Columns, field_dtype
from estimators.logs.dialect import Description, Dialect, describe, load_dialect
from estimators.logs.source import LogSource, Positions, Stream
from estimators.logs.xml_definitions import FieldText

Array = NDArray[Any]

SYSTEM_ID: Final = 1
"""System id of a flight controller's own log, which contains one vehicle and no id."""

_SECOND_US: Final = 1_000_000
_PAUSE_S: Final = 10

_TYPES: Final = MappingProxyType(
    {
        "u1": "uint8_t",
        "i1": "int8_t",
        "u2": "uint16_t",
        "i2": "int16_t",
        "u4": "uint32_t",
        "i4": "int32_t",
        "u8": "uint64_t",
        "i8": "int64_t",
        "f4": "float",
        "f8": "double",
    }
)


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """Messages of one kind, in the order of their times.

    Attributes:
        description: description of the message.
        time_us: (n,) vehicle time.
        columns: fields by name, with the types of the definition.
    """

    description: Description
    time_us: NDArray[np.int64]
    columns: Mapping[str, Array]


@dataclass(frozen=True, slots=True, eq=False)
class Records:
    """All messages of one kind and instance in a file.

    Attributes:
        time_us: (n,) vehicle time.
        columns: fields by name; arrays are (n, length).
    """

    time_us: Array
    columns: Mapping[str, Array]

    def has(self, *fields: str) -> bool:
        """Whether all these fields exist."""
        return all(field in self.columns for field in fields)

    def where(self, rows: Array) -> "Records":
        """The records of the given rows."""
        return Records(self.time_us[rows], {name: column[rows] for name, column in self.columns.items()})

    def instance(self, field: str, number: int) -> "Records":
        """The records of one instance; all records when there is no such field."""
        return self.where(self.columns[field] == number) if field in self.columns else self


def mappable(records: Records, *, texts: Collection[str], widths: Mapping[str, int]) -> Records:
    """The columns from which messages can be made; others, as a damaged description makes them, are left out.

    Args:
        records: a table of the file.
        texts: names of columns that are texts.
        widths: length of the columns that are arrays, by name; all others are numbers.
    """
    fitting = {}
    for name, column in records.columns.items():
        length = column.shape[1] if column.ndim == 2 else None
        if length == widths.get(name) and (column.dtype.kind == "S") == (name in texts):
            fitting[name] = column
    return Records(records.time_us, fitting)


def value_at(records: Records | None, field: str, at_us: Array, before: float = 0.0) -> Array:
    """The newest value of a field at each time; `before` until the first value, and when the field does not
    exist.
    """
    if records is None or not records.has(field):
        return np.full(len(at_us), before)
    return newest(records.time_us, records.columns[field], at_us, before)


def each_second(found: Iterable[Records]) -> Array:
    """Times from the first message of all records to the last, in steps of a second; none in pauses of more
    than ten seconds without any message, which a damaged time can make as long as months.
    """
    times = [records.time_us for records in found if len(records.time_us)]
    first_us = min(int(times_us.min()) for times_us in times)
    seconds = [(times_us - first_us) // _SECOND_US for times_us in times]
    busy = np.unique(np.concatenate([one[np.flatnonzero(np.diff(one, prepend=-1))] for one in seconds]))
    near = np.unique(busy[:, None] + np.arange(_PAUSE_S + 1))
    found_us: Array = first_us + near[near <= busy[-1]] * _SECOND_US
    return found_us


def mavlink_part(name: str, time_us: Array, **columns: Any) -> Part:
    """Make MAVLink messages from columns; fields that are not specified are 0, as on the wire.

    Args:
        name: name of the message.
        time_us: (n,) vehicle time; the message's own time stamp is set from it.
        columns: wire values by field, (n,), (n, length) for arrays, or one value for all messages. Integers
            are rounded and clipped to the range of the field; NaN becomes 0 in integer fields.
    """
    described = load_dialect().find(name)
    times = np.ascontiguousarray(time_us, dtype=np.int64)
    given = dict(columns)
    names = described.definition.field_names
    if "time_boot_ms" in names:
        given.setdefault("time_boot_ms", times // 1000)
    elif "time_usec" in names:
        given.setdefault("time_usec", times)
    made = {}
    for field in described.definition.wire_fields:
        dtype = field_dtype(field)
        column = np.zeros(len(times), dtype=dtype)
        if field.name in given:
            column[...] = _fitted(given.pop(field.name), column.dtype)
        made[field.name] = column
    if given:
        raise ValueError(f"{name} has no field {', '.join(sorted(given))}")
    return _sorted(Part(described, times, made))


def own_part(
    name: str, number: int, time_us: Array, columns: Mapping[str, Array], units: Mapping[str, str]
) -> Part:
    """A table of the file under its own name.

    Args:
        name: name of the table.
        number: negative and different for each table, so that it is not the id of a MAVLink message.
        time_us: (n,) vehicle time.
        columns: fields by name.
        units: units of the fields that have one.
    """
    fields = [_layout(field, column) for field, column in columns.items()]
    made = {field: np.ascontiguousarray(column) for field, column in columns.items()}
    return _sorted(Part(describe(number, name, fields, units), np.asarray(time_us, np.int64), made))


def newest(times_us: Array, values: Array, at_us: Array, before: float = 0.0) -> Array:
    """The newest of `values` at each time; `before` until the first."""
    if not len(times_us):
        return np.full(len(at_us), before)
    rows = np.searchsorted(times_us, at_us, side="right") - 1
    found: Array = np.where(rows >= 0, values[np.maximum(rows, 0)], before)
    return found


class MappedSource(LogSource):
    """Messages of a flight controller's own log, sorted by time.

    Args:
        path, size_bytes, format: the file.
        parts: the messages found; at least one in total.
        unix_offset_us: Unix time of vehicle time 0; None: not known.
        bytes_by_kind: the bytes of the file, by the use of each.
        drops, remarks: figures for the report.
    """

    def __init__(
        self,
        path: Path,
        *,
        size_bytes: int,
        format: str,
        parts: Sequence[Part],
        unix_offset_us: int | None,
        bytes_by_kind: Mapping[str, int],
        drops: Mapping[str, int],
        remarks: Mapping[str, int | str],
    ) -> None:
        self.path, self.size_bytes, self.format = path, size_bytes, format
        self._bytes_by_kind, self._drops, self._remarks = bytes_by_kind, drops, remarks
        self._unix_offset_us = unix_offset_us
        parts = [part for part in parts if len(part.time_us)]
        base = load_dialect()
        own = {part.description.definition.message_id: part.description for part in parts}
        self.dialect = Dialect(format, MappingProxyType(dict(base.messages) | own))
        times = np.concatenate([part.time_us for part in parts])
        sorting = np.argsort(times, kind="stable")
        places = np.empty(len(times), dtype=np.int64)
        places[sorting] = np.arange(len(times))
        self.count = len(times)
        self._time_us = times[sorting]
        self._time_us.flags.writeable = False
        ends = np.cumsum([len(part.time_us) for part in parts]).tolist()
        found = []
        for part, end in zip(parts, ends, strict=True):
            order = places[end - len(part.time_us) : end]
            found.append((Stream(part.description, SYSTEM_ID, AUTOPILOT_COMPONENT, order), part.columns))
        found.sort(key=lambda item: int(item[0].order[0]))
        self.streams = tuple(stream for stream, _ in found)
        self._columns = {id(stream): columns for stream, columns in found}

    @property
    def time_us(self) -> NDArray[np.int64]:
        """Vehicle time of every message."""
        return self._time_us

    @property
    def boot_starts(self) -> Mapping[int, NDArray[np.int64]]:
        """Empty: a flight controller begins a new file with each boot."""
        return {}

    def log_time_us(self, order: Positions) -> NDArray[np.int64]:
        """Unix times, when a GPS has reported the date; otherwise 0."""
        if self._unix_offset_us is None:
            return np.zeros(len(order), dtype=np.int64)
        return self._time_us[order] + self._unix_offset_us

    def columns(self, stream: Stream, rows: slice | NDArray[np.int64]) -> Columns:
        """Fields of some messages of a stream."""
        return {name: column[rows] for name, column in self._columns[id(stream)].items()}

    @property
    def bytes_by_kind(self) -> Mapping[str, int]:
        """The bytes of the file, by the use of each."""
        return self._bytes_by_kind

    @property
    def drops(self) -> Mapping[str, int]:
        """Number of dropped items, by reason."""
        return self._drops

    @property
    def remarks(self) -> Mapping[str, int | str]:
        """Additional figures."""
        return self._remarks


def _fitted(values: Any, dtype: np.dtype[Any]) -> Array:
    column = np.asarray(values)
    if dtype.kind not in "iu" or column.dtype.kind == "S":
        return column
    if column.dtype.kind == "f":
        wide = column.astype(np.float64)  # in single precision the limits of int32 are beyond it
        column = np.rint(np.nan_to_num(wide, nan=0.0, posinf=0.0, neginf=0.0))
    limits = np.iinfo(dtype)
    if column.dtype.kind == "f" and dtype.itemsize == 8:
        return np.clip(column, max(limits.min, -(2.0**62)), 2.0**62).astype(dtype)
    return np.clip(column, limits.min, limits.max).astype(dtype)


def _sorted(part: Part) -> Part:
    if not len(part.time_us) or not np.any(np.diff(part.time_us) < 0):
        return part
    sorting = np.argsort(part.time_us, kind="stable")
    columns = {name: column[sorting] for name, column in part.columns.items()}
    return Part(part.description, part.time_us[sorting], columns)


def _layout(name: str, column: Array) -> FieldText:
    if column.dtype.kind == "S":
        return FieldText(name, "char", column.dtype.itemsize)
    return FieldText(name, _TYPES[column.dtype.str[1:]], column.shape[1] if column.ndim == 2 else 0)
