"""What a store of files can do. Errors are `OSError` with the errno that a file system would give."""

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
    WRITE = auto()  # made if there is none; what it holds stays
    REPLACE = auto()  # made if there is none; emptied
    NEW = auto()  # there must be none


class OpenFile(Protocol):
    """An open file. Reads and writes say where; there is no position."""

    @property
    def size(self) -> int:
        """Bytes at the moment."""
        ...

    def read(self, offset: int, size: int) -> bytes:
        """Up to `size` bytes from `offset`; fewer at the end, none behind it."""
        ...

    def write(self, offset: int, data: bytes) -> None:
        """Write all of `data` at `offset`, or nothing (OSError)."""
        ...

    def close(self) -> None:
        """Close; a second time does nothing. OSError when what was written is not accepted."""
        ...


class HeldBytes:
    """What reading is for an open file whose bytes are in memory."""

    __slots__ = ("_data",)

    def __init__(self, data: bytes | bytearray) -> None:
        self._data = data

    @property
    def size(self) -> int:
        """Bytes at the moment."""
        return len(self._data)

    def read(self, offset: int, size: int) -> bytes:
        """Up to `size` bytes from `offset`; fewer at the end, none behind it."""
        return bytes(self._data[offset : offset + size])


class FileStore(Protocol):
    """A tree of files. Every method raises `OSError` and then has changed nothing."""

    def entry(self, path: VehiclePath) -> Entry:
        """What is at a path."""
        ...

    def entries(self, path: VehiclePath) -> list[Entry]:
        """What is in a directory, by name."""
        ...

    def open(self, path: VehiclePath, mode: Mode) -> OpenFile:
        """Open a file."""
        ...

    def remove(self, path: VehiclePath) -> None:
        """Remove a file."""
        ...

    def make_directory(self, path: VehiclePath) -> None:
        """Make a directory in one that is there."""
        ...

    def remove_directory(self, path: VehiclePath) -> None:
        """Remove an empty directory."""
        ...

    def rename(self, old: VehiclePath, new: VehiclePath) -> None:
        """Give a file or directory another place; a file that is there is replaced."""
        ...

    def truncate(self, path: VehiclePath, size: int) -> None:
        """Cut a file, or fill it up with zeros."""
        ...


def exists(store: FileStore, path: VehiclePath) -> bool:
    """Whether there is something at a path."""
    try:
        store.entry(path)
    except OSError:
        return False
    return True


def make_directories(store: FileStore, path: VehiclePath) -> None:
    """Make a directory and those it lies in, as far as they are missing.

    Raises:
        OSError: there is a file in the way, or no room.
    """
    for depth in range(1, len(path) + 1):
        if not exists(store, path[:depth]):
            store.make_directory(path[:depth])


def read_whole(store: FileStore, path: VehiclePath) -> bytes:
    """All of a file.

    Raises:
        OSError: it can't be read.
    """
    file = store.open(path, Mode.READ)
    try:
        return file.read(0, file.size)
    finally:
        file.close()


def replace_whole(store: FileStore, path: VehiclePath, data: bytes) -> None:
    """Write a file so that, whatever ends the process, it is either the old or the new one.

    Raises:
        OSError: no room; the old file is as it was.
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
