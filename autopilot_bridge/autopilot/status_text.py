"""STATUSTEXT: the texts that a ground station shows; long texts are sent in chunks."""

from typing import Final

from autopilot_bridge.commander.events import Event
from autopilot_bridge.dispatch import receives
from autopilot_bridge.firmware.flavour import Flavour
from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.services.channel import Broadcast, Channel, Source
from autopilot_bridge.services.microservice import Microservice

CHUNK_BYTES: Final = 50
_MAX_CHUNKS: Final = 5
_MAX_ID: Final = 0xFFFF


class StatusTextService(Microservice):
    """Sends texts on all channels. In some flavours a channel gets no texts before a heartbeat.

    Args:
        flavour: texts of events, and whether a heartbeat is awaited.
        broadcast: all channels.
    """

    def __init__(self, flavour: Flavour, broadcast: Broadcast) -> None:
        self._flavour = flavour
        self._broadcast = broadcast
        self._greeted: set[str] = set()
        self._next_id = 1

    @receives(dialect.MAVLink_heartbeat_message)
    def _on_heartbeat(self, message: dialect.MAVLink_heartbeat_message, source: Source, time_us: int) -> None:
        self._greeted.add(source.channel.name)

    def forget(self, channel: Channel) -> None:
        """Forget a channel that was closed."""
        self._greeted.discard(channel.name)

    def follow(self, event: Event) -> None:
        """Announce an event with the flavour's text."""
        end = "\t" if self._flavour.texts.repeated_by_events else ""  # marks a text that an EVENT repeats
        for notice in self._flavour.texts.notices(event):
            self.announce(notice.severity, notice.text + end)

    def banner(self, channel: Channel) -> None:
        """Send the firmware's identification, as after a parameter list request on a channel."""
        if self._listens(channel):
            for notice in self._flavour.texts.banner:
                for message in self._messages(int(notice.severity), notice.text):
                    channel.send(message)

    def announce(self, severity: int, text: str) -> None:
        """Send a text (MAV_SEVERITY) on every channel that gets texts."""
        channels = [channel for channel in self._broadcast.channels if self._listens(channel)]
        if not channels:
            return
        for message in self._messages(int(severity), text):
            for channel in channels:
                channel.send(message)

    def _listens(self, channel: Channel) -> bool:
        return (
            not self._flavour.texts.need_heartbeat
            or channel.name in self._greeted
            or getattr(channel, "receives_all", False)  # a log
        )

    def _messages(self, severity: int, text: str) -> list[MAVLinkMessage]:
        """One message, or the chunks of a long text: id and chunk_seq as in MAVLink's STATUSTEXT."""
        data = text.encode("ascii", "replace")[: CHUNK_BYTES * _MAX_CHUNKS]
        if len(data) <= CHUNK_BYTES:
            return [dialect.MAVLink_statustext_message(severity, data, 0, 0)]
        text_id = self._next_id
        self._next_id = 1 if text_id == _MAX_ID else text_id + 1
        chunks = [data[start : start + CHUNK_BYTES] for start in range(0, len(data), CHUNK_BYTES)]
        if len(chunks[-1]) == CHUNK_BYTES:
            chunks.append(b"")  # a last chunk ends with a zero
        return [
            dialect.MAVLink_statustext_message(severity, chunk, text_id, number)
            for number, chunk in enumerate(chunks)
        ]
