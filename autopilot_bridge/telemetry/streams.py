"""The periodic messages of a channel, and when they are sent.

A `StreamTable` belongs to one channel. Every stream keeps its own due time, so any rate is exact on average
on the physics grid; the payload of a message that several channels send in the same step is built once
(`PayloadCache`). On a line of limited capacity streams are thinned (`thin`), and one that is due waits for
capacity: only its number waits, and the message is built when it is sent.
"""

from bisect import insort
from collections.abc import Callable, Mapping, Sequence
from heapq import heapify, heappush, heapreplace
from itertools import count
from typing import Final, Protocol

from autopilot_bridge.mavlink.definitions import definition
from autopilot_bridge.mavlink.frame import OVERHEAD_V2
from autopilot_bridge.telemetry.line import MICROSECONDS, LineBudget, thinned_us
from autopilot_bridge.telemetry.packing import Pack, values_packer

Values = tuple[object, ...]
Builder = Callable[[], Values | bytes | None]
"""Field values of a message in the order of its definition, or its packed payload; None: no values
available.
"""

GRID_US: Final = 10_000
"""Streams of 50 Hz and slower are sent on this grid of vehicle time; their rate stays exact on average."""
SLOW_US: Final = 2 * GRID_US
HEARTBEAT: Final = 0
"""Never thinned, never waits."""


