"""The memory card of one vehicle, as its autopilot is given it: where it is kept and what it is for."""

from dataclasses import dataclass, field

from autopilot_bridge.storage.files import FileStore
from autopilot_bridge.storage.memory import MemoryStore


@dataclass(slots=True, kw_only=True)
class MemoryCard:
    """What stays when the autopilot boots again.

    Attributes:
        files: the card's own file system; by default in memory, empty.
        logs: flights are logged on it.
        boots: how often an autopilot was started with it, in this run.
    """

    files: FileStore = field(default_factory=MemoryStore)
    logs: bool = False
    boots: int = 0
