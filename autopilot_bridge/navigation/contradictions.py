"""How often the filter's belief had to give way."""

from typing import Final

_MEMORY_US: Final = 10_000_000
_TOO_MANY: Final = 4  # within that time of each other: the estimate is worth nothing


class Contradictions:
    """Counts sensors that seem good and had to be obeyed against the filter's belief."""

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
