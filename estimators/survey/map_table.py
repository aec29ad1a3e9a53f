"""Tables of line data as other programs write them: CSV with commas, semicolons or tabs, and Geosoft's XYZ.

Geosoft's export has comments that begin with `/`: a banner, the names of the columns, a ruler. A row such as
`Line 12` begins each line of the survey; other types are Tie, Base, Test and Random. `*` is no value.
"""

import csv
import lzma
import math
import re
from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO, Final

import numpy as np
from numpy.typing import NDArray

from estimators.errors import EstimatorError
from flightsim.foundation.file_content import XZ, FileError, decoded, open_file

__all__ = ["Table", "read_table"]

Array = NDArray[np.float64]

Table = dict[str, Array]
"""Columns (n,) by name, in lower case and without units; texts and missing values are NaN."""

COLUMNS: Final = "longitude,latitude,total_field_nt"
_LINE_TYPES: Final = ("line", "tie", "base", "test", "random", "trend", "special")
_COMMENTS: Final = ("/", "#")
_SEPARATORS: Final = (";", "\t", ",")
_UNIT: Final = re.compile(r"\s*[(\[][^)\]]*[)\]]$")
_MAX_BYTES: Final = 1 << 30
_LONGEST_LINE: Final = 1 << 20
_PIECE: Final = 1 << 20
_UNPACK_MEMORY: Final = 256 << 20


def read_table(path: Path) -> Table:
    """Read a table, which may be compressed with xz.

    Raises:
        EstimatorError: it can't be read, has no names of columns, or a row with another number of values.
    """
    try:
        with open_file(path, max_bytes=_MAX_BYTES, accepted=(XZ,)) as file:
            return _columns(path, _lines(path, file))
    except FileError as error:
        raise EstimatorError(str(error)) from None
    except (OSError, lzma.LZMAError, MemoryError) as error:
        raise EstimatorError(f"{path} can't be read: {error or 'it needs too much memory'}") from None


def _columns(path: Path, lines: Iterator[str]) -> Table:
    names: list[str] = []
    comments: list[str] = []
    separator: str | None = None
    cells = array("d")
    for number, text in enumerate(lines, 1):
        line = text.strip()
        if not line:
            continue
        if line.startswith(_COMMENTS):
            if not names:
                comments.append(line)
            continue
        if not names:
            separator = next((mark for mark in _SEPARATORS if mark in line), None)
        words = _words(line, separator)
        if separator is None and len(words) == 2 and words[0].lower() in _LINE_TYPES:
            continue
        if not names:
            if not _is_number(words[0]):
                names = [_name(word) for word in words]
                continue
            names = _commented_names(path, comments, len(words), separator)
        if len(words) != len(names):
            raise EstimatorError(f"{path}, line {number}: {len(words)} values for {len(names)} columns")
        cells.extend(_number(word, separator) for word in words)
    if not names:
        raise EstimatorError(f"{path} is empty; accepted are columns with names, such as {COLUMNS}")
    table = np.array(cells, dtype=np.float64).reshape(-1, len(names))
    return {name: table[:, k] for k, name in enumerate(names)}


def _commented_names(path: Path, comments: Sequence[str], count: int, separator: str | None) -> list[str]:
    """Names from the last comment that has as many words as a row; Geosoft's `//` is about a line."""
    for comment in reversed(comments):
        words = [_name(word) for word in _words(comment.lstrip("/# ").rstrip(), separator)]
        if (
            not comment.startswith("//")
            and len(words) == count
            and all(any(map(str.isalpha, word)) for word in words)
        ):
            return words
    raise EstimatorError(
        f"{path} has no header for its rows of {count} values; accepted are columns with names, such as "
        f"{COLUMNS}"
    )


def _lines(path: Path, file: BinaryIO) -> Iterator[str]:
    """Lines of text; a line without an end, and a file that unpacks to too much, end in an error."""
    rest, first, size = b"", True, 0
    for piece in _unpacked(file):
        size += len(piece)
        if size > _MAX_BYTES:
            raise FileError(path, f"it has more than {_MAX_BYTES} bytes, unpacked")
        *whole, rest = (rest + piece).splitlines(keepends=True) or [b""]
        if rest.endswith(b"\n"):
            whole, rest = [*whole, rest], b""
        if len(rest) > _LONGEST_LINE:
            raise FileError(path, f"it has a line of more than {_LONGEST_LINE} bytes; is it a table?")
        for line in whole:
            yield decoded(path, line) if first else _text(path, line)
            first = False
    if rest:
        yield decoded(path, rest)


def _text(path: Path, line: bytes) -> str:
    try:
        return line.decode("utf-8")
    except UnicodeDecodeError:
        return decoded(path, line)


def _unpacked(file: BinaryIO) -> Iterator[bytes]:
    """Pieces of a file, or of what is packed in it."""
    piece = file.read(_PIECE)
    if not piece.startswith(b"\xfd7zXZ\x00"):
        while piece:
            yield piece
            piece = file.read(_PIECE)
        return
    unpacker = lzma.LZMADecompressor(memlimit=_UNPACK_MEMORY)
    while not unpacker.eof:
        if unpacker.needs_input and not piece:
            raise lzma.LZMAError("it ends before its data do")
        yield unpacker.decompress(piece, max_length=_PIECE)
        piece = file.read(_PIECE) if unpacker.needs_input else b""


def _words(line: str, separator: str | None) -> list[str]:
    if separator is None:
        return line.split()
    if '"' in line:
        return [word.strip() for word in next(csv.reader([line], delimiter=separator))]
    return [word.strip() for word in line.split(separator)]


def _name(word: str) -> str:
    """The name of a column, without its unit: `TMI (nT)` is tmi."""
    return _UNIT.sub("", word.strip()).lower()


def _number(word: str, separator: str | None) -> float:
    if separator in (";", "\t") and "," in word and "." not in word:
        word = word.replace(",", ".")  # a decimal comma
    try:
        return float(word)
    except ValueError:
        return math.nan  # text, or `*` for no value


def _is_number(word: str) -> bool:
    return not math.isnan(_number(word, ";")) or word.lower() in ("nan", "*")
