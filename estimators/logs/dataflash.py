"""ArduPilot's onboard logs in binary form (.bin), and PX4's logs from before 2016: columns and MAVLink
messages.

pymavlink's DFReader finds the messages and their formats; each column is copied from the mapped file in one
step, with DFReader's multipliers. `dataflash_text` reads the text form.
"""

import contextlib
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from pymavlink import DFReader

from estimators.errors import LogError
from estimators.logs.dataflash_mapping import map_messages
from estimators.logs.dataflash_time import PX4_TIME, RawTable, stamp
from estimators.logs.mapped import Array, MappedSource, Part, Records, own_part
from estimators.logs.sdlog2_mapping import map_sdlog2

_HEADER: Final = 3
META: Final = frozenset({"FMT", "FMTU", "UNIT", "MULT"})
"""Formats that describe other formats."""


def open_dataflash(path: Path) -> MappedSource:
    """Open an ArduPilot .bin.

    Raises:
        LogError: it can't be read, or contains no message.
    """
    output = io.StringIO()
    try:
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(output):
            reader = DFReader.DFReader_binary(str(path))
    except Exception as error:  # DFReader may raise any exception for a damaged file
        raise LogError(
            f"{path} can't be read as an ArduPilot .bin: {type(error).__name__} {error}; is it whole?"
        ) from error
    data = np.frombuffer(reader.data_map, dtype=np.uint8)
    tables: list[RawTable] = []
    message_bytes = torn = 0
    for kind, layout in sorted(reader.formats.items()):
        starts = np.asarray(reader.offsets[kind], dtype=np.int64)
        whole = starts[starts + layout.len <= len(data)]
        torn += len(starts) - len(whole)
        message_bytes += len(whole) * layout.len
        if layout.name in META or not len(whole):
            continue
        columns = _columns(data, whole, layout)
        if columns:
            tables.append(RawTable(layout.name, kind, whole, columns, _units(layout)))
    if not tables:
        described = len(reader.formats) - 1
        raise LogError(
            f"{path} holds the descriptions of {described} formats, but no message: nothing was logged"
            if described
            else f"{path} begins like an ArduPilot .bin, but describes no format; is it whole?"
        )
    return dataflash_source(
        path,
        tables,
        bytes_by_kind={"messages": message_bytes, "junk": len(data) - message_bytes},
        drops={"torn_messages": torn},
        remarks={"formats": len(reader.formats), "complaints": output.getvalue().count("\n")},
    )


def dataflash_source(
    path: Path,
    raw: Sequence[RawTable],
    *,
    bytes_by_kind: Mapping[str, int],
    drops: Mapping[str, int],
    remarks: Mapping[str, int | str],
    banner: str = "",
) -> MappedSource:
    """Make a source from the tables of a file, with their times and the MAVLink messages derived from them.

    Args:
        path: the file.
        raw: its tables; not empty.
        bytes_by_kind, drops, remarks: figures for the report.
        banner: text about the firmware that is in the file outside its messages.
    """
    times = stamp(raw)
    tables: dict[str, Records] = {}
    own: list[Part] = []
    for table, time_us in zip(raw, times.time_us, strict=True):
        tables[table.name] = Records(time_us, table.columns)
        own.append(own_part(table.name, -1 - table.number, time_us, table.columns, table.units))
    mapped = (map_sdlog2 if times.clock == PX4_TIME else map_messages)(tables, times.unix_offset_us, banner)
    return MappedSource(
        path,
        size_bytes=sum(bytes_by_kind.values()),
        format="bin",
        parts=_without_namesakes(own, mapped),
        unix_offset_us=times.unix_offset_us,
        bytes_by_kind=bytes_by_kind,
        drops={**drops, "implausible_times": times.implausible},
        remarks={**remarks, "times": times.clock},
    )


def _columns(data: Array, starts: Array, layout: Any) -> dict[str, Array]:
    """Fields of all messages of a format, with DFReader's multipliers."""
    dtype = np.dtype(
        [(f"f{index}", _element(code)) for index, code in enumerate(layout.msg_fmts[: len(layout.columns)])]
    )
    size = min(dtype.itemsize, layout.len - _HEADER)
    if not size or size < dtype.itemsize:  # no fields, or a format with fewer bytes than its fields need
        return {}
    rows = data[starts[:, None] + np.arange(_HEADER, _HEADER + dtype.itemsize)]
    records = np.ascontiguousarray(rows).view(dtype).reshape(-1)
    columns: dict[str, Array] = {}
    for index, (name, code) in enumerate(zip(layout.columns, layout.msg_fmts, strict=False)):
        column = np.ascontiguousarray(records[f"f{index}"])
        multiplier = layout.msg_mults[index]
        if multiplier is not None:
            column = column / (1.0 / multiplier)  # computed as in DFReader, for identical bits
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
    """Drop tables of the file that have the name of a derived MAVLink message (AHRS2, RPM, ...)."""
    names = {part.description.name for part in mapped}
    return [part for part in own if part.description.name not in names] + mapped
