"""The interface of a file store, its capacity, and the paths in requests of clients.

Errors are `OSError` with the errno that a file system would give. A path is untrusted bytes from a link:
split into names it has no `..`, no empty name, no control character and no byte that is not UTF-8, or
`OSError` is raised.
"""

import errno
import os
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final, NamedTuple, Protocol

VehiclePath = tuple[str, ...]
"""Names from the root on; the root is empty."""

MAX_NAME_BYTES: Final = 127
MAX_DEPTH: Final = 16
_FORBIDDEN: Final = frozenset('\\:*?"<>|')  # as on the FAT of a real card; one separates names on Windows


@dataclass(frozen=True, slots=True, kw_only=True)
class Quota:
    """The size of a memory card.

    Attributes:
        size_bytes: of all files together.
        files: files and directories.
    """

    size_bytes: int
    files: int

    def __post_init__(self) -> None:
        for name in ("size_bytes", "files"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} {getattr(self, name)} is not at least 1")


MEMORY_QUOTA: Final = Quota(size_bytes=4 * 1024**2, files=256)
TEMPORARY_QUOTA: Final = Quota(size_bytes=1024**3, files=20_000)
FOLDER_QUOTA: Final = Quota(size_bytes=8 * 1024**3, files=20_000)


class Usage:
    """Counts the content of a store against its quota.

    Attributes:
        size_bytes, files: in use.
    """

    def __init__(self, quota: Quota) -> None:
        self._quota = quota
        self.size_bytes = 0
        self.files = 0

    def check_file(self) -> None:
        """ENOSPC when there is no space for another file."""
        if self.files >= self._quota.files:
            raise error(errno.ENOSPC)

    def check_growth(self, size_bytes: int) -> None:
        """ENOSPC when there is no space for so many additional bytes."""
        if size_bytes > 0 and self.size_bytes + size_bytes > self._quota.size_bytes:
            raise error(errno.ENOSPC)


def error(number: int, path: VehiclePath = ()) -> OSError:
    """An `OSError` of the system's own class for this errno (FileNotFoundError and so on)."""
    return OSError(number, os.strerror(number), "/" + "/".join(path))


def parse_path(data: bytes) -> VehiclePath:
    """The names in a path of a request, up to its first NUL.

    Raises:
        OSError: EILSEQ not UTF-8 or with control characters, EACCES for `..`, ENAMETOOLONG a name or a depth
            beyond the limits.
    """
    try:
        text = data.split(b"\0", 1)[0].decode("utf-8")
    except UnicodeDecodeError:
        raise error(errno.EILSEQ) from None
    if not text.isprintable():
        raise error(errno.EILSEQ)
    names = tuple(name for name in text.split("/") if name not in ("", "."))
    if ".." in names:
        raise error(errno.EACCES)
    if len(names) > MAX_DEPTH or any(len(name.encode()) > MAX_NAME_BYTES for name in names):
        raise error(errno.ENAMETOOLONG)
    return names


def check_names(path: VehiclePath) -> VehiclePath:
    """`path`, if a memory card can store it: no characters that FAT forbids.

    Raises:
        OSError: EINVAL for such a character.
    """
    for name in path:
        if not _FORBIDDEN.isdisjoint(name) or name.rstrip(". ") == "":
            raise error(errno.EINVAL, path)
    return path


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


def read_whole(store: FileStore, path: VehiclePath, *, at_most: int) -> bytes:
    """The whole content of a file.

    Args:
        at_most: bytes that a sound file can have; clients can make files of any size that take no space.

    Raises:
        OSError: it can't be read, or is larger (EFBIG).
    """
    file = store.open(path, Mode.READ)
    try:
        if file.size > at_most:
            raise error(errno.EFBIG, path)
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
