"""Logs as other people's tools and our own reader see them."""

from collections import Counter
from pathlib import Path

from pymavlink import mavutil

from autopilot_bridge.mavlink import DEFINITIONS, Frame, decode, definition
from autopilot_bridge.tlog import TlogReader

HEARTBEAT = definition("HEARTBEAT").message_id
PX4_MODES = {
    0x00060000: "offboard",
    0x04040000: "mission",
    0x05040000: "return",
    0x03040000: "hold",
    0x06040000: "land",
}
ARDUPILOT_MODES = {3: "mission", 6: "return", 17: "hold", 5: "hold", 9: "land", 4: "guided"}
ARDUPLANE_MODES = {10: "mission", 11: "return", 12: "hold", 13: "takeoff", 15: "guided"}
FIXED_WING = 1
UNKNOWN = "UNKNOWN_"


def records(path: Path) -> list[tuple[int, Frame]]:
    """All records of a log that is whole: no byte of it may belong to none."""
    reader = TlogReader(path)
    found = list(reader)
    assert reader.counters.bytes_skipped == 0
    assert sum(8 + len(frame.raw) for _, frame in found) == path.stat().st_size
    return found


def counts(path: Path) -> Counter[str]:
    """Messages by name, as our reader sees them."""
    return Counter(DEFINITIONS[frame.message_id].name for _, frame in TlogReader(path))


def known_name(name: str) -> str:
    """A message's name by pymavlink's, which calls what is newer than its dialect UNKNOWN_n."""
    return DEFINITIONS[int(name.removeprefix(UNKNOWN))].name if name.startswith(UNKNOWN) else name


def mavutil_counts(path: Path) -> Counter[str]:
    """Messages by name, as pymavlink's mavutil reads the log."""
    log = mavutil.mavlink_connection(str(path), dialect="all")
    found: Counter[str] = Counter()
    while (message := log.recv_msg()) is not None:
        found[known_name(message.get_type())] += 1
    log.close()
    return found


def modes(path: Path) -> list[str]:
    """The autopilot's modes in the order in which heartbeats reported them, without repetitions."""
    names: list[str] = []
    for _, frame in TlogReader(path):
        if frame.message_id == HEARTBEAT and frame.component_id == 1:
            heartbeat = decode(frame)
            mode = heartbeat.custom_mode  # type: ignore[attr-defined]
            ardupilot = ARDUPLANE_MODES if heartbeat.type == FIXED_WING else ARDUPILOT_MODES  # type: ignore[attr-defined]
            name = PX4_MODES.get(mode) or ardupilot.get(mode) or str(mode)
            if names[-1:] != [name]:
                names.append(name)
    return names
