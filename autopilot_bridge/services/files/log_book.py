"""The logs on a memory card: a list of them, their numbers, and the names of new logs.

They are telemetry logs (`.tlog`) of the vehicle's own messages; no maintained library writes the firmwares'
own formats. Log files from other sources in the same folders (.ulg, .bin) are offered for download as well.
"""

from datetime import UTC, datetime
from typing import Final, NamedTuple

from autopilot_bridge.services.files.card_layout import CardLayout
from autopilot_bridge.storage import Entry, FileStore, Mode, OpenFile, VehiclePath
from autopilot_bridge.storage.files import exists, make_directories

SUFFIX: Final = ".tlog"
_SUFFIXES: Final = (SUFFIX, ".ulg", ".bin")
_TIME_BYTES: Final = 8
_NAMES_TRIED: Final = 10_000


class LogFile(NamedTuple):
    """A log on the card.

    Attributes:
        number: number in LOG_ENTRY.
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
        layout: folder and names of the logs.
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
        """Open a log for reading; OSError when it no longer exists."""
        return self._files.open(log.path, Mode.READ)

    def create(self, unix_us: int) -> tuple[VehiclePath, OpenFile]:
        """Create a new log that begins now; no other log is changed.

        Raises:
            OSError: the card is full.
        """
        folder, names = self._layout.logs, iter(range(1, _NAMES_TRIED))
        if self._layout.log_folder_by_day:
            began = datetime.fromtimestamp(unix_us // 1_000_000, UTC)
            folder = (*folder, began.strftime("%Y-%m-%d"))
            name = began.strftime("%H_%M_%S")
            path = (*folder, name + SUFFIX)
            while exists(self._files, path):  # another log of the same second
                path = (*folder, f"{name}_{next(names) + 1}{SUFFIX}")
        else:
            last = max((_number(path[-1]) for path, _ in self._found()), default=0)
            path = (*folder, f"{last + 1:08}{SUFFIX}")
        make_directories(self._files, folder)
        return path, self._files.open(path, Mode.NEW)

    def erase(self, *, but: VehiclePath | None) -> None:
        """Remove all logs but one, and folders that are then empty; OSError when one can't be removed."""
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
