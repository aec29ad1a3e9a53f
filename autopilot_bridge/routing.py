"""Destinations of a frame: the MAVLink routing guide ("Routing", https://mavlink.io/en/guide/routing.html).

A frame goes to every other channel when it has no target or targets all systems (system 0); otherwise only to
channels on which messages of the target system (and the target component, unless it is 0) were received. It
never goes back to its own channel. A key for signing (SETUP_SIGNING) is not forwarded.
"""

from collections.abc import Hashable
from typing import Final, Generic, TypeVar

from autopilot_bridge.mavlink.frame import Frame
from autopilot_bridge.mavlink.signing import SETUP_SIGNING

ChannelT = TypeVar("ChannelT", bound=Hashable)

MAX_COMPONENTS: Final = 256
"""Number of components remembered for a channel; those that were silent longest are forgotten."""


class Router(Generic[ChannelT]):
    """Routing table over channels of any kind (links, peers of a link, names).

    A channel must be hashable. Routing uses ids only, so no frame is packed again: forward `frame.raw`.
    """

    def __init__(self) -> None:
        self._senders: dict[ChannelT, dict[tuple[int, int], None]] = {}

    @property
    def channels(self) -> tuple[ChannelT, ...]:
        """All channels, in the order they were added."""
        return tuple(self._senders)

    def add(self, channel: ChannelT) -> None:
        """Add a channel; a second call does nothing."""
        self._senders.setdefault(channel, {})

    def remove(self, channel: ChannelT) -> None:
        """Forget a channel and its components."""
        self._senders.pop(channel, None)

    def senders(self, channel: ChannelT) -> frozenset[tuple[int, int]]:
        """(system id, component id) of all components received on a channel."""
        return frozenset(self._senders.get(channel, ()))

    def learn(self, frame: Frame, source: ChannelT) -> None:
        """Record that the sender of a frame is on `source`."""
        sender = (frame.system_id, frame.component_id)
        table = self._senders.get(source)
        if table is None:
            table = self._senders[source] = {}
        table.pop(sender, None)  # to the end: the first in the table was silent longest
        table[sender] = None
        if len(table) > MAX_COMPONENTS:
            del table[next(iter(table))]

    def route(self, frame: Frame, source: ChannelT) -> list[ChannelT]:
        """Learn from a frame received on `source` and return the channels that it is to be sent to."""
        self.learn(frame, source)
        if frame.message_id == SETUP_SIGNING:
            return []
        return self.destinations(frame.target_system, frame.target_component, source)

    def destinations(
        self, target_system: int, target_component: int, source: ChannelT | None = None
    ) -> list[ChannelT]:
        """Channels that lead to a target (0: all), without `source`."""
        return [
            channel
            for channel, senders in self._senders.items()
            if channel != source and _leads_to(senders, target_system, target_component)
        ]


def _leads_to(senders: dict[tuple[int, int], None], system: int, component: int) -> bool:
    if system == 0:
        return True
    if component == 0:
        return any(sender_system == system for sender_system, _ in senders)
    return (system, component) in senders


class LoopGuard:
    """Detects frames that return in a loop: the same bytes, received shortly before on another channel.

    Two links joined by a bridge would otherwise forward a frame for ever. Sequence numbers and
    time stamps make equal bytes from one sender rare; on the same channel they are a repetition, not a loop.

    Args:
        memory: number of frames that are remembered.
    """

    def __init__(self, memory: int = 512) -> None:
        self._received: dict[bytes, object] = {}
        self._memory = memory

    def comes_round(self, raw: bytes, channel: object) -> bool:
        """True when these bytes were received first on another channel; remembers them otherwise."""
        first = self._received.get(raw)
        if first is None:
            if len(self._received) >= self._memory:
                del self._received[next(iter(self._received))]
            self._received[raw] = channel
            return False
        return first != channel
