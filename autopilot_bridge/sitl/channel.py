"""A link as an autopilot's MAVLink channel: a parser for each peer and its own sequence numbers."""

from collections.abc import Sequence
from dataclasses import fields
from typing import Final

from autopilot_bridge.links import Link, PeerId
from autopilot_bridge.mavlink import Frame, FrameEncoder, FrameParser, ParserCounters
from autopilot_bridge.services.channel import MavlinkMessage
from autopilot_bridge.telemetry.line import LineBudget
from autopilot_bridge.telemetry.motion import MotionMessages

_MAX_PARSERS: Final = 64
_MAX_PACKET: Final = 1400  # bytes: one datagram that no network splits
_MEMORY_PEER: Final[PeerId] = ("memory", 0)


class LinkChannel:
    """One link of one autopilot.

    Args:
        name: how the channel is called in tables and reports; unique per autopilot.
        link: where bytes go and come from.
        system_id, component_id: the autopilot's.
        line: what the link can carry; None: whatever there is.

    Attributes:
        motion: set by the autopilot that the channel is added to.
    """

    __slots__ = ("_encoder", "_parsers", "_retired", "line", "link", "motion", "name")

    def __init__(
        self,
        name: str,
        link: Link,
        *,
        system_id: int,
        component_id: int = 1,
        line: LineBudget | None = None,
    ) -> None:
        self.name = name
        self.link = link
        self.line = line
        self.motion: MotionMessages | None = None
        self._encoder = FrameEncoder(system_id, component_id)
        self._parsers: dict[PeerId, FrameParser] = {}
        self._retired = ParserCounters()

    @property
    def congested(self) -> bool:
        """The link's queue is filling: lists should pause."""
        return self.link.congested or (self.line is not None and self.line.congested)

    @property
    def counters(self) -> ParserCounters:
        """Where every received byte went, over all peers; `sources` is left out."""
        total = ParserCounters()
        for counters in (self._retired, *(parser.counters for parser in self._parsers.values())):
            _add(total, counters)
        return total

    @property
    def pending_bytes(self) -> int:
        """Bytes of frames that are not complete yet."""
        return sum(parser.pending_bytes for parser in self._parsers.values())

    def send(self, message: MavlinkMessage) -> None:
        """Frame a message and send it."""
        self._send(self._encoder.encode(message))

    def send_payload(self, message_id: int, payload: bytes) -> None:
        """Frame an already packed payload and send it."""
        self._send(self._encoder.encode_payload(message_id, payload))

    def send_streams(self, motion: int, payloads: Sequence[tuple[int, bytes]]) -> None:
        """Send what is due together, a packet of a network at most at a time."""
        packet = self.motion.frames(motion, self._encoder) if motion and self.motion is not None else b""
        for frame in self._encoder.encode_payloads(payloads) if payloads else ():
            if len(packet) + len(frame) > _MAX_PACKET:
                self._send(packet)
                packet = b""
            packet += frame
        if packet:
            self._send(packet)

    def send_frame(self, raw: bytes) -> None:
        """Forward somebody else's frame as it is."""
        self._send(raw)

    def _send(self, data: bytes) -> None:
        if self.line is not None:
            self.line.add(len(data))
        self.link.send(data)

    def receive(self) -> list[Frame]:
        """Every good frame that has arrived."""
        frames: list[Frame] = []
        for peer, data in self.link.receive():
            frames += self.parse(data, peer)
        return frames

    def parse(self, data: bytes, peer: PeerId = _MEMORY_PEER) -> list[Frame]:
        """The good frames in bytes of one peer, which may come in any pieces."""
        parser = self._parsers.get(peer)
        if parser is None:
            if len(self._parsers) >= _MAX_PARSERS:  # peers come and go: the oldest has had its say
                oldest = self._parsers.pop(next(iter(self._parsers)))
                _add(self._retired, oldest.counters)
                self._retired.bytes_junk += oldest.pending_bytes
            parser = self._parsers[peer] = FrameParser()
        return parser.feed(data)


def _add(total: ParserCounters, more: ParserCounters) -> None:
    for field in fields(ParserCounters):
        value = getattr(more, field.name)
        if isinstance(value, int):
            setattr(total, field.name, getattr(total, field.name) + value)
