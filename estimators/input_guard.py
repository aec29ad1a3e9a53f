"""What an estimator may use: late, repeated and non-finite samples are kept out, jumps of time are told."""

from collections.abc import Hashable
from math import isfinite
from typing import Final

from estimators.interface import Outcome

__all__ = ["NEW_BOOT_US", "InputGuard"]

NEW_BOOT_US: Final = 1_000_000
"""Time that goes back by more than this is a vehicle that has started anew, not a late message."""


class InputGuard:
    """Judges samples by their time and values before an estimator uses them. One guard serves one vehicle.

    Streams are told apart by a key, such as the message's name: each has its own newest time, because the
    messages of one vehicle need not come in the order of their times across streams.

    Args:
        max_gap_us: longest silence of a leading stream that the estimator can bridge; None: any.
    """

    __slots__ = ("_last", "_max_gap_us")

    def __init__(self, max_gap_us: int | None = None) -> None:
        if max_gap_us is not None and max_gap_us <= 0:
            raise ValueError(f"max_gap_us {max_gap_us} is not above 0; None accepts any gap")
        # Beyond any time that a vehicle can have: one comparison in place of two.
        self._max_gap_us = 1 << 62 if max_gap_us is None else max_gap_us
        self._last: dict[Hashable, tuple[int, tuple[float, ...]]] = {}

    def check(
        self, time_us: int, key: Hashable, values: tuple[float, ...], leads: bool = True
    ) -> Outcome | None:
        """Judge one sample.

        Args:
            time_us: vehicle time.
            key: the stream.
            values: what the estimator is going to use, as a tuple of numbers.
            leads: whether a gap of this stream is one that the estimator must bridge; a slow or optional
                stream that pauses is no reason to start anew.

        Returns:
            None for a sample to use: newer than the one before it in its stream, or as new with other values
            (messages without a time of their own), so a time difference of zero is possible. NOT_FINITE, LATE
            or REPEATED for one to leave out. TIME_JUMP: forget what was and start with this sample, as the
            guard already has.
        """
        if not isfinite(sum(values)):  # one sum sees any NaN or infinity among them
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
