"""The vehicle's memory card: files that persist over a boot, behind one interface."""

from autopilot_bridge.storage.files import (
    FOLDER_QUOTA,
    MEMORY_QUOTA,
    TEMPORARY_QUOTA,
    Entry,
    FileStore,
    Mode,
    OpenFile,
    Quota,
    VehiclePath,
    parse_path,
)
from autopilot_bridge.storage.memory import MemoryStore
from autopilot_bridge.storage.mounts import MountTable

__all__ = [
    "FOLDER_QUOTA",
    "MEMORY_QUOTA",
    "TEMPORARY_QUOTA",
    "Entry",
    "FileStore",
    "MemoryStore",
    "Mode",
    "MountTable",
    "OpenFile",
    "Quota",
    "VehiclePath",
    "parse_path",
]
