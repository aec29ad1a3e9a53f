"""The basis of the MAVLink microservices: channels, message sources and the interface of a service.

A service does no I/O: the autopilot passes decoded messages and the time to it, and it answers through
channels. Message fields are untrusted: whatever their values, a service does not raise, and stores a message
whole or not.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

from autopilot_bridge.mavlink import MAVLinkMessage

Announce = Callable[[int, str], None]
"""Sends a STATUSTEXT: (MAV_SEVERITY, text)."""


class Channel(Protocol):
    """One MAVLink link as the autopilot sees it.

    `send` never blocks and never raises on a slow or lost peer. A channel may also have a boolean
    `congested`: while it is True, long answers (parameter lists) wait.
    """

    @property
    def name(self) -> str: ...

    def send(self, message: MAVLinkMessage, /) -> None: ...


class Broadcast(Protocol):
    """Every open channel of an autopilot; the sequence may change as links come and go."""

    @property
    def channels(self) -> Sequence[Channel]: ...


class Source(NamedTuple):
    """The sender of a message, and the channel on which it came: replies are sent there and nowhere else."""

    channel: Channel
    system_id: int
    component_id: int


class _Nowhere:
    """A channel that drops everything."""

    name = "nowhere"

    def send(self, message: MAVLinkMessage, /) -> None:
        """Drop the message."""


NO_CLIENT: Final = Source(channel=_Nowhere(), system_id=0, component_id=0)
"""The source of commands that the autopilot gives to itself."""


Receiver = Callable[[MAVLinkMessage, Source, int], None]
"""Handles one received message: (message, source, time_us). Never raises because of its contents."""


def send_to_all(broadcast: Broadcast, message: MAVLinkMessage) -> None:
    """Send one message on every channel of the autopilot."""
    for channel in broadcast.channels:
        channel.send(message)


def is_congested(channel: Channel) -> bool:
    """True when a channel that measures its backlog requests a pause."""
    return bool(getattr(channel, "congested", False))


@dataclass(frozen=True, slots=True, kw_only=True)
class AddressRule:
    """The target ids of messages that an autopilot accepts as its own.

    Attributes:
        system_id: the vehicle's own system id.
        component_ids: component ids answered besides 0 (all); None: any component id (ArduPilot).
        any_system: also answer target system 0 (ArduPilot; PX4 stays silent).
    """

    system_id: int
    component_ids: frozenset[int] | None
    any_system: bool

    def accepts(self, message: MAVLinkMessage) -> bool:
        """True when the message is for this autopilot; a message without target fields is for all systems."""
        system = getattr(message, "target_system", None)
        if system is None:
            return True
        if system != self.system_id and not (system == 0 and self.any_system):
            return False
        component = getattr(message, "target_component", 0)
        return component == 0 or self.component_ids is None or component in self.component_ids
