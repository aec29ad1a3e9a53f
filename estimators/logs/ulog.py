"""PX4's onboard logs (.ulg), read with `pyulog`."""

import contextlib
import io
import os
import re
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Final

import numpy as np
from pyulog.core import ULog

from estimators.errors import LogError
from estimators.logs.mapped import Array, MappedSource, Part, Records, own_part
from estimators.logs.ulog_mapping import UlogFacts, board_rotation, map_topics

_TIME: Final = "timestamp"
_MOST_RETURNS: Final = 2000
"""Limit of steps back to a position that was already read: a search for a sync mark needs a few."""
_MAX_TIME_US: Final = 10**13
_ELEMENT: Final = re.compile(r"(.+)\[(\d+)\]")


class _Onward(io.BufferedReader):
    """A file that stops a reader from looping endlessly.

    pyulog continues one byte after the start of an unknown message. If the end of the file cuts that message
    off, it steps back too far and would repeat this forever.
    """

    def __init__(self, path: Path) -> None:
        super().__init__(io.FileIO(path))
        self._furthest = -1
        self._returns = 0

    def seek(self, offset: int, whence: int = os.SEEK_SET, /) -> int:
        if whence == os.SEEK_CUR and offset < 0:
            target = self.tell() + offset
            self._returns += target <= self._furthest
            self._furthest = max(self._furthest, target)
            if self._returns > _MOST_RETURNS:
                raise ValueError("the file makes no sense")
        return super().seek(offset, whence)


def open_ulog(path: Path) -> MappedSource:
    """Open a PX4 .ulg.

    Raises:
        LogError: it can't be read, or contains no message.
    """
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # pyulog prints warnings
            log = ULog(_Onward(path), disable_str_exceptions=True)
    except Exception as error:  # pyulog may raise any exception for a damaged file
        raise LogError(
            f"{path} can't be read as a PX4 .ulg: {type(error).__name__} {error}; is it whole?"
        ) from error
    base_us = _base_us(log)
    topics: dict[tuple[str, int], Records] = {}
    parts: list[Part] = []
    names_taken: dict[str, int] = {}
    for number, data in enumerate(sorted(log.data_list, key=lambda item: (item.name, item.multi_id))):
        times = np.asarray(data.data[_TIME], dtype=np.uint64)
        times = np.where(times < base_us, np.uint64(0), times - base_us)  # 0: a message without a time
        good = times < _MAX_TIME_US
        columns = _arrays({name: np.asarray(column)[good] for name, column in data.data.items()})
        if not columns or not np.any(good):
            continue
        topic = Records(times[good].astype(np.int64), columns)
        topics.setdefault((data.name, data.multi_id), topic)
        # Each instance of a topic has its own table: sensor_accel, sensor_accel_1, ...
        name = data.name if not data.multi_id else f"{data.name}_{data.multi_id}"
        names_taken[name] = names_taken.get(name, 0) + 1
        if names_taken[name] == 1:
            parts.append(own_part(name, -1 - number, topic.time_us, columns, {}))
    if not parts:
        raise LogError(f"{path} holds no messages; is it a PX4 .ulg, and whole?")
    size_bytes = path.stat().st_size
    offset_us = _unix_offset_us(topics) if not base_us else int(base_us)
    facts = UlogFacts(
        texts=log.logged_messages,
        base_us=int(base_us),
        parameters={str(name): float(value) for name, value in log.initial_parameters.items()},
        version=int(log.msg_info_dict.get("ver_sw_release", 0) or 0),
    )
    mapped = map_topics(topics, facts, offset_us)
    return MappedSource(
        path,
        size_bytes=size_bytes,
        format="ulg",
        parts=[*parts, *mapped],
        unix_offset_us=offset_us,
        bytes_by_kind={"file": size_bytes},
        drops={"dropouts": len(log.dropouts)},
        remarks={
            "dropout_ms": int(sum(item.duration for item in log.dropouts)),
            "corrupt": int(bool(log.file_corruption)),
            **board_remarks(facts.parameters),
            "pyulog": metadata.version("pyulog"),
        },
    )


def board_remarks(parameters: Mapping[str, float]) -> dict[str, str]:
    """Remarks about the board's rotation and offset: where they are corrected."""
    if board_rotation(parameters) is None:
        return {
            "board": "SENS_BOARD_ROT is not about the vertical: IMUs other than the voted one are left out"
        }
    offsets = [parameters.get(f"SENS_BOARD_{axis}_OFF", 0.0) for axis in "XYZ"]
    if not any(offsets) and not parameters.get("SENS_BOARD_ROT", 0.0):
        return {}
    shown = " ".join(f"{value:g}" for value in offsets)
    return {
        "board": f"SENS_BOARD_*_OFF {shown} deg: corrected by the firmware (voted IMU), here for the others"
    }


def _arrays(columns: dict[str, Array]) -> dict[str, Array]:
    """Merge columns `q[0]`, `q[1]`, ... to one of shape (n, 4); names become valid Python names."""
    single: dict[str, Array] = {}
    elements: dict[str, dict[int, Array]] = {}
    for name, column in columns.items():
        match = _ELEMENT.fullmatch(name)
        if match is not None and "[" not in match[1]:
            elements.setdefault(match[1], {})[int(match[2])] = column
        else:
            single[name] = column
    for name, parts in elements.items():
        if set(parts) == set(range(len(parts))) and len({part.dtype for part in parts.values()}) == 1:
            single[name] = np.column_stack([parts[index] for index in range(len(parts))])
        else:
            single |= {f"{name}[{index}]": part for index, part in parts.items()}
    named = {re.sub(r"\W+", "_", name).strip("_"): column for name, column in single.items()}
    return {name: column for name, column in named.items() if name.isidentifier()}


def _base_us(log: ULog) -> np.uint64:
    """Time of the file at vehicle time 0.

    Simulated vehicles without lockstep use Unix time in microseconds; then it is the earliest time of the
    log.
    """
    if log.start_timestamp < _MAX_TIME_US:
        return np.uint64(0)
    stamps = (np.asarray(data.data[_TIME], dtype=np.uint64) for data in log.data_list)
    firsts = [times[times >= _MAX_TIME_US].min() for times in stamps if np.any(times >= _MAX_TIME_US)]
    return np.uint64(min([log.start_timestamp, *firsts]))


def _unix_offset_us(topics: dict[tuple[str, int], Records]) -> int | None:
    """Unix time at boot, from the first time that the GPS reported."""
    for name in ("vehicle_gps_position", "sensor_gps"):
        topic = topics.get((name, 0))
        if topic is not None and "time_utc_usec" in topic.columns:
            utc_us = topic.columns["time_utc_usec"].astype(np.int64)
            rows = np.flatnonzero(utc_us > 0)
            if len(rows):
                return int(utc_us[rows[0]] - topic.time_us[rows[0]])
    return None
