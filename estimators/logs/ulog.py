"""PX4's onboard logs (.ulg), read with `pyulog`."""

import contextlib
import io
import math
import os
import re
import struct
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from pyulog.core import ULog

from estimators.errors import LogError
from estimators.logs.mapped import Array, MappedSource, Part, Records, own_part
from estimators.logs.time_stamps import first_offset_us, span_us
from estimators.logs.ulog_mapping import UlogFacts, board_rotation, map_topics

_TIME: Final = "timestamp"
_MOST_RETURNS: Final = 2000
"""Limit of steps back to a position that was already read: a search for a sync mark needs a few."""
_MAX_TIME_US: Final = 10**13
_LARGEST_MESSAGE: Final = 65535
_LAST_DATE_US: Final = 4 * 10**15  # in 2096
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


class _Subscription(ULog._MessageAddLogged):  # type: ignore[misc]
    """A subscription of a topic whose format can be that of a message.

    pyulog flattens nested formats, which a damaged or crafted log makes endless, or larger than any memory.
    """

    def _parse_format(self, message_formats: Mapping[str, Any]) -> None:
        if _size(self.message_name, message_formats, {}) > _LARGEST_MESSAGE:
            raise ValueError(f"the format of {self.message_name} is larger than a message can be")
        super()._parse_format(message_formats)


def _size(name: str, formats: Mapping[str, Any], known: dict[str, int]) -> int:
    """Bytes of a format with those that it contains, at least 1; more than a message can have: it contains
    itself, or is too large.
    """
    if name not in known:
        known[name] = _LARGEST_MESSAGE + 1  # what it is while it is within itself
        total = 1
        for kind, length, _ in formats[name].fields:
            basic = ULog._UNPACK_TYPES.get(kind)
            one = _size(kind, formats, known) if basic is None else int(basic[1])
            total = min(total + max(length, 1) * one, _LARGEST_MESSAGE + 1)
        known[name] = total
    return known[name]


class _Data(ULog._MessageData):  # type: ignore[misc]
    """A message of a topic, which may have no time."""

    def initialize(self, *arguments: Any) -> bool:
        try:
            return bool(super().initialize(*arguments))
        except struct.error:  # pyulog takes it for the end of the file
            self.timestamp = 0
            return False


def _checked(kind: Any) -> Any:
    """A kind of message that is skipped when it is too short; pyulog takes it for the end of the file."""

    def __init__(self: Any, *arguments: Any, **options: Any) -> None:
        try:
            kind.__init__(self, *arguments, **options)
        except struct.error as error:
            raise ValueError(str(error)) from error

    return type(kind.__name__, (kind,), {"__init__": __init__})


class _Log(ULog):  # type: ignore[misc]
    """pyulog's reader, within bounds, and to the end of the file."""

    _MessageAddLogged = _checked(_Subscription)
    _MessageData = _Data
    _MessageInfo = _checked(ULog._MessageInfo)
    _MessageParameterDefault = _checked(ULog._MessageParameterDefault)
    MessageDropout = _checked(ULog.MessageDropout)
    MessageLogging = _checked(ULog.MessageLogging)
    MessageLoggingTagged = _checked(ULog.MessageLoggingTagged)


