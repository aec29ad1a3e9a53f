"""Reserves capacity for the streams that a flight needs, on a line that can't carry all streams.

An autopilot reduces all rates equally: if a set needs five times the capacity of a serial line, the attitude
also comes at a fifth of its rate. Instead, messages that are not needed are slowed down.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from typing import Final

from autopilot_bridge.mavlink import DEFINITIONS, Frame
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.link import VehicleLink

ENOUGH: Final = 0.8
"""Share of the requested rate that is sufficient."""
SLOW_HZ: Final = 1.0
"""Rate that is requested for messages that are not needed: for the log, and for display."""
_CHECKS: Final = 10
_CHECK_S: Final = 0.2
_SLOWED_HZ: Final = 1.5
_UNCHANGED: Final = frozenset({"HEARTBEAT", "STATUSTEXT", "COMMAND_ACK", "PARAM_VALUE", "EVENT"})
"""Messages whose rates are not requested, and answers."""


async def make_room(commands: VehicleCommands, needed_hz: Mapping[str, float]) -> list[str]:
    """Measure the message rates on a serial line. When a needed message is too slow, reduce the rates of all
    messages that are not needed, and request the needed ones at the needed rates.

    On other links nothing is done: they have enough capacity for the requested messages, or their capacity is
    not known.

    Args:
        needed_hz: needed rates by message name.

    Returns:
        The messages whose rates were reduced.
    """
    link = commands.link
    if link.connection.bytes_per_s is None:
        return []
    received, changed = await _count(link, needed_hz)
    seconds = _CHECKS * _CHECK_S
    if all(received[name] >= ENOUGH * rate_hz * seconds for name, rate_hz in needed_hz.items()):
        return []
    slowed = [
        name
        for name, times in changed.items()
        if times > _SLOWED_HZ * seconds and name not in needed_hz and name not in _UNCHANGED
    ]
    for name in slowed:
        await commands.set_message_rate(name, SLOW_HZ)
    for name, rate_hz in needed_hz.items():  # the autopilot's own set may have a higher rate for some
        await commands.set_message_rate(name, rate_hz)
    return slowed


async def _count(link: VehicleLink, needed_hz: Mapping[str, float]) -> tuple[Counter[str], Counter[str]]:
    """Count needed messages, and for each message in how many of ten checks it had changed."""
    received: Counter[str] = Counter()
    changed: Counter[str] = Counter()

    def counting(name: str) -> Callable[[Frame], None]:
        def count(frame: Frame) -> None:
            if (frame.system_id, frame.component_id) == (link.system_id, 1):
                received[name] += 1

        return count

    stops = [link.connection.listen(name, counting(name)) for name in needed_hz]
    try:
        before = link.connection.newest(link.system_id)
        for _ in range(_CHECKS):
            await link.clock.sleep(_CHECK_S)
            now = link.connection.newest(link.system_id)
            for number, frame in now.items():
                if before.get(number) is not frame:
                    changed[DEFINITIONS[number].name] += 1
            before = now
    finally:
        for stop in stops:
            stop()
    return received, changed
