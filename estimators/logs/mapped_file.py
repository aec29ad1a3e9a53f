"""The bytes of a log, mapped into memory."""

import mmap
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from estimators.errors import LogError
from flightsim.foundation.file_content import FileError, open_file


def mapped_bytes(path: Path) -> NDArray[np.uint8]:
    """The bytes of a file; it must not be shortened while they are used.

    Raises:
        LogError: the file can't be read, or is none that a reader of logs reads.
    """
    try:
        with open_file(path) as file:
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except FileError as error:
        raise LogError(f"{error}; give the path of a log") from None
    except (OSError, ValueError) as error:  # of the mapping: the file has become empty, or has no room
        raise LogError(f"{path} can't be read: {error}; give the path of a log") from None
    return np.frombuffer(mapped, dtype=np.uint8)
