"""Files of frozen dataclasses: a sequence of records, each with a checksum, appended while a flight is flown.

A record is: the magic bytes, lengths of header and body (uint32), CRC-32 of both, the header (JSON: kind,
entries of the file's own, fields; arrays as type, shape and place in the body), and the body, compressed by
zlib. A record that is damaged or incomplete ends the file.
"""

import json
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, BinaryIO, Final

import numpy as np

__all__ = ["RecordWriter", "read_records"]

_MAX_BODY: Final = 1 << 30
_HEAD: Final = struct.Struct("<4sIII")


class RecordWriter:
    """Writes the records of a run; the file is created with the first one.

    Args:
        path: the file; it must not exist.
        magic: four bytes that each record begins with.
    """

    def __init__(self, path: Path, magic: bytes) -> None:
        self._path = path
        self._magic = magic
        self._file: BinaryIO | None = None

    def write(self, record: Any, about: Mapping[str, Any]) -> None:
        """Append a dataclass whose fields are numbers, strings, None, tuples of them, or arrays.

        Args:
            record: the dataclass.
            about: entries of the file's own, which JSON can hold; their names have no `.` before them.

        Raises:
            OSError: the file exists, or can't be written.
        """
        if self._file is None:
            self._file = self._path.open("xb")
        header: dict[str, Any] = {"kind": type(record).__name__, **about}
        arrays, start = [], 0
        for field in fields(record):
            value = getattr(record, field.name)
            if isinstance(value, np.ndarray):
                raw = np.ascontiguousarray(value).tobytes()
                arrays.append(raw)
                value = {"dtype": value.dtype.str, "shape": value.shape, "start": start}
                start += len(raw)
            header[f".{field.name}"] = value
        head = json.dumps(header).encode()
        body = zlib.compress(b"".join(arrays), 1)
        check = zlib.crc32(head + body)
        self._file.write(_HEAD.pack(self._magic, len(head), len(body), check) + head + body)
        self._file.flush()

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()


def read_records(
    path: Path, magic: bytes, kinds: Sequence[type[Any]]
) -> Iterator[tuple[Mapping[str, Any], Any]]:
    """(header, record) of those kinds, in the order of the file; the header has the entries of the file's
    own.

    A record of another kind is left out. What a header should have is for the caller to check.
    """
    known = {kind.__name__: kind for kind in kinds}
    with path.open("rb") as file:
        while len(start := file.read(_HEAD.size)) == _HEAD.size:
            found, head_size, body_size, crc = _HEAD.unpack(start)
            if found != magic or head_size + body_size > path.stat().st_size:
                return
            content = file.read(head_size + body_size)
            if len(content) < head_size + body_size or zlib.crc32(content) != crc:
                return
            try:
                header = json.loads(content[:head_size])
                kind = known.get(header["kind"])
                if kind is None:
                    continue
                body = zlib.decompressobj().decompress(content[head_size:], _MAX_BODY)
                items = header.items()
                values = {name[1:]: _value(value, body) for name, value in items if name.startswith(".")}
                record = kind(**values)
            except (ValueError, TypeError, LookupError, AttributeError, RecursionError, zlib.error):
                return  # no record of this program, though its checksum is right
            yield header, record


def _value(value: Any, body: bytes) -> Any:
    if isinstance(value, dict):
        shape = tuple(value["shape"])
        array = np.frombuffer(body, value["dtype"], int(np.prod(shape)), value["start"])
        return array.reshape(shape)
    return tuple(value) if isinstance(value, list) else value
