"""Reader of numpy `.npz` archives that other programs may have written or damaged."""

import math
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.file_content import ZIP, open_file

__all__ = ["NpzFileError", "read_npz"]

_MAX_BYTES: Final = 512 << 20
"""Of all arrays together: maps and terrains of four million points have 100 MB."""

_MAX_ARRAYS: Final = 1000
_METHODS: Final = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""The methods that numpy writes. The others can't be unpacked within bounds of memory."""

_HEADERS: Final = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}

# errors that zipfile, zlib and numpy's reader of array headers raise for damaged files
_UNREADABLE: Final = (
    *(OSError, EOFError, zipfile.BadZipFile, zlib.error, struct.error, RuntimeError, MemoryError),
    *(ValueError, TypeError, OverflowError, SyntaxError, tokenize.TokenError, LookupError, AttributeError),
)


class NpzFileError(ValueError):
    """A file that is no `.npz` archive; the message gives the reason."""


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of an archive, by name; none holds Python objects.

    Raises:
        FileError: the file can't be read, or is no archive at all.
        NpzFileError: the file is damaged, is no archive of arrays, or holds too much.
    """
    with open_file(path, max_bytes=_MAX_BYTES, accepted=(ZIP,)) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                return _arrays(archive)
        except NpzFileError:
            raise
        except _UNREADABLE as error:
            raise NpzFileError(" ".join(str(error).split())[:200] or type(error).__name__) from None


def _arrays(archive: zipfile.ZipFile) -> dict[str, NDArray[Any]]:
    members = archive.infolist()
    total = sum(member.file_size for member in members)
    if len(members) > _MAX_ARRAYS or total > _MAX_BYTES:
        raise NpzFileError(
            f"it holds {len(members)} arrays of {total} bytes; accepted are {_MAX_ARRAYS} of {_MAX_BYTES}"
        )
    found = {}
    for member in members:
        if member.compress_type not in _METHODS:
            raise NpzFileError(
                f"{member.filename} is compressed by method {member.compress_type} of ZIP; accepted are"
                " those that numpy writes, 0 and 8"
            )
        with archive.open(member) as part:
            found[member.filename.removesuffix(".npy")] = _array(part, member)
    return found


def _array(part: IO[bytes], member: zipfile.ZipInfo) -> NDArray[Any]:
    """An array; its header must fit to the size of its data, so that a damaged one reserves no memory."""
    version = np.lib.format.read_magic(part)
    if version not in _HEADERS:
        raise NpzFileError(f"{member.filename} has version {version} of numpy's format")
    shape, fortran_order, dtype = _HEADERS[version](part)
    if dtype.hasobject:
        raise NpzFileError(f"{member.filename} holds Python objects, which are not read")
    count = math.prod(shape)
    size = count * dtype.itemsize
    if size > member.file_size or (count and not dtype.itemsize) or min(shape, default=0) < 0:
        raise NpzFileError(f"{member.filename} has {member.file_size} bytes for the shape {shape}")
    data = part.read(size)
    if len(data) < size:
        raise NpzFileError(f"{member.filename} ends after {len(data)} of {size} bytes")
    part.read(1)  # at the end of the data zipfile compares its checksum
    values = np.frombuffer(data, dtype=dtype, count=count) if count else np.empty(0, dtype=dtype)
    return values.reshape(shape, order="F" if fortran_order else "C").copy()
