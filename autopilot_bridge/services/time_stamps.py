"""Time stamps of other computers' measurements."""

from typing import Final

_OLDEST_US: Final = 500_000
_NEWEST_US: Final = 20_000


def in_vehicle_time(stamp_us: int, time_us: int) -> int:
    """When something was measured, microseconds of vehicle time.

    Args:
        stamp_us: as the message has it.
        time_us: of its arrival, which counts for a stamp of another clock (TIMESYNC gives the vehicle's).
    """
    return stamp_us if -_NEWEST_US <= time_us - stamp_us <= _OLDEST_US else time_us
