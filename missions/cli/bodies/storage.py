"""What a SITL keeps: the vehicles' memory cards, and reports of data that could not be written."""

import tempfile
from pathlib import Path
from typing import Final

from autopilot_bridge.sitl import VehicleFailure
from autopilot_bridge.storage import FOLDER_QUOTA, TEMPORARY_QUOTA
from autopilot_bridge.storage.folder import FolderStore
from autopilot_bridge.storage.memory import MemoryCard
from missions.cli.options import report

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
        self._stores: list[FolderStore] = []
        self._temporary: tempfile.TemporaryDirectory[str] | None = None
        if storage == NONE:
            self.cards: list[MemoryCard] = [MemoryCard() for _ in range(count)]
            return
        if storage is None:
            self._temporary = tempfile.TemporaryDirectory(prefix="flightstack-sitl-")
        folder = Path(self._temporary.name if self._temporary is not None else str(storage))
        try:
            for number in range(1, count + 1):
                quota = FOLDER_QUOTA if self._temporary is None else TEMPORARY_QUOTA
                self._stores.append(FolderStore(folder / f"vehicle{number}", quota))
        except OSError as error:
            self.close()
            raise ValueError(
                f"--storage {storage}: {error.filename or folder} {error.strerror}; "
                f"accepted: a folder of one's own, or {NONE}"
            ) from error
        self.cards = [MemoryCard(files=store, logs=True) for store in self._stores]

    def close(self) -> None:
        """Release the folders; a temporary one is removed."""
        for store in self._stores:
            store.close()
        if self._temporary is not None:
            self._temporary.cleanup()


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
