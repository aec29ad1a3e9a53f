"""The folder in which a firmware works, and what of it is kept."""

import shutil
import tempfile
from collections.abc import Callable
from pathlib import Path

from autopilot_bridge.firmware_process.process import CONSOLE_NAME


class WorkingFolder:
    """A temporary folder of one vehicle's firmware, the same over its reboots.

    Args:
        name: of the vehicle's files among those that are kept: "vehicle1".
        kept_in: existing folder for what is kept; None: nothing is kept.
        on_kept: called with each file that is kept.

    Attributes:
        path: the folder; it is removed with this object.
    """

    def __init__(
        self, name: str, kept_in: Path | None, on_kept: Callable[[Path], object] = lambda _path: None
    ) -> None:
        self._temporary = tempfile.TemporaryDirectory(prefix="flightstack-", ignore_cleanup_errors=True)
        self.path = Path(self._temporary.name)
        self._name = name
        self._kept_in = kept_in
        self._on_kept = on_kept
        self._kept = 0

    def keep(self, pattern: str) -> None:
        """Keep the logs that are new, and what the firmware has printed.

        Args:
            pattern: of the logs' paths in the folder; they have names in the order of time.
        """
        if self._kept_in is None:
            return
        for log in sorted(self.path.glob(pattern)):
            self._kept += 1
            part = "" if self._kept == 1 else f"-{self._kept}"
            kept = self._kept_in / f"{self._name}{part}{log.suffix.lower()}"
            shutil.move(log, kept)
            self._on_kept(kept)
        console = self.path / CONSOLE_NAME
        if console.exists():
            kept = self._kept_in / f"{self._name}-{CONSOLE_NAME}"
            shutil.copyfile(console, kept)
            self._on_kept(kept)
