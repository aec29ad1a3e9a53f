"""Reader of numpy `.npz` archives that other programs may have written or damaged."""

import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

__all__ = ["NpzFileError", "read_npz"]

# errors that zipfile, zlib and numpy's reader of array headers raise for damaged files
_UNREADABLE: Final = (
    *(EOFError, zipfile.BadZipFile, zlib.error, RuntimeError, MemoryError),
    *(ValueError, TypeError, SyntaxError, tokenize.TokenError),
)


class NpzFileError(ValueError):
    """A file that is no `.npz` archive; the message gives the reason."""


def read_npz(path: Path) -> dict[str, NDArray[Any]]:
    """Arrays of an archive, by name; none holds Python objects.

    Raises:
        OSError: the file can't be opened.
        NpzFileError: the file is damaged, or is no archive of arrays.
    """
    found = {}
    try:
        # not np.load, which treats a file that is not an archive as a pickle, and advises to trust it
        with zipfile.ZipFile(path) as archive:
            for name in archive.namelist():
                with archive.open(name) as file:
                    found[name.removesuffix(".npy")] = np.lib.format.read_array(file, allow_pickle=False)
    except _UNREADABLE as error:
        raise NpzFileError(str(error) or type(error).__name__) from None
    return found
