"""Times of the messages in an ArduPilot onboard log, for every format that the firmware has used.

Source: the clocks of pymavlink's DFReader, and ArduPilot's own history of the format. Since 2015 (Copter 3.3)
each message begins with `TimeUS`; before that, most began with `TimeMS`, GPS gave the time since boot as `T`,
and MODE, MSG, EV and CMD had no time; in 2013 only GPS had a time, which was the time of the GPS week.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from estimators.logs.mapped import Array
from estimators.logs.time_stamps import NEAR_US, first_offset_us, plausible

_OWN: Final = (("TimeUS", 1), ("TimeMS", 1000))
_GPS: Final = frozenset({"GPS", "GPS2"})
_WEEKS: Final = (("GWk", "GMS"), ("Week", "TimeMS"), ("Week", "Time"), ("Wk", "TWk"))
"""Columns of the GPS week and of the milliseconds in the week."""
_GPS_EPOCH_S: Final = 315_964_800
_LEAP_SECONDS: Final = 18
_WEEK_S: Final = 7 * 86_400
_FIRST_DATE_US: Final = 1_000_000_000_000_000
_MAX_TIME_US: Final = 10**13
_LAST_WEEK: Final = 6000  # of GPS: in 2094
_ASSUMED_US: Final = 20_000
"""Assumed interval of the most frequent messages in a log without any time: 50 Hz, as in DFReader."""

MICROSECONDS, MILLISECONDS, PX4_TIME, GPS_INTERPOLATED, NO_CLOCK = (
    "microseconds since boot",
    "milliseconds since boot",
    "microseconds since boot, by TIME messages",
    "interpolated between GPS times",
    "none; 50 Hz is assumed",
)


@dataclass(frozen=True, slots=True, eq=False)
class RawTable:
    """All messages of one format, as they are in the file.

    Attributes:
        name: name of the format.
        number: number of the format.
        positions: (n,) position in the file at which each begins, ascending.
        columns: fields by name, in the order of the format.
        units: units of the fields that have one.
    """

    name: str
    number: int
    positions: Array
    columns: Mapping[str, Array]
    units: Mapping[str, str]


@dataclass(frozen=True, slots=True, eq=False)
class LogTimes:
    """Times of a log's messages.

    Attributes:
        time_us: (n,) for each table, microseconds since boot (or since the log began).
        clock: the source of the times.
        unix_offset_us: Unix time of time 0, by the first GPS time with a date; None: not known.
        implausible: number of stamps that were replaced by the time of the previous message.
    """

    time_us: Sequence[Array]
    clock: str
    unix_offset_us: int | None
    implausible: int


def stamp(tables: Sequence[RawTable]) -> LogTimes:
    """Times of all messages. A message without its own time gets the time of the previous message.

    Args:
        tables: at least one, none of them empty.
    """
    own = [_own_us(table) for table in tables]
    clock = MICROSECONDS if any("TimeUS" in table.columns for table in tables) else MILLISECONDS
    if not any(times is not None for times in own):
        px4 = _px4_times(tables)
        if px4 is not None:
            own, clock = px4, PX4_TIME
        else:
            return _without_clock(tables)
    positions = np.concatenate(
        [t.positions for t, times in zip(tables, own, strict=True) if times is not None]
    )
    stamps = np.concatenate([times for times in own if times is not None])
    sorting = np.argsort(positions, kind="stable")
    positions, stamps = positions[sorting], stamps[sorting]
    good = plausible(np.where(stamps < _MAX_TIME_US, stamps, -1), NEAR_US)
    known_at, known_us = positions[good], stamps[good]
    made = []
    for table, times in zip(tables, own, strict=True):
        rows = np.searchsorted(known_at, table.positions, side="right") - 1
        before = known_us[np.maximum(rows, 0)] if len(known_us) else np.zeros(len(rows), dtype=np.int64)
        if times is None:
            made.append(before)
            continue
        # A message's own stamp is used if it was found plausible.
        counts = (
            (rows >= 0) & (known_at[np.maximum(rows, 0)] == table.positions) if len(known_at) else rows >= 0
        )
        made.append(np.where(counts, times, before))
    return LogTimes(made, clock, _unix_offset_us(tables, made), int(np.count_nonzero(~good)))


def _own_us(table: RawTable) -> Array | None:
    """Time stamps of a format's messages; None when it has none."""
    if table.name in _GPS and "T" in table.columns and "TimeUS" not in table.columns:
        return _whole(table.columns["T"]) * 1000  # TimeMS is the time of the GPS week here
    first = next(iter(table.columns), "")
    for name, factor in _OWN:
        # In another column it comes from another clock: that of a sensor's sample.
        if name == first and table.columns[name].dtype.kind in "iuf":
            return _whole(table.columns[name]) * factor
    return None


