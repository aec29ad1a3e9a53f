"""A store in a folder of the computer; clients can't access files outside the folder.

Every name of a path is opened relative to the directory before it, without following links (`openat` with
O_NOFOLLOW), so a symbolic link in the folder, whenever it was made, gives no access. Only plain files
and directories exist for a client; devices, pipes and links are not listed and can't be opened.
"""

import contextlib
import errno
import fcntl
import os
import stat
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from autopilot_bridge.storage.files import (
    FOLDER_QUOTA,
    Entry,
    Mode,
    Quota,
    Usage,
    VehiclePath,
    check_names,
    error,
)

assert sys.platform != "win32"  # it has no `openat`

_DIRECTORY: Final = os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC
_FILE: Final = os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC
_FLAGS: Final = {
    Mode.READ: os.O_RDONLY,
    Mode.WRITE: os.O_RDWR | os.O_CREAT,
    Mode.REPLACE: os.O_RDWR | os.O_CREAT,
    Mode.NEW: os.O_RDWR | os.O_CREAT | os.O_EXCL,
}


class FolderStore:
    """Files in a folder; see `FileStore`.

    Args:
        folder: created if it is missing.
        quota: its largest content, existing files included.

    Raises:
        OSError: the folder can't be made or read, or another process uses it.
    """

    def __init__(self, folder: Path | str, quota: Quota = FOLDER_QUOTA) -> None:
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self._root = os.open(self.folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            fcntl.flock(self._root, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self.close()
            raise OSError(errno.EBUSY, "is in use by another run", str(self.folder)) from None
        self.usage = Usage(quota)
        for _, directories, files, parent in os.fwalk(dir_fd=self._root, follow_symlinks=False):
            self.usage.files += len(directories) + len(files)
            for name in files:
                status = os.stat(name, dir_fd=parent, follow_symlinks=False)
                self.usage.size_bytes += status.st_size if stat.S_ISREG(status.st_mode) else 0

    def close(self) -> None:
        """Release the folder; a second call does nothing."""
        if self._root >= 0:
            os.close(self._root)
            self._root = -1

    def entry(self, path: VehiclePath) -> Entry:
        if not path:
            return Entry("/", True, 0)
        with self._parent(path) as parent:
            return self._look(parent, path)

    def entries(self, path: VehiclePath) -> list[Entry]:
        with self._directory(path) as directory, os.scandir(directory) as found:
            entries = [_listed(item) for item in found]
        return sorted(entry for entry in entries if entry is not None)

    def open(self, path: VehiclePath, mode: Mode) -> "_FolderFile":
        if not path:
            raise error(errno.EISDIR)
        with self._parent(path) as parent:
            flags = _FLAGS[mode]
            missing = flags & os.O_CREAT and not _there(parent, path[-1])
            if missing:
                self.usage.check_file()
            descriptor = _open(path[-1], flags | _FILE, parent)
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            os.close(descriptor)
            raise error(errno.EISDIR, path)
        self.usage.files += bool(missing)
        file = _FolderFile(self, descriptor)
        if mode is Mode.REPLACE:
            file.resize(0)
        return file

    def remove(self, path: VehiclePath) -> None:
        with self._parent(path) as parent:
            entry = self._look(parent, path)
            if entry.is_directory:
                raise error(errno.EISDIR, path)
            os.unlink(path[-1], dir_fd=parent)
        self.usage.size_bytes -= entry.size
        self.usage.files -= 1

    def make_directory(self, path: VehiclePath) -> None:
        with self._parent(path) as parent:
            if _there(parent, path[-1]):
                raise error(errno.EEXIST, path)
            self.usage.check_file()
            os.mkdir(path[-1], dir_fd=parent)
        self.usage.files += 1

    def remove_directory(self, path: VehiclePath) -> None:
        with self._parent(path) as parent:
            os.rmdir(path[-1], dir_fd=parent)
        self.usage.files -= 1

    def rename(self, old: VehiclePath, new: VehiclePath) -> None:
        with self._parent(old) as parent, self._parent(new) as target:
            entry = self._look(parent, old)
            there = self._look(target, new) if _there(target, new[-1]) else None
            if there is not None and (there.is_directory or entry.is_directory) and old != new:
                raise error(errno.EEXIST, new)
            os.rename(old[-1], new[-1], src_dir_fd=parent, dst_dir_fd=target)
        if there is not None and old != new:
            self.usage.size_bytes -= there.size
            self.usage.files -= 1

    def truncate(self, path: VehiclePath, size: int) -> None:
        self.entry(path)
        file = self.open(path, Mode.WRITE)
        try:
            file.resize(size)
        finally:
            file.close()

    @contextlib.contextmanager
    def _directory(self, path: VehiclePath) -> Iterator[int]:
        """A descriptor of a directory, opened name by name."""
        descriptor = os.open(".", _DIRECTORY, dir_fd=self._root)
        try:
            for name in path:
                inner = _open(name, _DIRECTORY, descriptor)
                os.close(descriptor)
                descriptor = inner
            yield descriptor
        finally:
            os.close(descriptor)

    @contextlib.contextmanager
    def _parent(self, path: VehiclePath) -> Iterator[int]:
        """A descriptor of the directory that contains a path."""
        if not path:
            raise error(errno.EACCES)
        check_names(path)
        with self._directory(path[:-1]) as directory:
            yield directory

    def _look(self, parent: int, path: VehiclePath) -> Entry:
        status = os.stat(path[-1], dir_fd=parent, follow_symlinks=False)
        entry = _entry(path[-1], status)
        if entry is None:
            raise error(errno.ENOENT, path)
        return entry


class _FolderFile:
    """An open file of a `FolderStore`."""

    def __init__(self, store: FolderStore, descriptor: int) -> None:
        self._store = store
        self._descriptor = descriptor

    @property
    def size(self) -> int:
        return os.fstat(self._descriptor).st_size

    def read(self, offset: int, size: int) -> bytes:
        return os.pread(self._descriptor, size, offset)

    def write(self, offset: int, data: bytes) -> None:
        before, end = self.size, offset + len(data)
        if end > before:
            self._store.usage.check_growth(end - before)
        written = 0
        try:
            while written < len(data):
                written += os.pwrite(self._descriptor, data[written:], offset + written)
        except OSError:
            os.ftruncate(self._descriptor, before)  # the disk is full: write nothing, not a part
            raise
        self._store.usage.size_bytes += max(0, end - before)

    def resize(self, size: int) -> None:
        """Shorten, or extend with zeros."""
        before = self.size
        self._store.usage.check_growth(size - before)
        os.ftruncate(self._descriptor, size)
        self._store.usage.size_bytes += size - before

    def close(self) -> None:
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def _open(name: str, flags: int, parent: int) -> int:
    """`openat`; a link in the path (ELOOP, or ENOTDIR for a directory) counts as not existing."""
    try:
        return os.open(name, flags, 0o644, dir_fd=parent)
    except OSError as failure:
        if failure.errno in (errno.ELOOP, errno.EMLINK, errno.ENXIO):
            raise error(errno.ENOENT, (name,)) from None
        raise


def _there(parent: int, name: str) -> bool:
    try:
        os.stat(name, dir_fd=parent, follow_symlinks=False)
    except FileNotFoundError:
        return False
    return True


def _listed(item: os.DirEntry[str]) -> Entry | None:
    """The entry of a listing; None for entries that clients can't open."""
    try:
        item.name.encode("utf-8")
        return _entry(item.name, item.stat(follow_symlinks=False))
    except (UnicodeEncodeError, FileNotFoundError):
        return None


def _entry(name: str, status: os.stat_result) -> Entry | None:
    if stat.S_ISDIR(status.st_mode):
        return Entry(name, True, 0)
    return Entry(name, False, status.st_size) if stat.S_ISREG(status.st_mode) else None
