"""Flight logs as columns; `open_log` opens a log."""

from estimators.errors import LogError
from estimators.logs.formats import open_log
from estimators.logs.log import Boot, Key, Log
from estimators.logs.report import LogReport, report_of
from estimators.logs.source import LogSource, Stream
from estimators.logs.table import Table

__all__ = [
    "Boot",
    "Key",
    "Log",
    "LogError",
    "LogReport",
    "LogSource",
    "Stream",
    "Table",
    "open_log",
    "report_of",
]
