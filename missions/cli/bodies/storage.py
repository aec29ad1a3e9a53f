"""What a SITL keeps: the vehicles' memory cards, and reports of data that could not be written."""

import sys
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Final

from autopilot_bridge.sitl import VehicleFailure
from autopilot_bridge.storage import FOLDER_QUOTA, TEMPORARY_QUOTA
from autopilot_bridge.storage.memory import MemoryCard
from missions.cli.options import report

if sys.platform != "win32":
    from autopilot_bridge.storage.folder import FolderStore

NONE: Final = "none"


class VehicleCards:
    """Memory cards for the vehicles of a SITL.

    Args:
        storage: value of the command-line option; None: the default.
        count: number of vehicles; the first one's card is the folder `vehicle1`, and so on.

    Attributes:
        cards: one for each vehicle.

    Raises:
        ValueError: the folder can't be made, or another run uses it.
    """

    def __init__(self, storage: str | None, count: int) -> None:
        self.cards: list[MemoryCard] = []
        self._at_end = ExitStack()
        if sys.platform == "win32" and storage not in (None, NONE):
            raise ValueError(
                f"--storage {storage}: a folder as a memory card is not possible on Windows; accepted: {NONE}"
            )
        if sys.platform == "win32" or storage == NONE:
            self.cards.extend(MemoryCard() for _ in range(count))
        else:
            folder, quota = Path(storage or ""), FOLDER_QUOTA
            if storage is None:
                temporary = tempfile.TemporaryDirectory(prefix="flightstack-sitl-")
                self._at_end.callback(temporary.cleanup)
                folder, quota = Path(temporary.name), TEMPORARY_QUOTA
            try:
                for number in range(1, count + 1):
                    store = FolderStore(folder / f"vehicle{number}", quota)
                    self._at_end.callback(store.close)
                    self.cards.append(MemoryCard(files=store, logs=True))
            except OSError as error:
                self.close()
                raise ValueError(
                    f"--storage {storage}: {error.filename or folder} {error.strerror}; "
                    f"accepted: a folder of one's own, or {NONE}"
                ) from error

    def close(self) -> None:
        """Release the folders; a temporary one is removed."""
        self._at_end.close()


class Losses:
    """Reports each loss on stderr when it happens. The vehicles continue to fly.

    Attributes:
        any: at least one loss happened; the command then exits with an error.
    """

    def __init__(self) -> None:
        self.any = False
        self._log_ended = False

    def log_ended(self, why: str) -> None:
        """The log can no longer be written; reported once."""
        if not self._log_ended:
            self._log_ended = True
            self._warn(f"{why}; the log ends here, the vehicles fly on")

    def keys_not_stored(self, why: str) -> None:
        """The store of signing keys can't be written."""
        self._warn(f"{why}; signing keys and times are kept in memory, a restart forgets them")

    def picture_lost(self, why: str) -> None:
        """A photo, or the rest of a video, could not be written."""
        self._warn(why)

    def vehicle_failed(self, failure: VehicleFailure) -> None:
        """A vehicle could not be simulated on."""
        self._warn(str(failure))

    def _warn(self, text: str) -> None:
        self.any = True
        report(text)
