"""The memory card of one vehicle, as passed to its autopilot: its files and its use."""

from dataclasses import dataclass, field

from autopilot_bridge.storage.files import FileStore
from autopilot_bridge.storage.memory import MemoryStore


@dataclass(slots=True, kw_only=True)
class MemoryCard:
    """The data that persist when the autopilot boots again.

    Attributes:
        files: the card's own file system; by default in memory, empty.
        logs: flights are logged on it.
        boots: number of boots of an autopilot with it, in this run.
    """

    files: FileStore = field(default_factory=MemoryStore)
    logs: bool = False
    boots: int = 0
