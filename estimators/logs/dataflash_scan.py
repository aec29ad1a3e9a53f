"""Finds the messages of an ArduPilot .bin, and the formats that describe them, in one compiled pass.

A message begins with A3 95 and the number of its format; FMT messages give the length and the fields of each
format (ArduPilot's `AP_Logger`). There is no checksum. After damage, the next message is the first one at any
later position whose format is known. A damaged description costs its own messages, and no others.
"""

import re
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pymavlink import DFReader

from flightsim.foundation.kernels import kernel

Array = NDArray[Any]

HEADER: Final = 3
META: Final = frozenset({"FMT", "FMTU", "UNIT", "MULT"})
"""Formats that describe other formats."""

_HEAD_1, _HEAD_2 = 0xA3, 0x95
_FMT: Final = 0x80
_FMT_SIZE: Final = 89
_CAPACITY: Final = 1 << 20
_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,3}")
_Description = tuple[str, str, tuple[str, ...]]
"""Name of a format, codes and names of its fields."""
_CODES: Final = frozenset(DFReader.FORMAT_TO_STRUCT)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Format:
    """One format of a log, and where its messages are.

    Attributes:
        number, name: of the format.
        size: bytes of a message, with its header.
        codes: types of its fields, one character each.
        columns: names of its fields.
        starts: (n,) positions of its messages.
        units: units of the fields that have one, by name.
    """

    number: int
    name: str
    size: int
    codes: str
    columns: tuple[str, ...]
    starts: NDArray[np.int64]
    units: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scan:
    """What a log contains.

    Attributes:
        formats: those that are described as they should be, by number.
        described: number of descriptions.
        damaged: number of formats without a usable description; their messages are left out.
        message_bytes: bytes of all messages, also of those that are left out.
        torn: whether the file ends within a message.
    """

    formats: tuple[Format, ...]
    described: int
    damaged: int
    message_bytes: int
    torn: bool


def scan(data: NDArray[np.uint8]) -> Scan:
    """Find the messages of a log.

    Args:
        data: bytes of the file.
    """
    sizes = np.zeros(256, dtype=np.int64)
    sizes[_FMT] = _FMT_SIZE
    starts, kinds, at, torn = [], [], 0, False
    while at < len(data):
        some = np.empty(_CAPACITY, dtype=np.int64)
        of_kind = np.empty(_CAPACITY, dtype=np.uint8)
        at, found, ended = _scan_some(data, at, sizes, some, of_kind)
        torn |= ended
        starts.append(some[:found].copy())
        kinds.append(of_kind[:found].copy())
    all_starts, all_kinds = np.concatenate(starts), np.concatenate(kinds)
    counts = np.bincount(all_kinds, minlength=256)
    by_kind = np.split(all_starts[np.argsort(all_kinds, kind="stable")], np.cumsum(counts)[:-1])
    described = _described(data, by_kind[_FMT])
    formats, damaged = [], 0
    names: dict[str, int] = {}
    for number in sorted(np.flatnonzero(counts), key=lambda n: int(counts[n]), reverse=True):
        made = described.get(int(number))
        if made is None or made[0] in names:  # damage makes names alike; the one with more messages is right
            damaged += 1
            continue
        name, codes, columns = made
        names[name] = int(number)
        formats.append(
            Format(
                number=int(number),
                name=name,
                size=int(sizes[number]),
                codes=codes,
                columns=columns,
                starts=by_kind[number],
            )
        )
    formats.sort(key=lambda item: item.number)
    return Scan(
        formats=tuple(_with_units(data, formats)),
        described=len(described),
        damaged=damaged,
        message_bytes=int(np.dot(counts, sizes)),
        torn=torn,
    )


def decoded(data: NDArray[np.uint8], layout: Format) -> dict[str, Array]:
    """Fields of all messages of a format, with DFReader's multipliers."""
    codes = layout.codes[: len(layout.columns)]
    dtype = np.dtype([(f"f{index}", _element(code)) for index, code in enumerate(codes)])
    if not dtype.itemsize or dtype.itemsize > layout.size - HEADER:  # fewer bytes than the fields need
        return {}
    rows = np.empty((len(layout.starts), dtype.itemsize), dtype=np.uint8)
    _gather(data, layout.starts, rows)
    records = rows.view(dtype).reshape(-1)
    columns: dict[str, Array] = {}
    for index, (name, code) in enumerate(zip(layout.columns, codes, strict=False)):
        column = np.ascontiguousarray(records[f"f{index}"])
        multiplier = DFReader.FORMAT_TO_STRUCT[code][1]
        if multiplier is not None:
            column = column / (1.0 / multiplier)  # computed as in DFReader, for identical bits
        elif code == "g":
            column = column.astype(np.float32)
        if name.isidentifier() and name.isascii() and not name.startswith("_"):
            columns[name] = column
    return columns


