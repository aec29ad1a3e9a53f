"""One tree of several stores, each at its path, as the firmware shows its file systems."""

import errno
from collections.abc import Mapping

from autopilot_bridge.storage.files import Entry, FileStore, Mode, OpenFile, VehiclePath, error


class MountTable:
    """Stores at paths; directories between the root and a store are read-only.

    Args:
        places: the stores, by path.
    """

    def __init__(self, places: Mapping[VehiclePath, FileStore]) -> None:
        self._places = dict(sorted(places.items(), key=lambda item: -len(item[0])))

    def entry(self, path: VehiclePath) -> Entry:
        found = self._find(path)
        if found is None:
            return Entry(path[-1] if path else "/", True, 0)
        store, inside = found
        return store.entry(inside)

    def entries(self, path: VehiclePath) -> list[Entry]:
        found = self._find(path)
        names = {place[len(path)] for place in self._places if place[: len(path)] == path and place != path}
        listed = [] if found is None else found[0].entries(found[1])
        listed += [Entry(name, True, 0) for name in names.difference(entry.name for entry in listed)]
        return sorted(listed)

    def open(self, path: VehiclePath, mode: Mode) -> OpenFile:
        store, inside = self._store(path)
        return store.open(inside, mode)

    def remove(self, path: VehiclePath) -> None:
        store, inside = self._store(path)
        store.remove(inside)

    def make_directory(self, path: VehiclePath) -> None:
        if self._find(path) is None or path in self._places:
            raise error(errno.EEXIST, path)
        store, inside = self._store(path)
        store.make_directory(inside)

    def remove_directory(self, path: VehiclePath) -> None:
        if path in self._places:
            raise error(errno.EACCES, path)
        store, inside = self._store(path)
        store.remove_directory(inside)

    def rename(self, old: VehiclePath, new: VehiclePath) -> None:
        store, inside = self._store(old)
        other, there = self._store(new)
        if other is not store:
            raise error(errno.EXDEV, new)
        if old in self._places or new in self._places:
            raise error(errno.EACCES, new)
        store.rename(inside, there)

    def truncate(self, path: VehiclePath, size: int) -> None:
        store, inside = self._store(path)
        store.truncate(inside, size)

    def _find(self, path: VehiclePath) -> tuple[FileStore, VehiclePath] | None:
        """The store that contains a path, and the path within it; None for a directory above the stores."""
        for place, store in self._places.items():
            if path[: len(place)] == place:
                return store, path[len(place) :]
        if any(place[: len(path)] == path for place in self._places):
            return None
        raise error(errno.ENOENT, path)

    def _store(self, path: VehiclePath) -> tuple[FileStore, VehiclePath]:
        """The store that contains a path; EACCES for the directories above the stores."""
        found = self._find(path)
        if found is None:
            raise error(errno.EACCES, path)
        return found
