"""The interface of a file store. Errors are `OSError` with the errno that a file system would give."""

from enum import Enum, auto
from typing import NamedTuple, Protocol

from autopilot_bridge.storage.paths import VehiclePath


class Entry(NamedTuple):
    """One name in a directory; `size` in bytes, 0 for a directory."""

    name: str
    is_directory: bool
    size: int


class Mode(Enum):
    """How a file is opened."""

    READ = auto()
    WRITE = auto()  # created if it does not exist; its content is kept
    REPLACE = auto()  # created if it does not exist; emptied
    NEW = auto()  # must not exist


class OpenFile(Protocol):
    """An open file. Reads and writes give the offset; there is no file position."""

    @property
    def size(self) -> int:
        """Present size in bytes."""
        ...

    def read(self, offset: int, size: int) -> bytes:
        """Up to `size` bytes from `offset`; fewer at the end, none after it."""
        ...

    def write(self, offset: int, data: bytes) -> None:
        """Write all of `data` at `offset`, or nothing (OSError)."""
        ...

    def close(self) -> None:
        """Close; a second call does nothing. OSError when the written data are not accepted."""
        ...


class HeldBytes:
    """Reading of an open file whose bytes are in memory."""

    def __init__(self, data: bytes | bytearray) -> None:
        self._data = data

    @property
    def size(self) -> int:
        """Present size in bytes."""
        return len(self._data)

    def read(self, offset: int, size: int) -> bytes:
        """Up to `size` bytes from `offset`; fewer at the end, none after it."""
        return bytes(self._data[offset : offset + size])


class FileStore(Protocol):
    """A tree of files. A method that raises `OSError` has changed nothing."""

    def entry(self, path: VehiclePath) -> Entry:
        """The entry at a path."""
        ...

    def entries(self, path: VehiclePath) -> list[Entry]:
        """The entries of a directory, by name."""
        ...

    def open(self, path: VehiclePath, mode: Mode) -> OpenFile:
        """Open a file."""
        ...

    def remove(self, path: VehiclePath) -> None:
        """Remove a file."""
        ...

    def make_directory(self, path: VehiclePath) -> None:
        """Make a directory in an existing one."""
        ...

    def remove_directory(self, path: VehiclePath) -> None:
        """Remove an empty directory."""
        ...

    def rename(self, old: VehiclePath, new: VehiclePath) -> None:
        """Move a file or directory; an existing file at the new path is replaced."""
        ...

    def truncate(self, path: VehiclePath, size: int) -> None:
        """Shorten a file, or extend it with zeros."""
        ...


def exists(store: FileStore, path: VehiclePath) -> bool:
    """Whether there is an entry at a path."""
    try:
        store.entry(path)
    except OSError:
        return False
    return True


def make_directories(store: FileStore, path: VehiclePath) -> None:
    """Make a directory and its missing parents.

    Raises:
        OSError: a file has the same path, or the store is full.
    """
    for depth in range(1, len(path) + 1):
        if not exists(store, path[:depth]):
            store.make_directory(path[:depth])


def read_whole(store: FileStore, path: VehiclePath) -> bytes:
    """The whole content of a file.

    Raises:
        OSError: it can't be read.
    """
    file = store.open(path, Mode.READ)
    try:
        return file.read(0, file.size)
    finally:
        file.close()


def replace_whole(store: FileStore, path: VehiclePath, data: bytes) -> None:
    """Write a file so that it is either the old or the new one, even if the process is killed.

    Raises:
        OSError: the store is full; the old file is unchanged.
    """
    beside = (*path[:-1], path[-1] + "~")
    file = store.open(beside, Mode.REPLACE)
    try:
        file.write(0, data)
    except OSError:
        file.close()
        store.remove(beside)
        raise
    file.close()
    store.rename(beside, path)