class PayloadSink(Protocol):
    """The destination of a stream's packed payloads: one MAVLink channel."""

    def send_streams(self, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
        """Send the due motion messages (bits of `motion_bits`) and frames of payloads (message id, bytes)."""


class PayloadCache:
    """Builds and packs messages, once per physics step for all channels."""

    def __init__(self, builders: Mapping[int, Builder] | None = None) -> None:
        self._builders: dict[int, Builder] = {}
        self._packers: dict[int, Pack] = {}
        self._payloads: dict[int, bytes | None] = {}
        self.time_us = -1
        self.add(builders or {})

    def add(self, builders: Mapping[int, Builder]) -> None:
        """More messages; a builder replaces an earlier one of the same message."""
        self._builders.update(builders)
        for message_id in builders:
            self._packers[message_id] = values_packer(definition(message_id))

    def __contains__(self, message_id: int) -> bool:
        return message_id in self._builders

    def forget(self) -> None:
        """Build again, even within this step: something has changed."""
        self._payloads.clear()

    def at(self, time_us: int) -> dict[int, bytes | None]:
        """Payloads built so far at this step; the next step starts with none."""
        if time_us != self.time_us:
            self.time_us = time_us
            self._payloads.clear()
        return self._payloads

    def build(self, message_id: int) -> bytes | None:
        """Build and keep a payload of this step; None when no values are available."""
        values = self._builders[message_id]()
        payload = values if values is None or isinstance(values, bytes) else self._packers[message_id](values)
        self._payloads[message_id] = payload
        return payload

    def payload(self, message_id: int, time_us: int) -> bytes | None:
        """Packed payload of a message at this step, or None when no values are available."""
        payloads = self.at(time_us)
        return payloads[message_id] if message_id in payloads else self.build(message_id)


class _Group:
    """Streams that are always due together: one interval, one phase.

    Attributes:
        interval_us, due_us: requested time between two messages, and time at which the next ones are due.
        step_us: time between two messages as sent: longer where streams are thinned.
        message_ids: the streams, in rising order, without those of `motion`.
        motion: bits of the motion messages among them.
    """

    def __init__(self, interval_us: int, due_us: int) -> None:
        self.interval_us = interval_us
        self.step_us = interval_us
        self.due_us = due_us
        self.message_ids: list[int] = []
        self.motion = 0

    @property
    def wake_us(self) -> int:
        """Time at which they are sent: the slower ones wait for the grid, to share a packet with others."""
        return self.due_us if self.step_us < SLOW_US else -(-self.due_us // GRID_US) * GRID_US


class StreamTable:
    """The periodic messages of one channel.

    Args:
        cache: provides the payloads.
        sink: the channel.
        rates_hz: message id -> rate of the streams that run from the start.
        physics_step_us: no stream runs faster than the physics.
        motion_bits: messages that the sink frames by itself, and their bits.
        line: capacity of the channel's line; None: unlimited.
    """

    NEVER: Final = 1 << 62

    def __init__(
        self,
        cache: PayloadCache,
        sink: PayloadSink,
        rates_hz: Mapping[int, float],
        *,
        physics_step_us: int,
        motion_bits: Mapping[int, int] | None = None,
        line: LineBudget | None = None,
    ) -> None:
        self._cache = cache
        self._line = line
        self._thinning: tuple[float, float, int] = (1.0, 1.0, 0)
        self._waiting: dict[int, None] = {}  # due and not sent: those that wait longest come first
        self._sizes: dict[int, int] = {}  # frames as last sent
        self._motion_bits = motion_bits or {}
        self._sink = sink
        self._step_us = physics_step_us
        self._serials = count()  # distinguish groups with the same wake time
        self._heap: list[tuple[int, int, _Group]] = []
        self._groups: dict[int, _Group] = {}
        self._intervals_us: dict[int, int] = {}
        self._defaults_us = {
            message_id: max(physics_step_us, round(MICROSECONDS / rate_hz))
            for message_id, rate_hz in rates_hz.items()
            if message_id in cache
        }
        self.next_due_us = self.NEVER
        for message_id, interval_us in self._defaults_us.items():
            self._start(message_id, interval_us, interval_us)

    @property
    def intervals_us(self) -> Mapping[int, int]:
        """Running streams: message id -> interval."""
        return self._intervals_us

    def default_interval_us(self, message_id: int) -> int:
        """Interval of the stream in the channel's default set; -1 when it is not in it."""
        return self._defaults_us.get(message_id, -1)

    def set_interval(self, message_id: int, interval_us: int, time_us: int) -> None:
        """Run a stream at a new interval (us) or stop it (-1). The next one is due after one interval."""
        self._stop(message_id)
        if interval_us > 0:
            interval_us = max(interval_us, self._step_us)
            self._start(message_id, interval_us, time_us + interval_us)

    def delay(self, message_id: int, due_us: int) -> None:
        """Send the next message of a running stream at `due_us`."""
        interval_us = self._intervals_us.get(message_id)
        if interval_us is not None:
            self._stop(message_id)
            self._start(message_id, interval_us, due_us)

    def set_default(self, message_id: int, interval_us: int, time_us: int) -> None:
        """Change the default of a stream (-1: none) and run it so, as a stream-rate parameter does."""
        if interval_us > 0:
            self._defaults_us[message_id] = interval_us
        else:
            self._defaults_us.pop(message_id, None)
        self.set_interval(message_id, interval_us, time_us)

    def loads(self) -> list[tuple[int, float]]:
        """Requested interval (us) and size (bytes of a frame) of the streams that may be thinned."""
        sizes = self._sizes
        return [
            (interval_us, sizes.get(number, OVERHEAD_V2 + definition(number).size))
            for number, interval_us in self._intervals_us.items()
            if number != HEARTBEAT
        ]

    def thin(self, multiplier: float, stretch: float, slowdown_us: int) -> None:
        """Send all streams but the heartbeat at a lower rate than requested (`line.thinned_us`)."""
        thinning = (multiplier, stretch, slowdown_us)
        if thinning != self._thinning:
            self._thinning = thinning
            for _, _, group in self._heap:
                self._pace(group)

    def tick(self, time_us: int) -> None:
        """Send the messages that are due."""
        heap, cache = self._heap, self._cache
        motion = 0
        woken: list[tuple[int, list[int]]] = []
        next_us = heap[0][0] if heap else self.NEVER
        while next_us <= time_us:
            wake_us, serial, group = heap[0]
            step_us = group.step_us
            due_us = group.due_us + step_us
            if due_us <= time_us:  # a stream never sends several messages at once to catch up
                due_us = time_us + step_us
            group.due_us = due_us
            if step_us >= SLOW_US:  # as in `wake_us`
                due_us = -(-due_us // GRID_US) * GRID_US
            heapreplace(heap, (due_us, serial, group))
            next_us = heap[0][0]
            motion |= group.motion
            if group.message_ids:
                woken.append((wake_us, group.message_ids))
        self.next_due_us = next_us
        if self._line is not None:
            self._send_within(self._line, motion, woken, time_us)
            return
        due: list[tuple[int, bytes]] = []
        if woken:
            payloads = cache.at(time_us)
            for message_id in woken[0][1] if len(woken) == 1 else _in_order(woken):
                payload = payloads[message_id] if message_id in payloads else cache.build(message_id)
                if payload is not None:
                    due.append((message_id, payload))
        if motion or due:
            self._sink.send_streams(motion, due)

    def _send_within(
        self, line: LineBudget, motion: int, woken: list[tuple[int, list[int]]], time_us: int
    ) -> None:
        """Send the messages that the line has capacity for; the other due ones wait, each stream once."""
        waiting = self._waiting
        for message_id, bit in self._motion_bits.items():
            if motion & bit:
                waiting[message_id] = None
        for message_id in _in_order(woken):
            waiting[message_id] = None
        room = line.stream_room_bytes
        bits = 0
        due: list[tuple[int, bytes]] = []
        if HEARTBEAT in waiting:
            room -= self._take(HEARTBEAT, due, time_us)
        while waiting and room > 0.0:
            message_id = next(iter(waiting))
            if message_id not in self._motion_bits:
                size = self._take(message_id, due, time_us)
            else:
                del waiting[message_id]
                bits |= self._motion_bits[message_id]
                size = OVERHEAD_V2 + definition(message_id).size
            room -= size
            line.spend_share(size)
        if waiting:
            self.next_due_us = min(self.next_due_us, time_us + GRID_US)
        if bits or due:
            self._sink.send_streams(bits, due)

    def _take(self, message_id: int, due: list[tuple[int, bytes]], time_us: int) -> int:
        """Build a message that waited; returns the size of its frame, 0 when no values are available."""
        del self._waiting[message_id]
        payload = self._cache.payload(message_id, time_us)
        size = 0
        if payload is not None:
            due.append((message_id, payload))
            size = OVERHEAD_V2 + len(payload.rstrip(b"\0"))
        self._sizes[message_id] = size
        return size

    def _pace(self, group: _Group) -> None:
        thinned = HEARTBEAT not in group.message_ids
        group.step_us = thinned_us(group.interval_us, *self._thinning) if thinned else group.interval_us

    def _start(self, message_id: int, interval_us: int, due_us: int) -> None:
        self._intervals_us[message_id] = interval_us
        alone = message_id == HEARTBEAT
        for _, _, group in self._heap:
            if (group.interval_us, group.due_us) == (interval_us, due_us) and not (
                alone or HEARTBEAT in group.message_ids
            ):
                break
        else:
            group = _Group(interval_us, due_us)
            if not alone:
                group.step_us = thinned_us(interval_us, *self._thinning)
            heappush(self._heap, (group.wake_us, next(self._serials), group))
            self.next_due_us = self._heap[0][0]
        self._groups[message_id] = group
        if message_id in self._motion_bits:
            group.motion |= self._motion_bits[message_id]
        else:
            insort(group.message_ids, message_id)

    def _stop(self, message_id: int) -> None:
        self._intervals_us.pop(message_id, None)
        self._waiting.pop(message_id, None)
        group = self._groups.pop(message_id, None)
        if group is None:
            return
        if message_id in self._motion_bits:
            group.motion &= ~self._motion_bits[message_id]
        else:
            group.message_ids.remove(message_id)
        if not group.motion and not group.message_ids:
            self._heap = [entry for entry in self._heap if entry[2] is not group]
            heapify(self._heap)
            self.next_due_us = self._heap[0][0] if self._heap else self.NEVER


def _in_order(woken: list[tuple[int, list[int]]]) -> list[int]:
    """Message ids of several groups: those with an earlier wake time first, then by their numbers."""
    return [
        message_id
        for _, message_id in sorted((wake_us, number) for wake_us, numbers in woken for number in numbers)
    ]
