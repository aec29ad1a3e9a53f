"""The newest frames of each component that a connection receives.

Components come and go, and any sender can use any ids, so only a limited number of components is kept.
"""

from collections.abc import Mapping
from typing import Final

from autopilot_bridge.mavlink import Frame, MAVLinkMessage, Packet, decode

MAX_COMPONENTS: Final = 64

ComponentId = tuple[int, int]
"""System and component id."""


class NewestFrames:
    """The newest frame of each message of up to 64 components, decoded when requested.

    When there are too many, the component that was first received first is removed; it is added again when it
    is received again. Autopilots named with `keep` are never removed.
    """

    def __init__(self) -> None:
        self._packets: dict[ComponentId, dict[int, Packet]] = {}
        self._decoded: dict[ComponentId, dict[int, tuple[Packet, MAVLinkMessage]]] = {}
        self._kept: set[ComponentId] = set()

    def __len__(self) -> int:
        """Number of components."""
        return len(self._packets)

    @property
    def components(self) -> list[ComponentId]:
        """The components that were received and are still kept."""
        return list(self._packets)

    def of(self, component: ComponentId) -> Mapping[int, Frame]:
        """The present newest frames of a component, by message id."""
        packets = self._packets.get(component, {})
        return {message_id: packet.newest(message_id) for message_id, packet in packets.items()}

    def frame(self, component: ComponentId, message_id: int) -> Frame | None:
        """The newest frame with a message id from a component, or None."""
        packet = self._packets.get(component, {}).get(message_id)
        return None if packet is None else packet.newest(message_id)

    def keep(self, component: ComponentId) -> None:
        """Never remove this component."""
        self._kept.add(component)

    def put(self, packet: Packet) -> None:
        """Store the frames of a packet, each as the newest of its message."""
        component = packet.sender
        known = self._packets.get(component)
        newest = self._add(component) if known is None else known
        for message_id in packet.message_ids:  # quicker than `update` for so few
            newest[message_id] = packet

    def _add(self, component: ComponentId) -> dict[int, Packet]:
        if len(self._packets) >= MAX_COMPONENTS:
            oldest = next((known for known in self._packets if known not in self._kept), None)
            if oldest is not None:
                del self._packets[oldest]
                self._decoded.pop(oldest, None)
        return self._packets.setdefault(component, {})

    def latest(self, component: ComponentId, message_id: int) -> MAVLinkMessage | None:
        """The newest message with an id from a component, or None; decoded once."""
        packet = self._packets.get(component, {}).get(message_id)
        if packet is None:
            return None
        messages = self._decoded.setdefault(component, {})
        known = messages.get(message_id)
        if known is None or known[0] is not packet:
            known = messages[message_id] = (packet, decode(packet.newest(message_id)))
        return known[1]
