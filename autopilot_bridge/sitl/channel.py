"""A link as an autopilot's MAVLink channel: its own parser and its own sequence numbers."""

from autopilot_bridge.links import Link
from autopilot_bridge.mavlink import Frame, FrameEncoder, FrameParser
from autopilot_bridge.services.channel import MavlinkMessage


class LinkChannel:
    """One link of one autopilot.

    Args:
        name: how the channel is called in tables and reports; unique per autopilot.
        link: where bytes go and come from.
        system_id, component_id: the autopilot's.
    """

    __slots__ = ("_encoder", "_parsers", "link", "name")

    def __init__(self, name: str, link: Link, *, system_id: int, component_id: int = 1) -> None:
        self.name = name
        self.link = link
        self._encoder = FrameEncoder(system_id, component_id)
        self._parsers: dict[object, FrameParser] = {}

    @property
    def congested(self) -> bool:
        """The link's queue is filling: lists should pause."""
        return self.link.congested

    @property
    def parsers(self) -> tuple[FrameParser, ...]:
        """One parser per peer; their counters account for every byte received."""
        return tuple(self._parsers.values())

    def send(self, message: MavlinkMessage) -> None:
        """Frame a message and send it."""
        self.link.send(self._encoder.encode(message))

    def send_payload(self, message_id: int, payload: bytes) -> None:
        """Frame an already packed payload and send it."""
        self.link.send(self._encoder.encode_payload(message_id, payload))

    def send_frame(self, raw: bytes) -> None:
        """Forward somebody else's frame as it is."""
        self.link.send(raw)

    def receive(self) -> list[Frame]:
        """Every good frame that has arrived."""
        frames: list[Frame] = []
        for peer, data in self.link.receive():
            parser = self._parsers.get(peer)
            if parser is None:
                parser = self._parsers[peer] = FrameParser()
            frames += parser.feed(data)
        return frames
