"""SET_MESSAGE_INTERVAL, GET_MESSAGE_INTERVAL, REQUEST_MESSAGE and ArduPilot's REQUEST_DATA_STREAM.

The results are those of docs/firmware/px4.md, sections 6 and 7, and docs/firmware/ardupilot.md, section 2;
`IntervalPolicy` holds the differences.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

from autopilot_bridge.commander.verdict import Result
from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.definitions import DEFINITIONS
from autopilot_bridge.services.channel import Channel, Source
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.telemetry.line import MICROSECONDS
from autopilot_bridge.telemetry.streams import PayloadCache, StreamTable

ALL_STREAMS: Final = dialect.MAV_DATA_STREAM_ALL


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalPolicy:
    """The differences of one firmware.

    Attributes:
        unknown_set, unknown_get, unknown_request: results for a message the firmware does not send.
        fixed: messages whose interval can't be set (PX4: HEARTBEAT).
        not_requestable: messages that only the firmware decides to send: a client can neither
            request them nor set their interval.
        refuse_empty: a request for a message that has no values now is refused (PX4).
        refuse_running: messages whose request is refused while the link streams them: the stream has sent
            their newest sample already (PX4).
        max_rate_hz: fastest stream that is accepted; faster ones are denied with a text.
        groups: REQUEST_DATA_STREAM group -> message ids; empty: the message is ignored.
        unknown_text, too_fast_text: texts to the pilot, with the message id; empty: no text.
    """

    unknown_set: Result
    unknown_get: Result
    unknown_request: Result
    fixed: frozenset[int] = frozenset()
    not_requestable: frozenset[int] = frozenset()
    refuse_empty: bool = False
    refuse_running: frozenset[int] = frozenset()
    max_rate_hz: float = math.inf
    groups: Mapping[int, tuple[int, ...]] = field(default_factory=dict)
    unknown_text: str = ""
    too_fast_text: str = ""


class MessageIntervalService(Microservice):
    """Changes the streams of every channel, and answers requests about them.

    Args:
        policy: the firmware's behaviour.
        tables: the stream table of each channel, by channel name; the mapping may grow.
        cache: builds the messages.
        announce: sends a STATUSTEXT (MAV_SEVERITY, text).

    Attributes:
        requested: messages that are only sent on request: id -> function (channel, param2).
    """

    def __init__(
        self,
        policy: IntervalPolicy,
        tables: Mapping[str, StreamTable],
        cache: PayloadCache,
        announce: Callable[[int, str], None],
    ) -> None:
        self._policy = policy
        self._tables = tables
        self._cache = cache
        self._announce = announce
        self.requested: dict[int, Callable[[Channel, float], None]] = {}
        self._pending: dict[tuple[Channel, int, float], None] = {}  # two equal requests get one answer
        self._time_us = 0

    @receives(dialect.MAVLink_request_data_stream_message)
    def _on_data_stream(
        self, message: dialect.MAVLink_request_data_stream_message, source: Source, time_us: int
    ) -> None:
        self._time_us = time_us
        table = self._tables.get(source.channel.name)
        groups = self._policy.groups
        if table is not None and groups:
            chosen = groups if message.req_stream_id == ALL_STREAMS else (message.req_stream_id,)
            running = bool(message.start_stop) and message.req_message_rate > 0
            interval_us = round(MICROSECONDS / message.req_message_rate) if running else -1
            for group in chosen:
                for message_id in groups.get(group, ()):
                    table.set_default(message_id, interval_us, time_us)

    def tick(self, time_us: int) -> None:
        """Send what was requested since the last tick: always after the acknowledgement of the request."""
        self._time_us = time_us
        if not self._pending:
            return
        pending, self._pending = self._pending, {}
        for channel, message_id, parameter in pending:
            if message_id in self.requested:
                self.requested[message_id](channel, parameter)
                continue
            payload = self._cache.payload(message_id, time_us)
            if payload is not None:
                channel.send_payload(message_id, payload)  # type: ignore[attr-defined]

    def set_interval(self, source: Source, message_id: int, interval_us: float) -> Result:
        """MAV_CMD_SET_MESSAGE_INTERVAL: -1 off, 0 the channel's default, else an interval (us)."""
        table = self._tables.get(source.channel.name)
        if table is None or not math.isfinite(interval_us):
            return Result.DENIED
        if not self._known(message_id):
            if self._policy.unknown_text:
                self._announce(dialect.MAV_SEVERITY_WARNING, self._policy.unknown_text.format(message_id))
            return self._policy.unknown_set
        if message_id in self._policy.fixed:
            return Result.FAILED
        if interval_us < 0:
            table.set_interval(message_id, -1, self._time_us)
            return Result.ACCEPTED
        interval = round(min(interval_us, 1e12))
        if interval == 0:
            interval = table.default_interval_us(message_id)
        elif MICROSECONDS / interval > self._policy.max_rate_hz:
            if self._policy.too_fast_text:
                self._announce(dialect.MAV_SEVERITY_WARNING, self._policy.too_fast_text.format(message_id))
            return Result.DENIED
        table.set_interval(message_id, interval, self._time_us)
        return Result.ACCEPTED

    def get_interval(self, source: Source, message_id: int) -> Result:
        """MAV_CMD_GET_MESSAGE_INTERVAL: answers MESSAGE_INTERVAL, 0 when the message is not known."""
        table = self._tables.get(source.channel.name)
        interval_us, known = 0, self._known(message_id)
        if table is not None and known:
            interval_us = table.intervals_us.get(message_id, -1)
        if 0 <= message_id <= 0xFFFF:
            source.channel.send(
                dialect.MAVLink_message_interval_message(message_id, min(interval_us, 0x7FFFFFFF))
            )
        return Result.ACCEPTED if known else self._policy.unknown_get

    def request(self, source: Source, message_id: int, parameter: float = 0.0) -> Result:
        """MAV_CMD_REQUEST_MESSAGE: the message follows the acknowledgement."""
        if message_id in self.requested:
            self._pending[source.channel, message_id, parameter] = None
            return Result.ACCEPTED
        policy = self._policy
        if message_id not in DEFINITIONS or not self._known(message_id):
            return policy.unknown_request
        table = self._tables.get(source.channel.name)
        if message_id in policy.refuse_running and table is not None and message_id in table.intervals_us:
            return Result.DENIED
        if policy.refuse_empty and self._cache.payload(message_id, self._time_us) is None:
            return Result.DENIED
        self._pending[source.channel, message_id, parameter] = None
        return Result.ACCEPTED

    def _known(self, message_id: int) -> bool:
        """A client may request the message."""
        return message_id in self._cache and message_id not in self._policy.not_requestable
