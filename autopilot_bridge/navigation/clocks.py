"""When each sensor last aided the filter, and how often it contradicted the estimate."""

from typing import Final

_MEMORY_US: Final = 10_000_000
_TOO_MANY: Final = 4  # within that time of each other: the estimate is unusable


class Contradictions:
    """Counts the times at which a healthy sensor was used although it contradicted the estimate."""

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


class Clocks:
    """Times of the last accepted updates, microseconds since boot; -1 for never."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """As at boot."""
        self.aligned_us = -1
        self.baro_us = -1
        self.gps_height_us = -1
        self.gps_height_refused_us = -1
        self.gps_judged_us = -1
        self.gps_position_us = -1
        self.gps_us = -1
        self.gps_velocity_us = -1
        self.height_us = -1
        self.horizontal_aid_us = -1
        self.mag_us = -1
        self.mag_refused_us = -1
        self.height_held = False
