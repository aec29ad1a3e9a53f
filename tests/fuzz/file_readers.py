"""Every reader of files, with small whole files of its kind."""

import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

from estimators.errors import LogError
from estimators.logs import open_log, report_of
from tests.estimators.logs import flight_log
from tests.estimators.logs.onboard_logs import ardupilot_plane, px4_plane
from tests.estimators.logs.test_dataflash_formats import copter_of_2014, text_of
from tests.fuzz.file_campaign import Reader


def _made(write: Callable[[Path], Any]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "whole")
        write(path)
        return path.read_bytes()


def _read_log(path: Path) -> None:
    """All that `log info` and `log export` look at."""
    log = open_log(path)
    report_of(log)
    for key in log.keys:
        for table in log.tables(key.name, system_id=key.system_id, component_id=key.component_id):
            table.time_us, table.log_time_us  # noqa: B018
            for name in table.fields:
                if table[name].dtype.kind != "S":
                    table.si(name)


def _log(suffix: str, *seeds: bytes, text: bool = False) -> Reader:
    return Reader(suffix=suffix, seeds=seeds, read=_read_log, errors=(LogError,), text=text)


@cache
def readers() -> dict[str, Reader]:
    """The readers by name."""
    tlog = _made(flight_log.write)
    text = _made(lambda path: path.write_text(text_of(copter_of_2014(path.with_name("a.bin")))[:60_000]))
    return {
        "tlog": _log(".tlog", tlog),
        "bin": _log(".bin", bytes(ardupilot_plane(1).data), _made(copter_of_2014)[:30_000]),
        "text log": _log(".log", text, text=True),
        "ulg": _log(".ulg", bytes(px4_plane(1).data)),
    }
