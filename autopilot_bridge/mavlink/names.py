"""Names of MAVLink's enumerations, for texts to users."""

from typing import Final

from autopilot_bridge.mavlink import dialect

_ENUMS: Final = dialect.enums


def enum_name(enum: str, value: int, *, prefix: str = "") -> str | None:
    """An entry's name without the common prefix; None: there is no such entry.

    Args:
        enum: name in the definitions ("MAV_CMD").
        value: of the entry.
        prefix: common prefix of the names; "": the enumeration's own name and an underscore.
    """
    entry = _ENUMS[enum].get(value)
    return None if entry is None else str(entry.name).removeprefix(prefix or f"{enum}_")


def command_name(command: int) -> str:
    """The name of a MAV_CMD: "NAV_TAKEOFF"."""
    return enum_name("MAV_CMD", command) or f"command {command}"