def _whole(column: Array) -> Array:
    if column.dtype.kind == "f":
        column = np.rint(np.nan_to_num(column, nan=-1.0, posinf=-1.0, neginf=-1.0))
    return np.clip(column, -1, 2**53).astype(np.int64)


def _px4_times(tables: Sequence[RawTable]) -> list[Array | None] | None:
    """Times in PX4's logs from before 2016 (sdlog2): a TIME message gives the time of those after it."""
    time = next((t for t in tables if t.name == "TIME" and "StartTime" in t.columns), None)
    return None if time is None else [_whole(t.columns["StartTime"]) if t is time else None for t in tables]


def _without_clock(tables: Sequence[RawTable]) -> LogTimes:
    """Times when only GPS messages have one: linear in the file between them; without GPS, by counting
    messages.
    """
    known = _gps_seconds(tables)
    if known is None:
        busiest = max(tables, key=lambda table: len(table.positions))
        ticks = np.arange(len(busiest.positions), dtype=np.int64) * _ASSUMED_US
        made = [_between(table.positions, busiest.positions, ticks) for table in tables]
        return LogTimes(made, NO_CLOCK, None, 0)
    positions, unix_us = known
    first = min(int(table.positions[0]) for table in tables)
    start_us = int(_between(np.array([first]), positions, unix_us)[0])
    made = [_between(table.positions, positions, unix_us) - start_us for table in tables]
    dated = start_us if start_us > _FIRST_DATE_US else None
    return LogTimes(made, GPS_INTERPOLATED, dated, 0)


def _between(at: Array, positions: Array, times_us: Array) -> Array:
    """Times at positions in the file: linear between known ones, at the mean rate before and after them."""
    found = np.interp(at, positions, times_us)
    if len(positions) > 1 and positions[-1] > positions[0]:
        rate = (times_us[-1] - times_us[0]) / (positions[-1] - positions[0])
        found = np.where(at < positions[0], times_us[0] - rate * (positions[0] - at), found)
        found = np.where(at > positions[-1], times_us[-1] + rate * (at - positions[-1]), found)
    rounded: Array = np.rint(found).astype(np.int64)
    return rounded


def _gps_seconds(tables: Sequence[RawTable]) -> tuple[Array, Array] | None:
    """Positions in the file and Unix times of the GPS messages whose time increases."""
    for table, week, milliseconds in _dated(tables):
        unix_us = _unix_us(week, milliseconds)
        rows = np.flatnonzero(milliseconds > 0)
        rows = rows[plausible(unix_us[rows], NEAR_US)]
        rows = (
            rows[np.concatenate(([True], np.diff(np.maximum.accumulate(unix_us[rows])) > 0))]
            if len(rows)
            else rows
        )
        if len(rows) > 1:
            return table.positions[rows], unix_us[rows]
    return None


def _unix_us(week: Array, milliseconds: Array) -> Array:
    week, milliseconds = np.minimum(week, _LAST_WEEK), np.minimum(milliseconds, _WEEK_S * 1000)
    seconds = _GPS_EPOCH_S + week * _WEEK_S - _LEAP_SECONDS
    unix_us: Array = seconds * 1_000_000 + milliseconds * 1000
    return unix_us


def _dated(tables: Sequence[RawTable]) -> Iterable[tuple[RawTable, Array, Array]]:
    for table in tables:
        if table.name not in _GPS:
            continue
        for week, milliseconds in _WEEKS:
            if week in table.columns and milliseconds in table.columns:
                yield table, _whole(table.columns[week]), _whole(table.columns[milliseconds])
                break
        else:
            if "Time" in table.columns:  # 2013: only the time of the week
                yield table, np.zeros(len(table.positions), dtype=np.int64), _whole(table.columns["Time"])


def _unix_offset_us(tables: Sequence[RawTable], times_us: Sequence[Array]) -> int | None:
    """Unix time of time 0, from the first GPS message with a date."""
    of_table = {id(table): times for table, times in zip(tables, times_us, strict=True)}
    for table, week, milliseconds in _dated(tables):
        offset_us = first_offset_us(_unix_us(week, milliseconds), of_table[id(table)], week > 0)
        if offset_us is not None:
            return offset_us
    time = next((t for t in tables if t.name in _GPS and "GPSTime" in t.columns), None)
    if time is None:
        return None
    gps_us = _whole(time.columns["GPSTime"])
    return first_offset_us(gps_us, of_table[id(time)], gps_us > 0)
