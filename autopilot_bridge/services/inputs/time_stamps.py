"""Time stamps of other computers' measurements."""

from typing import Final

_OLDEST_US: Final = 500_000
_NEWEST_US: Final = 20_000


def in_vehicle_time(stamp_us: int, time_us: int) -> int:
    """The time of a measurement, microseconds of vehicle time.

    Args:
        stamp_us: time stamp in the message.
        time_us: time of arrival, returned for a stamp of another clock (TIMESYNC provides the vehicle's
            clock).
    """
    return stamp_us if -_NEWEST_US <= time_us - stamp_us <= _OLDEST_US else time_us
