"""Input checks of an estimator: rejects late, repeated and non-finite samples, reports time jumps."""

from collections.abc import Hashable
from math import isfinite
from typing import Final

from estimators.interface import Outcome

NEW_BOOT_US: Final = 1_000_000
"""Time that goes back by more than this means that the vehicle has rebooted, not that a message is late."""


class InputGuard:
    """Checks the time and the values of samples before an estimator uses them. One guard serves one vehicle.

    Streams are distinguished by a key, such as the message's name. Each has its own newest time, because the
    messages of one vehicle need not arrive in the order of their times across streams.

    Args:
        max_gap_us: longest gap of a leading stream that the estimator can bridge; None: any.
    """

    def __init__(self, max_gap_us: int | None = None) -> None:
        if max_gap_us is not None and max_gap_us <= 0:
            raise ValueError(f"max_gap_us {max_gap_us} is not above 0; None accepts any gap")
        # Larger than any vehicle time, so that one comparison replaces two.
        self._max_gap_us = 1 << 62 if max_gap_us is None else max_gap_us
        self._last: dict[Hashable, tuple[int, tuple[float, ...]]] = {}

    def check(
        self, time_us: int, key: Hashable, values: tuple[float, ...], leads: bool = True
    ) -> Outcome | None:
        """Check one sample.

        Args:
            time_us: vehicle time.
            key: the stream.
            values: the numbers that the estimator is going to use.
            leads: whether a gap of this stream counts as a time jump; a pause of a slow or optional stream is
                no reason to restart.

        Returns:
            None for a sample to use: it is newer than the one before it in its stream, or has the same time
            and other values (messages without their own time stamp), so a time difference of zero is
            possible. NOT_FINITE, LATE or REPEATED for a sample to reject. TIME_JUMP: restart with this
            sample, as the guard has already done.
        """
        if not isfinite(sum(values)):  # the sum is not finite if any value is NaN or infinite
            return Outcome.NOT_FINITE
        before = self._last.get(key)
        if before is not None:
            ahead_us = time_us - before[0]
            if ahead_us <= 0:
                if ahead_us < -NEW_BOOT_US:
                    self._last.clear()
                    self._last[key] = (time_us, values)
                    return Outcome.TIME_JUMP
                if ahead_us < 0:
                    return Outcome.LATE
                if values == before[1]:
                    return Outcome.REPEATED
            elif ahead_us > self._max_gap_us and leads:
                self._last.clear()
                self._last[key] = (time_us, values)
                return Outcome.TIME_JUMP
        self._last[key] = (time_us, values)
        return None

    def reset(self) -> None:
        """Forget all streams."""
        self._last.clear()
