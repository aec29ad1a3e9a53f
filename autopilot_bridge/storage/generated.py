"""Files that are generated when they are opened, from the vehicle's data."""

import errno
from collections.abc import Callable, Mapping
from typing import Final

from autopilot_bridge.storage.files import Entry, HeldBytes, Mode, OpenFile, VehiclePath, error

Content = Callable[[Mapping[str, str]], bytes]
"""Makes a file's bytes; the argument holds the query after `?` in its name (ArduPilot)."""
Upload = Callable[[bytes], None]
"""Processes a file that a client has written, when it is closed; ValueError refuses it."""

MAX_UPLOAD_BYTES: Final = 256 * 1024


class GeneratedStore:
    """A flat directory of generated files.

    Args:
        contents: the files, by name.
        uploads: those that may be written, by name.
    """

    def __init__(self, contents: Mapping[str, Content], uploads: Mapping[str, Upload] | None = None) -> None:
        self._contents = contents
        self._uploads = uploads or {}

    def entry(self, path: VehiclePath) -> Entry:
        if not path:
            return Entry("/", True, 0)
        name, query = self._name(path)
        return Entry(path[-1], False, len(self._contents[name](query)))

    def entries(self, path: VehiclePath) -> list[Entry]:
        if path:
            raise error(errno.ENOTDIR if path[0] in self._contents else errno.ENOENT, path)
        return [self.entry((name,)) for name in sorted(self._contents)]

    def open(self, path: VehiclePath, mode: Mode) -> OpenFile:
        if not path:
            raise error(errno.EISDIR)
        name, query = self._name(path)
        if mode is Mode.READ:
            return _Snapshot(self._contents[name](query))
        if name not in self._uploads or mode is Mode.NEW:
            raise error(errno.EACCES, path)
        return _Upload(self._uploads[name])

    def remove(self, path: VehiclePath) -> None:
        self._refuse(path)

    def make_directory(self, path: VehiclePath) -> None:
        raise error(errno.EACCES, path)

    def remove_directory(self, path: VehiclePath) -> None:
        raise error(errno.EACCES, path)

    def rename(self, old: VehiclePath, new: VehiclePath) -> None:
        self._refuse(old)

    def truncate(self, path: VehiclePath, size: int) -> None:
        self._refuse(path)

    def _refuse(self, path: VehiclePath) -> None:
        if path:
            self._name(path)
        raise error(errno.EACCES, path)

    def _name(self, path: VehiclePath) -> tuple[str, Mapping[str, str]]:
        """The file's name and its query."""
        name, _, query = path[0].partition("?")
        if len(path) != 1 or name not in self._contents:
            raise error(errno.ENOENT, path)
        pairs = (part.partition("=") for part in query.split("&") if part)
        return name, {key: value for key, _, value in pairs}


class _Snapshot(HeldBytes):
    """The bytes of a generated file at the time when it was opened."""

    def write(self, offset: int, data: bytes) -> None:
        raise error(errno.EBADF)

    def close(self) -> None:
        """Nothing to release."""


class _Upload(HeldBytes):
    """A file being written, processed as a whole when it is closed."""

    _data: bytearray

    def __init__(self, take: Upload) -> None:
        super().__init__(bytearray())
        self._take: Upload | None = take

    def write(self, offset: int, data: bytes) -> None:
        end = offset + len(data)
        if end > MAX_UPLOAD_BYTES:
            raise error(errno.EFBIG)
        if end > len(self._data):
            self._data.extend(bytes(end - len(self._data)))
        self._data[offset:end] = data

    def close(self) -> None:
        take, self._take = self._take, None
        if take is None or not self._data:
            return
        try:
            take(bytes(self._data))
        except ValueError:
            raise error(errno.EINVAL) from None
