"""Errors of logs: a file can't be read, or the requested data are not in the log."""

from autopilot_bridge.errors import TlogError


class LogError(TlogError):
    """A log can't be opened or lacks the requested data; the message names it and the next step."""


class NothingThere(LogError):
    """The requested part of a log contains no data; the message names what the log contains."""
