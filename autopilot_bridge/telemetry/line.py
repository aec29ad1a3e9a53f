"""Lines with less capacity than the messages need: the share of it for streams, on vehicle time.

Answers (acknowledgements, parameters, mission items, files) are sent at once; streams get the rest, and at
least a quarter of the line, so that a list of parameters does not stop the telemetry. The data that wait for
the line are always less than a fraction of a second's worth.

PX4 scales the rates of its streams by the link's capacity (`Mavlink::update_rate_mult`), ArduPilot waits
for space in the transmit buffer (`GCS_MAVLINK::update_send`); both slow down when a radio's RADIO_STATUS
reports that its buffer fills.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

MICROSECONDS: Final = 1_000_000
USED_SHARE: Final = 0.85
"""Share of the line's capacity for all thinned streams together; the rest is for answers."""
LEAST_SHARE: Final = 0.25
"""Share of the line's capacity that is reserved for streams in any case."""
STREAMS_WAIT_S: Final = 0.1
"""Streams wait while the line has this backlog."""
LISTS_WAIT_S: Final = 0.2
"""Long answers pause while the line has this backlog."""
LATEST_S: Final = 0.3
"""Streams with the smallest share too wait while the line has this backlog."""
SLOW_US: Final = MICROSECONDS
"""Streams of 1 Hz and less are not thinned, and others not below 1 Hz, as long as all of them fit."""
_PASSES: Final = 4


class LineBudget:
    """The data passed to a line and not transmitted yet.

    Args:
        bytes_per_s: the line's capacity, bytes per second of vehicle time.

    Attributes:
        bytes_per_s: as given.
        backlog_bytes: data not transmitted yet.
        forwarded_bytes: total of other components' data, which are sent at once.

    Raises:
        ValueError: the capacity is not above 0.
    """

    def __init__(self, bytes_per_s: float) -> None:
        if not 0.0 < bytes_per_s < float("inf"):
            raise ValueError(f"capacity {bytes_per_s} bytes/s is not above 0")
        self.bytes_per_s = bytes_per_s
        self.backlog_bytes = 0.0
        self.forwarded_bytes = 0
        self._share_bytes = 0.0
        self._time_us = 0

    def advance(self, time_us: int) -> None:
        """Update the backlog to `time_us`."""
        carried = (time_us - self._time_us) * self.bytes_per_s / MICROSECONDS
        self._time_us = time_us
        self.backlog_bytes = max(0.0, self.backlog_bytes - carried)
        most = LEAST_SHARE * STREAMS_WAIT_S * self.bytes_per_s
        self._share_bytes = min(most, self._share_bytes + LEAST_SHARE * carried)

    def add(self, size: int) -> None:
        """Bytes were passed to the line."""
        self.backlog_bytes += size

    def forward(self, size: int) -> None:
        """Bytes of another component were passed to the line."""
        self.backlog_bytes += size
        self.forwarded_bytes += size

    def spend_share(self, size: int) -> None:
        """Bytes of streams were sent."""
        self._share_bytes -= size

    @property
    def congested(self) -> bool:
        """Long answers should pause."""
        return self.backlog_bytes > LISTS_WAIT_S * self.bytes_per_s

    @property
    def stream_room_bytes(self) -> float:
        """Bytes that streams may send now; if positive, one message may be sent, whatever its length."""
        free = STREAMS_WAIT_S * self.bytes_per_s - self.backlog_bytes
        if self.backlog_bytes > LATEST_S * self.bytes_per_s:
            return 0.0
        return max(free, self._share_bytes)


def thinned_us(interval_us: int, multiplier: float, stretch: float, slowdown_us: int) -> int:
    """Interval of a stream that is thinned.

    Args:
        interval_us: requested interval.
        multiplier: fraction of its rate that a fast stream keeps.
        stretch: factor on all intervals, when not even 1 Hz of all streams fits.
        slowdown_us: added for a radio whose buffer is short (ArduPilot).
    """
    kept = interval_us if interval_us >= SLOW_US else min(interval_us / multiplier, float(SLOW_US))
    return round(kept * stretch) + slowdown_us


