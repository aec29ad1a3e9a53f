"""What microservices use of the computer that the autopilot runs on: its card, its clock, its power."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any, Final

from autopilot_bridge.services.parameters.parameter_file import StoredParameters
from autopilot_bridge.storage.memory import MemoryCard

LOG_ROLE: Final = "log"
"""The role of the channel that writes the vehicle's own log."""


class PowerAction(Enum):
    """What is done with the autopilot."""

    REBOOT = auto()
    SHUTDOWN = auto()


PowerHook = Callable[[PowerAction], None]
"""Executes the action, after the present step."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleMemory:
    """The card, the clock and the power of the autopilot's computer.

    Attributes:
        card: the memory card.
        stored: the parameters on it.
        time_us: returns the current time, microseconds since boot.
        unix_epoch_us: Unix time of boot.
        add_channel: starts the streams of a role on a channel: (channel, role).
        remove_channel: ends them.
        power: restarts the vehicle, or shuts it down; None: not possible.
    """

    card: MemoryCard
    stored: StoredParameters
    time_us: Callable[[], int]
    unix_epoch_us: int
    add_channel: Callable[[Any, str], None]
    remove_channel: Callable[[Any], None]
    power: PowerHook | None

    def unix_us(self) -> int:
        """The current time, microseconds of the Unix epoch."""
        return self.unix_epoch_us + self.time_us()
