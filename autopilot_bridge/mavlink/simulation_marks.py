"""How simulated autopilots identify themselves in AUTOPILOT_VERSION.

PX4's SITL builds have the board id "SIMULATIONID0000" (`BOARD_OVERRIDE_UUID` of the board px4/sitl); every
other board has the id of its processor or a name of its own. Instances add their system id less 1 to it.
ArduPilot's SITL reports the id of the machine that it runs on, as its builds for Linux boards do, so its
version proves nothing; our own emulation of ArduPilot is named in `uid2`.
"""

from typing import Final

from autopilot_bridge.mavlink import dialect

PX4_SITL_UID: Final = int.from_bytes(b"ITALDINO")
"""AUTOPILOT_VERSION.uid of PX4's SITL with system id 1: two words of its board id, each with its last byte
first.
"""
FLIGHTSTACK_UID2: Final = b"flightstack-sitl".ljust(18, b"\0")
"""AUTOPILOT_VERSION.uid2 of our emulation of ArduPilot."""

_MOST_INSTANCES: Final = 255


def is_sitl_version(version: dialect.MAVLink_autopilot_version_message) -> bool:
    """Whether an AUTOPILOT_VERSION is that of PX4's SITL, or of our own."""
    if 0 <= int(version.uid) - PX4_SITL_UID < _MOST_INSTANCES:
        return True
    return bytes(version.uid2) == FLIGHTSTACK_UID2
