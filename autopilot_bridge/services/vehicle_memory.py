"""What microservices reach of the computer that the autopilot runs on: its card, its clock, its power."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, Final

from autopilot_bridge.services.stored_parameters import StoredParameters
from autopilot_bridge.storage.card import MemoryCard

LOG_ROLE: Final = "log"
"""Of the channel that ends in the vehicle's own log."""


class PowerAction(Enum):
    """What happens to the autopilot."""

    REBOOT = auto()
    SHUTDOWN = auto()


PowerHook = Callable[[PowerAction], None]
"""Carries it out, after the present step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleMemory:
    """See above.

    Attributes:
        card: the memory card.
        stored: the parameters on it.
        time_us: the time now, microseconds since boot.
        unix_epoch_us: Unix time of boot.
        add_channel: starts the streams of a role on a channel: (channel, role).
        remove_channel: ends them.
        power: restarts the vehicle, or shuts it down; None: nobody can.
    """

    card: MemoryCard
    stored: StoredParameters
    time_us: Callable[[], int]
    unix_epoch_us: int
    add_channel: Callable[[Any, str], None]
    remove_channel: Callable[[Any], None]
    power: PowerHook | None

    def unix_us(self) -> int:
        """The time now, microseconds of the Unix epoch."""
        return self.unix_epoch_us + self.time_us()
