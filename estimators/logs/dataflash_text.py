"""ArduPilot's onboard logs in their text form (.log), as ground stations write them."""

from pathlib import Path
from typing import Any, Final

import numpy as np
from pymavlink import DFReader

from estimators.errors import LogError
from estimators.logs.ardupilot_firmware import firmware_of
from estimators.logs.dataflash import dataflash_source
from estimators.logs.dataflash_scan import META
from estimators.logs.dataflash_time import RawTable
from estimators.logs.mapped import Array, MappedSource

_TEXT_CODES: Final = frozenset("nNZ")
_NAMED_CODES: Final = frozenset("M")
"""Codes of flight modes: names in some logs, numbers in others."""
_FMT: Final = "FMT"
_FMT_FIELDS: Final = 6


def looks_like_text(head: bytes) -> bool:
    """Whether the beginning of a file is that of a text log, which has a line that describes a format."""
    return b"\0" not in head and any(line.startswith(b"FMT,") for line in head.splitlines())


def open_text(path: Path) -> MappedSource:
    """Open an ArduPilot log in text form.

    Raises:
        LogError: it can't be read, or contains no message.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise LogError(f"can't read {path}: {error.strerror}; give the path of a log") from error
    formats: dict[str, tuple[int, str, list[str]]] = {}
    rows: dict[str, list[list[str]]] = {}
    positions: dict[str, list[int]] = {}
    at = message_bytes = short = 0
    banner = ""
    for line in data.splitlines(keepends=True):
        start, at = at, at + len(line)
        fields = [field.strip() for field in line.decode("utf-8", "replace").strip().split(",")]
        name = fields[0]
        if name == _FMT:
            if len(fields) >= _FMT_FIELDS and fields[1].isdigit():
                described = int(fields[1]), fields[4], [field for field in fields[5:] if field]
                formats[fields[3]] = described
                message_bytes += len(line)
            continue
        if name not in formats:
            if not banner and firmware_of([line.decode("utf-8", "replace")]).text:
                banner = line.decode("utf-8", "replace").strip()
            continue
        wanted = len(formats[name][1])
        if len(fields) - 1 < wanted:
            short += 1
            continue
        # A text may contain commas; it is the last field.
        values = [*fields[1:wanted], ",".join(fields[wanted:])] if wanted else []
        rows.setdefault(name, []).append(values)
        positions.setdefault(name, []).append(start)
        message_bytes += len(line)
    tables = []
    for name, found in rows.items():
        number, codes, columns = formats[name]
        made = _columns(found, codes, columns)
        if name not in META and made:
            places = np.array(positions[name], dtype=np.int64)
            tables.append(RawTable(name, number, places, made, {}))
    if not tables:
        raise LogError(
            f"{path} describes {len(formats)} formats as an ArduPilot text log does, but holds no message"
        )
    return dataflash_source(
        path,
        tables,
        bytes_by_kind={"messages": message_bytes, "junk": len(data) - message_bytes},
        drops={"short_lines": short},
        remarks={"formats": len(formats), "form": "text"},
        banner=banner,
    )


def _columns(rows: list[list[str]], codes: str, names: list[str]) -> dict[str, Array]:
    """Fields of all messages of a format; in text logs the multipliers are already applied."""
    columns = {}
    for index, (name, code) in enumerate(zip(names, codes, strict=False)):
        if not name.isidentifier() or name.startswith("_"):
            continue
        columns[name] = _column([row[index] for row in rows], code)
    return columns


def _column(texts: list[str], code: str) -> Array:
    if code in _TEXT_CODES:
        return _strings(texts)
    numbers = np.array([_number(text) for text in texts], dtype=np.float64)
    if code in _NAMED_CODES and np.isnan(numbers).any():
        return _strings(texts)
    form = DFReader.FORMAT_TO_STRUCT.get(code)
    if (
        form is not None
        and form[1] is None
        and form[0] not in ("f", "d", "e")
        and (np.abs(numbers) < 2.0**63).all()
    ):
        whole: Array = np.array([int(float(text)) if not _is_whole(text) else int(text) for text in texts])
        return whole.astype(np.int64)
    return numbers


def _is_whole(text: str) -> bool:
    return text.lstrip("+-").isdigit()


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return float("nan")


def _strings(texts: list[str]) -> Array:
    column: Any = np.array([text.encode("ascii", "replace") or b"\0" for text in texts])
    return np.asarray(column)
