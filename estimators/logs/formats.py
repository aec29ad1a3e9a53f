"""Opens logs; the format is recognised by the content."""

from pathlib import Path
from typing import Final

from estimators.errors import LogError
from estimators.logs.dialect import load_dialect
from estimators.logs.log import Log
from estimators.logs.source import LogSource
from estimators.logs.tlog import open_tlog
from flightsim.foundation.file_content import FileError, file_head

_ULG_MAGIC: Final = bytes.fromhex("554c6f67011235")
_DATAFLASH_MAGIC: Final = bytes.fromhex("a395")
_DATAFLASH_FMT: Final = bytes.fromhex("a395808059") + b"FMT"
"""The message that describes the format of formats; some logs have junk bytes before it."""


def open_log(path: Path | str, *, dialect: str | Path | None = None) -> Log:
    """Open a log.

    Args:
        path: a telemetry log (.tlog), a capture of a MAVLink stream, an ArduPilot onboard log (.bin, or .log
            in text form), or a PX4 .ulg; recognised by its content, independent of its name.
        dialect: dialect of a telemetry log: a pymavlink dialect by name ("common"), or the path of an XML
            definition file; None: every message of MAVLink's public definitions.

    Raises:
        LogError: the file can't be read or is not a log, or the dialect does not exist.
    """
    path = Path(path)
    head = _read_head(path)
    return Log(_open_source(path, head, dialect))


def _open_source(path: Path, head: bytes, dialect: str | Path | None) -> LogSource:
    """Select the reader by the content; all formats are known only here."""
    ulog = head.startswith(_ULG_MAGIC)
    binary = head.startswith(_DATAFLASH_MAGIC) or _DATAFLASH_FMT in head
    text = not ulog and not binary and b"FMT," in head
    if text:
        from estimators.logs.dataflash_text import looks_like_text, open_text

        text = looks_like_text(head)
    if not (ulog or binary or text):
        return open_tlog(path, load_dialect(dialect))
    if dialect is not None:
        raise LogError(f"{path} is no MAVLink stream; a dialect ({dialect}) has no effect, leave it out")
    # Imported here because the libraries behind them load slowly.
    if ulog:
        from estimators.logs.ulog import open_ulog

        return open_ulog(path)
    if text:
        return open_text(path)
    from estimators.logs.dataflash import open_dataflash

    return open_dataflash(path)


def _read_head(path: Path) -> bytes:
    try:
        return file_head(path)
    except FileError as error:
        raise LogError(f"{error}; give the path of a log") from None
