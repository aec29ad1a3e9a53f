"""The capacity of a store, and its present use."""

import errno
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.storage.paths import error


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
