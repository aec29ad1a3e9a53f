"""A store in memory (empty at every start, lost at the end, equal for equal runs), and the memory card."""

import errno
from dataclasses import dataclass, field

from autopilot_bridge.storage.files import (
    MEMORY_QUOTA,
    Entry,
    FileStore,
    HeldBytes,
    Mode,
    Quota,
    Usage,
    VehiclePath,
    check_names,
    error,
)

_Directory = dict[str, "bytearray | _Directory"]


class MemoryStore:
    """Files in memory; see `FileStore`.

    Args:
        quota: its largest content.
    """

    def __init__(self, quota: Quota = MEMORY_QUOTA) -> None:
        self._root: _Directory = {}
        self.usage = Usage(quota)

    def entry(self, path: VehiclePath) -> Entry:
        return _entry(path[-1] if path else "/", self._find(path))

    def entries(self, path: VehiclePath) -> list[Entry]:
        return [_entry(name, node) for name, node in sorted(self._directory(path).items())]

    def open(self, path: VehiclePath, mode: Mode) -> "_MemoryFile":
        writable = mode is not Mode.READ
        if not path:
            raise error(errno.EISDIR)
        if not writable:
            node = self._find(path)
        else:
            folder, name = self._place(path)
            if name in folder and mode is Mode.NEW:
                raise error(errno.EEXIST, path)
            if name not in folder:
                self.usage.check_file()
                folder[name] = bytearray()
                self.usage.files += 1
            node = folder[name]
        if isinstance(node, dict):
            raise error(errno.EISDIR, path)
        if mode is Mode.REPLACE:
            self.resize(node, 0)
        return _MemoryFile(self, node, writable=writable)

    def remove(self, path: VehiclePath) -> None:
        folder, name = self._place(path)
        node = self._find(path)
        if isinstance(node, dict):
            raise error(errno.EISDIR, path)
        self._forget(node)
        del folder[name]

    def make_directory(self, path: VehiclePath) -> None:
        folder, name = self._place(path)
        if name in folder:
            raise error(errno.EEXIST, path)
        self.usage.check_file()
        folder[name] = {}
        self.usage.files += 1

    def remove_directory(self, path: VehiclePath) -> None:
        folder, name = self._place(path)
        if self._directory(path):
            raise error(errno.ENOTEMPTY, path)
        del folder[name]
        self.usage.files -= 1

    def rename(self, old: VehiclePath, new: VehiclePath) -> None:
        node = self._find(old)
        source, source_name = self._place(old)
        target, target_name = self._place(new)
        if new[: len(old)] == old and new != old:
            raise error(errno.EINVAL, new)
        there = target.get(target_name)
        if there is node:
            return
        if isinstance(there, dict) or (there is not None and isinstance(node, dict)):
            raise error(errno.EEXIST, new)
        if there is not None:
            self._forget(there)
        del source[source_name]
        target[target_name] = node

    def truncate(self, path: VehiclePath, size: int) -> None:
        node = self._find(path)
        if isinstance(node, dict):
            raise error(errno.EISDIR, path)
        self.resize(node, size)

    def resize(self, data: bytearray, size: int) -> None:
        """Shorten or extend a file's bytes, within the quota."""
        growth = size - len(data)
        self.usage.check_growth(growth)
        if growth > 0:
            data.extend(bytes(growth))
        else:
            del data[size:]
        self.usage.size_bytes += growth

    def _forget(self, node: bytearray) -> None:
        self.usage.size_bytes -= len(node)
        self.usage.files -= 1

    def _find(self, path: VehiclePath) -> "bytearray | _Directory":
        node: bytearray | _Directory = self._root
        for name in path:
            if not isinstance(node, dict):
                raise error(errno.ENOTDIR, path)
            if name not in node:
                raise error(errno.ENOENT, path)
            node = node[name]
        return node

    def _directory(self, path: VehiclePath) -> _Directory:
        node = self._find(path)
        if not isinstance(node, dict):
            raise error(errno.ENOTDIR, path)
        return node

    def _place(self, path: VehiclePath) -> tuple[_Directory, str]:
        """The directory that contains a path, and its name there."""
        if not path:
            raise error(errno.EACCES)
        check_names(path)
        return self._directory(path[:-1]), path[-1]


class _MemoryFile(HeldBytes):
    """An open file of a `MemoryStore`; after its removal it can still be read, as on a disk."""

    _data: bytearray

    def __init__(self, store: MemoryStore, data: bytearray, *, writable: bool) -> None:
        super().__init__(data)
        self._store = store
        self._writable = writable

    def write(self, offset: int, data: bytes) -> None:
        if not self._writable:
            raise error(errno.EBADF)
        end = offset + len(data)
        if end > len(self._data):
            self._store.resize(self._data, end)
        self._data[offset:end] = data

    def close(self) -> None:
        """Nothing to release."""


def _entry(name: str, node: "bytearray | _Directory") -> Entry:
    return Entry(name, True, 0) if isinstance(node, dict) else Entry(name, False, len(node))


@dataclass(slots=True, kw_only=True)
class MemoryCard:
    """The data that persist when the autopilot boots again.

    Attributes:
        files: the card's own file system; by default in memory, empty.
        logs: flights are logged on it.
        boots: number of boots of an autopilot with it, in this run.
        parameters_trusted: False: the stored parameters made the vehicle fail; the next boot sets them aside.
    """

    files: FileStore = field(default_factory=MemoryStore)
    logs: bool = False
    boots: int = 0
    parameters_trusted: bool = True
