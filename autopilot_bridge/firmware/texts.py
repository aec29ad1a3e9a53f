"""Texts for the pilot: severities of STATUSTEXT (MAV_SEVERITY), and the table of a firmware's texts."""

from collections.abc import Callable, Mapping
from enum import IntEnum
from typing import Any, NamedTuple

from autopilot_bridge.commander.events import Event


class Severity(IntEnum):
    """MAV_SEVERITY, after RFC 5424."""

    EMERGENCY = 0
    ALERT = 1
    CRITICAL = 2
    ERROR = 3
    WARNING = 4
    NOTICE = 5
    INFO = 6
    DEBUG = 7


class Notice(NamedTuple):
    """A text for the pilot: severity and text of STATUSTEXT."""

    severity: Severity
    text: str


TextTable = Mapping[type[Event], Notice | Callable[[Any], tuple[Notice, ...]]]
"""The text of each type of event, or the function that makes an event's texts, in order.

A firmware is silent about other types.
"""


def notices_of(table: TextTable) -> Callable[[Event], tuple[Notice, ...]]:
    """The function that returns the STATUSTEXTs of an event, in order."""

    def notices(event: Event) -> tuple[Notice, ...]:
        entry = table.get(type(event))
        if entry is None:
            return ()
        return (entry,) if isinstance(entry, Notice) else entry(event)

    return notices