def fit(streams: Collection[tuple[int, float]], bytes_per_s: float) -> tuple[float, float]:
    """Multiplier and stretch (see `thinned_us`) with which streams fit into a capacity.

    Args:
        streams: interval (us) and size (bytes) of each.
        bytes_per_s: capacity for all streams together.
    """
    slow = sum(size * MICROSECONDS / interval for interval, size in streams if interval >= SLOW_US)
    fast = [(interval, size) for interval, size in streams if interval < SLOW_US]
    least = slow + sum(size for _, size in fast)  # each of them at 1 Hz
    if least >= bytes_per_s:
        return 1e-6, least / bytes_per_s
    multiplier = 1.0
    for _ in range(_PASSES):  # streams that reach 1 Hz stay there, and the others are reduced further
        floored = sum(size for interval, size in fast if interval >= SLOW_US * multiplier)
        scaled = sum(
            size * MICROSECONDS / interval for interval, size in fast if interval < SLOW_US * multiplier
        )
        if scaled == 0.0:
            break
        found = min(1.0, (bytes_per_s - slow - floored) / scaled)
        if found == multiplier:
            break
        multiplier = found
    return multiplier, 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class FlowControl:
    """How a firmware follows the transmit buffer of a radio (RADIO_STATUS.txbuf, percent free).

    Attributes:
        factors: (below, factor): the rate of all streams is multiplied by the first factor that applies.
        recovery: (above, factor) of spare room.
        least: the smallest fraction of the rates.
        timeout_us: after this time without RADIO_STATUS the radio counts as gone; 0: never.
        slowdowns_ms: (below, milliseconds) added to all intervals.
        speedups_ms: (above, milliseconds taken off, only while more than) of spare room.
        most_ms: approximate limit of the slowdown.
    """

    factors: tuple[tuple[int, float], ...] = ()
    recovery: tuple[int, float] = (100, 1.0)
    least: float = 0.01
    timeout_us: int = 0
    slowdowns_ms: tuple[tuple[int, int], ...] = ()
    speedups_ms: tuple[tuple[int, int, int], ...] = ()
    most_ms: int = 2000


class RadioFlow:
    """The transmit buffer of a radio at the end of a channel, from its messages.

    Attributes:
        multiplier: fraction of their rates that streams keep.
        slowdown_us: added to all intervals.
    """

    def __init__(self, control: FlowControl) -> None:
        self._control = control
        self._received_us = 0
        self.multiplier = 1.0
        self.slowdown_us = 0

    def on_radio_status(self, free_percent: int, time_us: int) -> None:
        """A RADIO_STATUS was received: free part of the transmit buffer in percent."""
        control, slowdown_ms = self._control, self.slowdown_us // 1000
        self._received_us = time_us
        for below, factor in control.factors:
            if free_percent < below:
                self.multiplier = max(control.least, self.multiplier * factor)
                break
        else:
            if free_percent > control.recovery[0]:
                self.multiplier = min(1.0, self.multiplier * control.recovery[1])
        for below, more_ms in control.slowdowns_ms:
            if free_percent < below:
                if slowdown_ms < control.most_ms:
                    slowdown_ms += more_ms
                break
        else:
            for above, less_ms, than_ms in control.speedups_ms:
                if free_percent > above and slowdown_ms > than_ms:
                    slowdown_ms = max(0, slowdown_ms - less_ms)
                    break
        self.slowdown_us = slowdown_ms * 1000

    def advance(self, time_us: int) -> None:
        """Forget a radio that is gone."""
        timeout_us = self._control.timeout_us
        if timeout_us and time_us - self._received_us > timeout_us:
            self.multiplier = 1.0
