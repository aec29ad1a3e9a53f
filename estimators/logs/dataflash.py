"""ArduPilot's onboard logs (.bin): read with pymavlink's DFReader, decoded as columns.

DFReader finds the messages and their formats; the columns are cut out of the mapped file in one piece each,
with DFReader's multipliers.
"""

import contextlib
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np
from pymavlink import DFReader

from estimators.logs.dataflash_mapping import map_messages
from estimators.logs.errors import LogError
from estimators.logs.mapped import Array, MappedSource, Part, Records, own_part

_HEADER: Final = 3
_META: Final = frozenset({"FMT", "FMTU", "UNIT", "MULT"})
_TIME: Final = "TimeUS"
_MAX_TIME_US: Final = 10**13


def open_dataflash(path: Path) -> MappedSource:
    """Open an ArduPilot .bin.

    Raises:
        LogError: it can't be read, or holds no message with a time.
    """
    complaints = io.StringIO()
    try:
        with contextlib.redirect_stdout(complaints), contextlib.redirect_stderr(complaints):
            reader = DFReader.DFReader_binary(str(path))
    except Exception as error:  # DFReader raises whatever a damaged file leads it to
        raise LogError(
            f"{path} can't be read as an ArduPilot .bin: {type(error).__name__} {error}; is it whole?"
        ) from error
    data = np.frombuffer(reader.data_map, dtype=np.uint8)
    tables: dict[str, Records] = {}
    parts: list[Part] = []
    message_bytes = torn = 0
    for kind, layout in sorted(reader.formats.items()):
        starts = np.asarray(reader.offsets[kind], dtype=np.int64)
        whole = starts[starts + layout.len <= len(data)]
        torn += len(starts) - len(whole)
        message_bytes += len(whole) * layout.len
        if layout.name in _META or not len(whole):
            continue
        columns = _columns(data, whole, layout)
        times = columns.get(_TIME)
        if times is None or times.dtype.kind not in "iu":
            continue
        times = times.astype(np.int64)
        good = (times >= 0) & (times < _MAX_TIME_US)
        columns = {name: column[good] for name, column in columns.items()}
        times = times[good]
        if not len(times):
            continue
        tables[layout.name] = Records(times, columns)
        parts.append(own_part(layout.name, -1 - kind, times, columns, _units(layout)))
    if not parts:
        raise LogError(f"{path} holds no message with a time (TimeUS); is it an ArduPilot .bin, and whole?")
    timebase_s = float(reader.clock.timebase) if reader.clock is not None else 0.0
    offset_us = round(timebase_s * 1e6) if timebase_s > 0.0 else None
    parts = _without_namesakes(parts, map_messages(tables, offset_us))
    return MappedSource(
        path,
        size_bytes=len(data),
        format="bin",
        parts=parts,
        unix_offset_us=offset_us,
        bytes_by_kind={"messages": message_bytes, "junk": len(data) - message_bytes},
        drops={"torn_messages": torn},
        remarks={"formats": len(reader.formats), "complaints": complaints.getvalue().count("\n")},
    )


def _columns(data: Array, starts: Array, layout: Any) -> dict[str, Array]:
    """Fields of all messages of a format, with DFReader's multipliers."""
    dtype = np.dtype(
        [(f"f{index}", _element(code)) for index, code in enumerate(layout.msg_fmts[: len(layout.columns)])]
    )
    size = min(dtype.itemsize, layout.len - _HEADER)
    if size < dtype.itemsize:  # a format that says less bytes than its fields need
        return {}
    rows = data[starts[:, None] + np.arange(_HEADER, _HEADER + dtype.itemsize)]
    records = np.ascontiguousarray(rows).view(dtype).reshape(-1)
    columns: dict[str, Array] = {}
    for index, (name, code) in enumerate(zip(layout.columns, layout.msg_fmts, strict=False)):
        column = np.ascontiguousarray(records[f"f{index}"])
        multiplier = layout.msg_mults[index]
        if multiplier is not None:
            column = column / (1.0 / multiplier)  # as DFReader does, for the last bit
        elif code == "g":
            column = column.astype(np.float32)
        if name and name.isidentifier() and not name.startswith("_"):
            columns[name] = column
    return columns


def _element(code: str) -> Any:
    if code == "a":
        return np.dtype(("<i2", (32,)))
    form = DFReader.FORMAT_TO_STRUCT[code][0]
    return np.dtype(f"S{form[:-1]}") if form.endswith("s") else np.dtype(f"<{form}")


def _units(layout: Any) -> Mapping[str, str]:
    units = layout.units or []
    return {name: unit for name, unit in zip(layout.columns, units, strict=False) if unit}


def _without_namesakes(own: list[Part], mapped: list[Part]) -> list[Part]:
    """What has the name of a MAVLink message that was made (AHRS2, RPM, ...) yields to it."""
    names = {part.description.name for part in mapped}
    return [part for part in own if part.description.name not in names] + mapped
