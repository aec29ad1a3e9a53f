"""The logs on a memory card: which there are, under which numbers, and how a new one is called.

They are telemetry logs (`.tlog`) of what the vehicle says; no kept library writes the firmwares' own formats.
What somebody else has put among them (.ulg, .bin) is offered for download as well.
"""

from datetime import UTC, datetime
from typing import Final, NamedTuple

from autopilot_bridge.flavours.card_layout import CardLayout
from autopilot_bridge.storage import Entry, FileStore, Mode, OpenFile, VehiclePath
from autopilot_bridge.storage.files import exists, make_directories

SUFFIX: Final = ".tlog"
_SUFFIXES: Final = (SUFFIX, ".ulg", ".bin")
_TIME_BYTES: Final = 8
_NAMES_TRIED: Final = 10_000


class LogFile(NamedTuple):
    """A log on the card.

    Attributes:
        number: as LOG_ENTRY counts.
        path: on the card.
        size: bytes.
        time_utc_s: Unix time of its first record; 0: not known.
    """

    number: int
    path: VehiclePath
    size: int
    time_utc_s: int


class LogBook:
    """The logs of a vehicle.

    Args:
        files: the memory card.
        layout: where on it, and how they are called.
    """

    def __init__(self, files: FileStore, layout: CardLayout) -> None:
        self._files = files
        self._layout = layout

    def logs(self) -> list[LogFile]:
        """All logs, oldest first by their names."""
        found = sorted(self._found())
        numbers = range(self._layout.first_log_id, self._layout.first_log_id + len(found))
        return [
            LogFile(number, path, size, self._time_utc_s(path))
            for number, (path, size) in zip(numbers, found, strict=True)
        ]

    def open(self, log: LogFile) -> OpenFile:
        """Open a log for reading; OSError when it is gone."""
        return self._files.open(log.path, Mode.READ)

    def create(self, unix_us: int) -> tuple[VehiclePath, OpenFile]:
        """A new log that begins now; no other is touched.

        Raises:
            OSError: there is no room.
        """
        folder, names = self._layout.logs, iter(range(1, _NAMES_TRIED))
        if self._layout.log_folder_by_day:
            began = datetime.fromtimestamp(unix_us // 1_000_000, UTC)
            folder = (*folder, began.strftime("%Y-%m-%d"))
            name = began.strftime("%H_%M_%S")
            path = (*folder, name + SUFFIX)
            while exists(self._files, path):  # the same second of another run
                path = (*folder, f"{name}_{next(names) + 1}{SUFFIX}")
        else:
            last = max((_number(path[-1]) for path, _ in self._found()), default=0)
            path = (*folder, f"{last + 1:08}{SUFFIX}")
        make_directories(self._files, folder)
        return path, self._files.open(path, Mode.NEW)

    def erase(self, *, but: VehiclePath | None) -> None:
        """Remove all logs but one, and the folders that are empty then; OSError when one can't be removed."""
        for path, _ in list(self._found()):
            if path != but:
                self._files.remove(path)
        logs = self._layout.logs
        for entry in self._entries(logs):
            if entry.is_directory and not self._files.entries((*logs, entry.name)):
                self._files.remove_directory((*logs, entry.name))

    def _found(self) -> list[tuple[VehiclePath, int]]:
        logs, found = self._layout.logs, []
        for entry in self._entries(logs):
            if not entry.is_directory:
                found.append(((*logs, entry.name), entry.size))
            elif self._layout.log_folder_by_day:
                folder = (*logs, entry.name)
                found += [
                    ((*folder, inner.name), inner.size)
                    for inner in self._entries(folder)
                    if not inner.is_directory
                ]
        return [(path, size) for path, size in found if path[-1].lower().endswith(_SUFFIXES)]

    def _entries(self, folder: VehiclePath) -> list[Entry]:
        try:
            return self._files.entries(folder)
        except OSError:
            return []

    def _time_utc_s(self, path: VehiclePath) -> int:
        if not path[-1].endswith(SUFFIX):
            return 0
        try:
            file = self._files.open(path, Mode.READ)
        except OSError:
            return 0
        head = file.read(0, _TIME_BYTES)
        file.close()
        return min(int.from_bytes(head, "big") // 1_000_000, 0xFFFFFFFF) if len(head) == _TIME_BYTES else 0


def _number(name: str) -> int:
    stem = name.partition(".")[0]
    return int(stem) if stem.isascii() and stem.isdigit() and len(stem) <= 9 else 0
