"""Which time stamps of a log are damaged.

Stamps advance with the file, but a log may have real jumps: a pause of hours, a clock that was set. A stamp
that is away from those before it is real when the stamps after it agree with it, and damaged when they agree
with those before it.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.kernels import kernel

NEAR_US: Final = 60_000_000
"""Stamps within a minute of the last one need no confirmation: messages are logged late, links read late."""

_VOTERS: Final = 8


@kernel
def plausible(stamps_us: NDArray[np.int64], longest_pause_us: int) -> NDArray[np.bool_]:
    """Mask of the stamps that are not damaged.

    Args:
        stamps_us: (n,) in the order of the file; negative: not a stamp.
        longest_pause_us: how far the first stamp may be before those that follow it, and the last one after
            those before it, which no other stamps confirm.
    """
    count = len(stamps_us)
    good = np.zeros(count, dtype=np.bool_)
    voters = np.empty(_VOTERS, dtype=np.int64)
    last = np.int64(-1)
    for index in range(count):
        stamp = stamps_us[index]
        if stamp < 0:
            continue
        if last >= 0 and abs(stamp - last) <= NEAR_US:
            good[index] = True
            last = stamp
            continue
        found = 0
        at = index + 1
        while at < count and found < _VOTERS:
            if stamps_us[at] >= 0:
                voters[found] = stamps_us[at]
                found += 1
            at += 1
        if last < 0:  # the first one
            middle = np.sort(voters[:found])[found // 2] if found else stamp
            if -NEAR_US <= middle - stamp <= longest_pause_us:
                good[index] = True
                last = stamp
        elif not found:
            good[index] = 0 < stamp - last <= longest_pause_us
        else:
            agree = 0
            for voter in voters[:found]:
                agree += 1 if abs(voter - stamp) < abs(voter - last) else -1
            if agree > 0:
                good[index] = True
                last = stamp
    return good


def span_us(stamps_us: NDArray[np.int64]) -> tuple[int, int]:
    """First and last of some stamps in any order, without the few that are far from all others.

    Args:
        stamps_us: (n,) at least one.
    """
    ordered = np.sort(stamps_us)
    low, high = 0, len(ordered) - 1
    for gap in np.flatnonzero(np.diff(ordered) > NEAR_US).tolist():
        if gap + 1 - low < _VOTERS and len(ordered) - gap - 1 >= _VOTERS:
            low = gap + 1
        elif high - gap < _VOTERS <= gap + 1:
            high = gap
            break
    return int(ordered[low]), int(ordered[high])


def first_offset_us(
    unix_us: NDArray[np.int64], times_us: NDArray[np.int64], dated: NDArray[np.bool_]
) -> int | None:
    """Unix time of time 0 from the first message whose date agrees with the others; None: no date.

    Args:
        unix_us, times_us: (n,) date and vehicle time of the messages.
        dated: (n,) whether each has a date.
    """
    offsets = (unix_us - times_us)[dated]
    if not len(offsets):
        return None
    agreeing = np.abs(offsets - np.sort(offsets)[len(offsets) // 2]) <= NEAR_US
    return int(offsets[np.argmax(agreeing)])