def open_ulog(path: Path) -> MappedSource:
    """Open a PX4 .ulg.

    Raises:
        LogError: it can't be read, or contains no message.
    """
    try:
        with contextlib.redirect_stdout(io.StringIO()):  # pyulog prints warnings
            log = _Log(_Onward(path), disable_str_exceptions=True)
    except Exception as error:  # pyulog may raise any exception for a damaged file
        raise LogError(
            f"{path} can't be read as a PX4 .ulg: {type(error).__name__} {error}; is it whole?"
        ) from error
    timed = [data for data in log.data_list if _is_time(data.data.get(_TIME))]
    timed.sort(key=lambda item: (item.name, item.multi_id))
    base_us = _base_us(log, timed)
    stamps = [_vehicle_us(data.data[_TIME], base_us) for data in timed]
    known = np.concatenate([times[times > 0] for times in stamps] or [np.empty(0, dtype=np.int64)])
    first_us, last_us = span_us(known) if len(known) else (0, 0)
    topics: dict[tuple[str, int], Records] = {}
    parts: list[Part] = []
    names_taken: dict[str, int] = {}
    implausible = 0
    for number, (data, times) in enumerate(zip(timed, stamps, strict=True)):
        # 0 is a message without a time
        good = (times == 0) | ((times >= first_us) & (times <= last_us))
        implausible += int(np.count_nonzero(~good))
        columns = _arrays({name: np.asarray(column)[good] for name, column in data.data.items()})
        if not columns or not np.any(good):
            continue
        topic = Records(times[good], columns)
        topics.setdefault((data.name, data.multi_id), topic)
        # Each instance of a topic has its own table: sensor_accel, sensor_accel_1, ...
        name = data.name if not data.multi_id else f"{data.name}_{data.multi_id}"
        names_taken[name] = names_taken.get(name, 0) + 1
        if names_taken[name] == 1:
            parts.append(own_part(name, -1 - number, topic.time_us, columns, {}))
    if not parts:
        raise LogError(f"{path} holds no messages with a time; is it a PX4 .ulg, and whole?")
    size_bytes = path.stat().st_size
    offset_us = base_us or _unix_offset_us(topics)
    parameters = {
        str(name): float(value)
        for name, value in log.initial_parameters.items()
        if isinstance(value, int | float) and math.isfinite(value)
    }
    version = log.msg_info_dict.get("ver_sw_release", 0)
    facts = UlogFacts(
        texts=[item for item in log.logged_messages if 0 <= item.timestamp - base_us < _MAX_TIME_US],
        base_us=base_us,
        parameters=parameters,
        version=version if isinstance(version, int) and 0 <= version < 1 << 32 else 0,
    )
    with np.errstate(all="ignore"):  # of damaged values, which may be infinite
        mapped = map_topics(topics, facts, offset_us)
    return MappedSource(
        path,
        size_bytes=size_bytes,
        format="ulg",
        parts=[*parts, *mapped],
        unix_offset_us=offset_us,
        bytes_by_kind={"file": size_bytes},
        drops={
            "dropouts": len(log.dropouts),
            "implausible_times": implausible,
            "topics_without_time": len(log.data_list) - len(timed),
        },
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


def _is_time(column: Array | None) -> bool:
    """Whether a column holds times, which are uint64 in every format of PX4."""
    return column is not None and column.dtype == np.uint64


def _vehicle_us(times: Array, base_us: int) -> NDArray[np.int64]:
    """Vehicle times; 0: none; times that no vehicle reaches are the largest number."""
    since = np.where(times < np.uint64(base_us), np.uint64(0), times - np.uint64(base_us))
    return np.where(since < _MAX_TIME_US, since, np.iinfo(np.int64).max).astype(np.int64)


def _base_us(log: ULog, timed: Sequence[Any]) -> int:
    """Time of the file at vehicle time 0.

    Simulated vehicles without lockstep use Unix time in microseconds; then it is the earliest time of the
    log.
    """
    if log.start_timestamp < _MAX_TIME_US:
        return 0
    stamps = (data.data[_TIME] for data in timed)
    firsts = [int(times[times >= _MAX_TIME_US].min()) for times in stamps if np.any(times >= _MAX_TIME_US)]
    return min([int(log.start_timestamp), *firsts])


def _unix_offset_us(topics: dict[tuple[str, int], Records]) -> int | None:
    """Unix time at boot, from the first time that the GPS reported."""
    for name in ("vehicle_gps_position", "sensor_gps"):
        topic = topics.get((name, 0))
        if topic is not None and "time_utc_usec" in topic.columns:
            utc_us = topic.columns["time_utc_usec"]
            if utc_us.ndim == 1:
                dated = (utc_us > 0) & (utc_us < _LAST_DATE_US)
                offset_us = first_offset_us(utc_us.astype(np.int64), topic.time_us, dated)
                if offset_us is not None:
                    return offset_us
    return None
