"""Lines that carry less than is to be said: how much of it streams may take, on vehicle time.

Answers (acknowledgements, parameters, mission items, files) go out at once; streams get what they leave, and
at least a quarter of the line, so that no list of parameters silences the vehicle. What waits for the line is
always less than a fraction of a second's worth.

PX4 scales the rates of its streams by what the link carries (`Mavlink::update_rate_mult`), ArduPilot waits
for space in the transmit buffer (`GCS_MAVLINK::update_send`); both slow down when a radio's RADIO_STATUS
tells that its buffer fills.
"""

from collections.abc import Collection
from dataclasses import dataclass
from typing import Final

MICROSECONDS: Final = 1_000_000
USED_SHARE: Final = 0.85
"""Of the line's capacity, what thinned streams take together; the rest is for answers."""
LEAST_SHARE: Final = 0.25
"""Of the line's capacity, what is kept for streams whatever answers there are."""
STREAMS_WAIT_S: Final = 0.1
"""Streams wait while the line is behind by so much."""
LISTS_WAIT_S: Final = 0.2
"""Long answers pause while the line is behind by so much."""
LATEST_S: Final = 0.3
"""However small their share, streams wait while the line is behind by so much."""
SLOW_US: Final = MICROSECONDS
"""Streams of 1 Hz and less are not thinned, nor others to less, as long as all these fit."""
_PASSES: Final = 4


class LineBudget:
    """What a line has been given and not carried yet.

    Args:
        bytes_per_s: what the line carries, bytes per second of vehicle time.

    Attributes:
        bytes_per_s: as given.
        backlog_bytes: on their way.
        forwarded_bytes: of other components, so far: sent at once, as they come.

    Raises:
        ValueError: the capacity is not above 0.
    """

    __slots__ = ("_share_bytes", "_time_us", "backlog_bytes", "bytes_per_s", "forwarded_bytes")

    def __init__(self, bytes_per_s: float) -> None:
        if not 0.0 < bytes_per_s < float("inf"):
            raise ValueError(f"capacity {bytes_per_s} bytes/s is not above 0")
        self.bytes_per_s = bytes_per_s
        self.backlog_bytes = 0.0
        self.forwarded_bytes = 0
        self._share_bytes = 0.0
        self._time_us = 0

    def advance(self, time_us: int) -> None:
        """The line has carried on until `time_us`."""
        carried = (time_us - self._time_us) * self.bytes_per_s / MICROSECONDS
        self._time_us = time_us
        self.backlog_bytes = max(0.0, self.backlog_bytes - carried)
        most = LEAST_SHARE * STREAMS_WAIT_S * self.bytes_per_s
        self._share_bytes = min(most, self._share_bytes + LEAST_SHARE * carried)

    def add(self, size: int) -> None:
        """Bytes were given to the line."""
        self.backlog_bytes += size

    def forward(self, size: int) -> None:
        """Bytes of another component were given to the line."""
        self.backlog_bytes += size
        self.forwarded_bytes += size

    def spend_share(self, size: int) -> None:
        """So many bytes of streams were sent."""
        self._share_bytes -= size

    @property
    def congested(self) -> bool:
        """Long answers should pause."""
        return self.backlog_bytes > LISTS_WAIT_S * self.bytes_per_s

    @property
    def stream_room_bytes(self) -> float:
        """What streams may send now; more than nothing: one message, however long it is."""
        free = STREAMS_WAIT_S * self.bytes_per_s - self.backlog_bytes
        if self.backlog_bytes > LATEST_S * self.bytes_per_s:
            return 0.0
        return max(free, self._share_bytes)


def thinned_us(interval_us: int, multiplier: float, stretch: float, slowdown_us: int) -> int:
    """Interval of a stream that is thinned.

    Args:
        interval_us: as asked for.
        multiplier: share of its rate that a fast stream keeps.
        stretch: factor on all intervals, when not even 1 Hz of everything fits.
        slowdown_us: added for a radio whose buffer is short (ArduPilot).
    """
    kept = interval_us if interval_us >= SLOW_US else min(interval_us / multiplier, float(SLOW_US))
    return round(kept * stretch) + slowdown_us


def fit(streams: Collection[tuple[int, float]], bytes_per_s: float) -> tuple[float, float]:
    """Multiplier and stretch (see `thinned_us`) with which streams fit into a capacity.

    Args:
        streams: interval (us) and size (bytes) of each.
        bytes_per_s: what they may take together.
    """
    slow = sum(size * MICROSECONDS / interval for interval, size in streams if interval >= SLOW_US)
    fast = [(interval, size) for interval, size in streams if interval < SLOW_US]
    least = slow + sum(size for _, size in fast)  # each of them at 1 Hz
    if least >= bytes_per_s:
        return 1e-6, least / bytes_per_s
    multiplier = 1.0
    for _ in range(_PASSES):  # streams that come down to 1 Hz stay there, the others make up for it
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
        least: the smallest share of the rates.
        timeout_us: without RADIO_STATUS for so long there is no radio; 0: kept.
        slowdowns_ms: (below, milliseconds) added to all intervals.
        speedups_ms: (above, milliseconds taken off, only while more than) of spare room.
        most_ms: slowed down to no more than about this.
    """

    factors: tuple[tuple[int, float], ...] = ()
    recovery: tuple[int, float] = (100, 1.0)
    least: float = 0.01
    timeout_us: int = 0
    slowdowns_ms: tuple[tuple[int, int], ...] = ()
    speedups_ms: tuple[tuple[int, int, int], ...] = ()
    most_ms: int = 2000


PX4_FLOW_CONTROL: Final = FlowControl(
    factors=((25, 0.8), (35, 0.975)), recovery=(50, 1.025), timeout_us=5 * MICROSECONDS
)
"""PX4's `Mavlink::update_radio_status`."""
ARDUPILOT_FLOW_CONTROL: Final = FlowControl(
    slowdowns_ms=((20, 60), (50, 20)), speedups_ms=((95, 40, 200), (90, 20, 0))
)
"""ArduPilot's `GCS_MAVLINK::handle_radio_status`."""


class RadioFlow:
    """What a radio at the end of a channel has told about its buffer.

    Attributes:
        multiplier: share of their rates that streams keep.
        slowdown_us: added to all intervals.
    """

    __slots__ = ("_control", "_heard_us", "multiplier", "slowdown_us")

    def __init__(self, control: FlowControl) -> None:
        self._control = control
        self._heard_us = 0
        self.multiplier = 1.0
        self.slowdown_us = 0

    def heard(self, free_percent: int, time_us: int) -> None:
        """A RADIO_STATUS came: percent of the transmit buffer that are free."""
        control, slowdown_ms = self._control, self.slowdown_us // 1000
        self._heard_us = time_us
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
        if timeout_us and time_us - self._heard_us > timeout_us:
            self.multiplier = 1.0
