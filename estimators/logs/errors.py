"""The error of logs: a file that can't be read, or something asked of a log that is not in it."""

from autopilot_bridge.errors import TlogError


class LogError(TlogError):
    """A log can't be opened, or does not hold what was asked for; the message names it and what to do."""


class NothingThere(LogError):
    """A log holds nothing in the part that is asked for; the message says what it holds."""
