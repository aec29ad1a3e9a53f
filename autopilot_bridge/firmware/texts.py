"""Severities of STATUSTEXT (MAVLink MAV_SEVERITY) and the shape of a text for the pilot."""

from enum import IntEnum
from typing import NamedTuple


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
