"""Counts measurements that were fused although they failed the innovation gate."""

from typing import Final

_MEMORY_US: Final = 10_000_000
_TOO_MANY: Final = 4  # within that time of each other: the estimate is unusable


class Contradictions:
    """Counts the times at which a healthy sensor was used although it contradicted the estimate."""

    __slots__ = ("_count", "_newest_us")

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """As at boot."""
        self._count = 0
        self._newest_us = 0

    def note(self, time_us: int) -> None:
        """One more."""
        if time_us - self._newest_us > _MEMORY_US:
            self._count = 0
        self._count += 1
        self._newest_us = time_us

    @property
    def too_many(self) -> bool:
        """The estimate is worth nothing."""
        return self._count >= _TOO_MANY
