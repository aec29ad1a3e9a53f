"""Opens logs, by their content."""

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from estimators.logs.dialect import load_dialect
from estimators.logs.errors import LogError
from estimators.logs.log import Log
from estimators.logs.source import LogSource
from estimators.logs.tlog import open_tlog

_ULG_MAGIC: Final = bytes.fromhex("554c6f67011235")
_DATAFLASH_MAGIC: Final = bytes.fromhex("a39580")
_HEAD_BYTES: Final = 16


def open_log(path: Path | str, *, dialect: str | Path | None = None) -> Log:
    """Open a log.

    Args:
        path: a telemetry log (.tlog), a capture of a MAVLink stream, an ArduPilot .bin, or a PX4 .ulg; told
            by its content, whatever its name is.
        dialect: of a telemetry log: a dialect of pymavlink's by name ("common"), or the path of an XML
            definition file; None: every message of MAVLink's public definitions.

    Raises:
        LogError: the file can't be read or is no log, or there is no such dialect.
    """
    path = Path(path)
    head = _read_head(path)
    return Log(_open_source(path, head, dialect))


def _open_source(path: Path, head: bytes, dialect: str | Path | None) -> LogSource:
    """The one place that knows the formats."""
    if head.startswith(_ULG_MAGIC):
        return _other("estimators.logs.ulog", "open_ulog", path, dialect)
    if head.startswith(_DATAFLASH_MAGIC):
        return _other("estimators.logs.dataflash", "open_dataflash", path, dialect)
    return open_tlog(path, load_dialect(dialect))


def _other(module: str, function: str, path: Path, dialect: str | Path | None) -> LogSource:
    if dialect is not None:
        raise LogError(f"{path} is no MAVLink stream; a dialect ({dialect}) has no effect, leave it out")
    if find_spec(module) is None:
        raise LogError(f"{path}: this version reads telemetry logs (.tlog) only; convert it first")
    opener: Any = getattr(import_module(module), function)
    return opener(path)


def _read_head(path: Path) -> bytes:
    if path.is_dir():
        raise LogError(f"{path} is a directory; give the path of a log")
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD_BYTES)
    except OSError as error:
        raise LogError(f"can't read {path}: {error.strerror}; give the path of a log") from error
    if not head:
        raise LogError(f"{path} is empty; give the path of a log")
    return head
