"""ArduPilot's onboard logs in binary form (.bin), and PX4's logs from before 2016: columns and MAVLink
messages.

`dataflash_scan` finds the messages and their formats; `dataflash_text` reads the text form.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from estimators.errors import LogError
from estimators.logs.dataflash_mapping import map_messages
from estimators.logs.dataflash_scan import META, decoded, scan
from estimators.logs.dataflash_time import PX4_TIME, RawTable, stamp
from estimators.logs.mapped import MappedSource, Part, Records, mappable, own_part
from estimators.logs.mapped_file import mapped_bytes
from estimators.logs.sdlog2_mapping import map_sdlog2

_TEXTS: Final = frozenset({"Name", "Message", "Mode"})
"""Columns that are texts where they are used; modes are names in some logs, and numbers in others."""


def open_dataflash(path: Path) -> MappedSource:
    """Open an ArduPilot .bin.

    Raises:
        LogError: it can't be read, or contains no message.
    """
    data = mapped_bytes(path)
    found = scan(data)
    tables = [
        RawTable(layout.name, layout.number, layout.starts, columns, layout.units)
        for layout in found.formats
        if layout.name not in META and (columns := decoded(data, layout))
    ]
    if not tables:
        described = found.described - 1
        raise LogError(
            f"{path} holds the descriptions of {described} formats, but no message: nothing was logged"
            if described
            else f"{path} begins like an ArduPilot .bin, but describes no format; is it whole?"
        )
    return dataflash_source(
        path,
        tables,
        bytes_by_kind={"messages": found.message_bytes, "junk": len(data) - found.message_bytes},
        drops={"torn_messages": int(found.torn), "damaged_formats": found.damaged},
        remarks={"formats": found.described},
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
        texts = _TEXTS if table.columns.get("Mode", time_us).dtype.kind == "S" else _TEXTS - {"Mode"}
        tables[table.name] = mappable(Records(time_us, table.columns), texts=texts, widths={})
        own.append(own_part(table.name, -1 - table.number, time_us, table.columns, table.units))
    convert = map_sdlog2 if times.clock == PX4_TIME else map_messages
    with np.errstate(all="ignore"):  # of damaged values, which may be infinite
        mapped = convert(tables, times.unix_offset_us, banner)
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


def _without_namesakes(own: list[Part], mapped: list[Part]) -> list[Part]:
    """Drop tables of the file that have the name of a derived MAVLink message (AHRS2, RPM, ...)."""
    names = {part.description.name for part in mapped}
    return [part for part in own if part.description.name not in names] + mapped
