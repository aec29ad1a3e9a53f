"""The streams of one channel, reduced to fit the capacity of its line and its radio."""

from typing import Final

from autopilot_bridge.telemetry.line import (
    LEAST_SHARE,
    MICROSECONDS,
    USED_SHARE,
    FlowControl,
    LineBudget,
    RadioFlow,
    fit,
)
from autopilot_bridge.telemetry.streams import StreamTable

_EVERY_US: Final = MICROSECONDS
_LEAST_MULTIPLIER: Final = 0.05
"""A radio slows the fast streams down to this fraction of their rates; below it, all streams (PX4's
minimum).
"""


class StreamThrottle:
    """Thins the streams of a table. Data of other components of the vehicle (a camera, a
    gimbal) are not thinned: the table gets the remaining capacity.

    Args:
        table: the channel's streams.
        line: its line's capacity; None: only a radio limits it.
        control: how the firmware follows a radio's buffer.

    Attributes:
        radio: the state that a radio on the channel has reported.
    """

    def __init__(self, table: StreamTable, line: LineBudget | None, control: FlowControl) -> None:
        self.radio = RadioFlow(control)
        self._table = table
        self._line = line
        self._due_us = 0
        self._forwarded_bytes = 0
        self._others_bytes_per_s = 0.0

    def advance(self, time_us: int) -> None:
        """Update the line, and regularly fit the rates again. Called at 50 Hz."""
        if self._line is not None:
            self._line.advance(time_us)
        if time_us < self._due_us:
            return
        self._due_us = time_us + _EVERY_US
        if self._line is not None:
            others = (self._line.forwarded_bytes - self._forwarded_bytes) * MICROSECONDS / _EVERY_US
            self._forwarded_bytes = self._line.forwarded_bytes
            self._others_bytes_per_s += 0.5 * (others - self._others_bytes_per_s)
        self.radio.advance(time_us)
        self.fit()

    def fit(self) -> None:
        """Set the rates."""
        multiplier, stretch = 1.0, 1.0
        if self._line is not None:
            whole = self._line.bytes_per_s
            rest = max(LEAST_SHARE * whole, USED_SHARE * whole - self._others_bytes_per_s)
            multiplier, stretch = fit(self._table.loads(), rest)
        radio = self.radio.multiplier
        if radio < multiplier:
            multiplier, stretch = radio, max(stretch, _LEAST_MULTIPLIER / radio)
        self._table.thin(multiplier, stretch, self.radio.slowdown_us)