def _described(data: NDArray[np.uint8], starts: NDArray[np.int64]) -> dict[int, _Description]:
    """Descriptions of formats by number; the first usable one counts."""
    found: dict[int, _Description] = {_FMT: ("FMT", "BBnNZ", ("Type", "Length", "Name", "Format", "Columns"))}
    for start in starts.tolist():
        number, _, *texts = struct.unpack("<BB4s16s64s", data[start + HEADER : start + _FMT_SIZE].tobytes())
        name, codes, columns = (text.partition(b"\0")[0].decode("ascii", "replace") for text in texts)
        if number not in found and _NAME.fullmatch(name) and _CODES.issuperset(codes):
            found[number] = name, codes, tuple(columns.split(",")) if columns else ()
    return found


def _with_units(data: NDArray[np.uint8], formats: list[Format]) -> list[Format]:
    """The formats with the units that FMTU gives them, by the tables UNIT and MULT."""
    tables = {item.name: decoded(data, item) for item in formats if item.name in META}
    described = tables.get("FMTU", {})
    if not {"FmtType", "UnitIds"} <= described.keys():
        return formats
    labels = _lookup(tables.get("UNIT", {}), "Label")
    multipliers = _lookup(tables.get("MULT", {}), "Mult")
    of_number: dict[int, tuple[bytes, bytes]] = {}
    nothing = [b""] * len(described["FmtType"])
    mult_ids = described["MultIds"].tolist() if "MultIds" in described else nothing
    for number, units, mults in zip(
        described["FmtType"].tolist(), described["UnitIds"].tolist(), mult_ids, strict=True
    ):
        of_number[number] = units, mults
    return [
        replace(item, units=_units(item, *of_number[item.number], labels, multipliers))
        if item.number in of_number
        else item
        for item in formats
    ]


def _lookup(table: Mapping[str, Array], value: str) -> dict[int, Any]:
    """The values of UNIT or MULT by their ids."""
    if not {"Id", value} <= table.keys() or table["Id"].dtype.kind not in "iu":
        return {}
    ids = table["Id"].astype(np.int64) & 0xFF  # letters, of which a log has signed bytes
    return dict(zip(ids.tolist(), table[value].tolist(), strict=True))


def _units(
    layout: Format, unit_ids: Any, mult_ids: Any, labels: Mapping[int, Any], multipliers: Mapping[int, Any]
) -> dict[str, str]:
    """Units by field, as DFReader makes them: a prefix where the values are not scaled by their type."""
    if not (isinstance(unit_ids, bytes) and isinstance(mult_ids, bytes)):
        return {}
    units = {}
    for index, (name, code) in enumerate(zip(layout.columns, layout.codes, strict=False)):
        label = labels.get(unit_ids[index]) if index < len(unit_ids) else None
        unit = label.decode("utf-8", "replace") if isinstance(label, bytes) else ""
        multiplier = multipliers.get(mult_ids[index]) if index < len(mult_ids) else None
        if unit and isinstance(multiplier, float) and DFReader.FORMAT_TO_STRUCT[code][1] is None:
            exact = float(f"{multiplier:.7g}")  # single precision in the file
            unit = DFReader.MULT_TO_PREFIX.get(exact, f"{exact:.4g} ") + unit
        if unit:
            units[name] = unit
    return units


def _element(code: str) -> Any:
    if code == "a":
        return np.dtype(("<i2", (32,)))
    form = DFReader.FORMAT_TO_STRUCT[code][0]
    return np.dtype(f"S{form[:-1]}") if form.endswith("s") else np.dtype(f"<{form}")


@kernel
def _gather(data: NDArray[np.uint8], starts: NDArray[np.int64], rows: NDArray[np.uint8]) -> None:
    for row in range(len(starts)):
        for byte in range(rows.shape[1]):
            rows[row, byte] = data[starts[row] + HEADER + byte]


@kernel
def _scan_some(
    data: NDArray[np.uint8],
    at: int,
    sizes: NDArray[np.int64],
    starts: NDArray[np.int64],
    kinds: NDArray[np.uint8],
) -> tuple[int, int, bool]:
    """Continue at a position until the arrays are full or the file ends.

    Returns:
        The position, the number of messages found, and whether the file ends within a message.
    """
    found = 0
    torn = False
    end = len(data)
    while at + HEADER <= end and found < len(starts):
        kind = data[at + 2]
        size = sizes[kind]
        if data[at] != _HEAD_1 or data[at + 1] != _HEAD_2 or size == 0:
            at += 1
            continue
        if at + size > end:
            torn = True
            at += 1
            continue
        if kind == _FMT and sizes[data[at + 3]] == 0 and data[at + 4] >= HEADER:
            sizes[data[at + 3]] = data[at + 4]
        starts[found] = at
        kinds[found] = kind
        found += 1
        at += size
    return (at if found == len(starts) else end), found, torn
