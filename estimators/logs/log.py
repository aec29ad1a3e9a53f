"""A flight log as columns, for every format of the file."""

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, Protocol
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from estimators.errors import LogError, NothingThere
from estimators.html_table import html_table
from estimators.logs.iterate import Selection, messages_in_order
from estimators.logs.log_clock import LogClock, make_clock
from estimators.logs.source import LogSource, Positions, Stream
from estimators.logs.table import Table
from estimators.messages import Message
from estimators.vehicle_time import stamp_field

_LONG_GAP_US: Final = 5_000_000
_LONG_GAP_INTERVALS: Final = 10.0
_LEAST_SPAN_US: Final = 1_000_000
"""A rate is counted over at least this time: 900 parameters within 30 ms are 900 in a second."""
_MAX_RATED_INSTANCES: Final = 32

Ids = int | Collection[int] | None
"""One id, several, or any."""


class MessageCondition(Protocol):
    """A condition on messages; `estimators.logs.condition.Condition` is one."""

    def mask(self, order: NDArray[np.int64], find: Callable[[str], list[Any]]) -> NDArray[np.bool_]:
        """Mask of the messages at these positions for which it holds; `find` returns tables by message."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Key:
    """A message of a component, and its number in the log."""

    name: str
    system_id: int
    component_id: int
    count: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Boot:
    """One boot of a system.

    Attributes:
        system_id: the system.
        number: 0 is the first in the log.
        first, last: positions of the first message in it and of the last.
        start_us, end_us: vehicle time of the first message that has one, and the newest.
    """

    system_id: int
    number: int
    first: int
    last: int
    start_us: int
    end_us: int


class Log:
    """A log, opened by `estimators.logs.open_log`.

    Attributes:
        source: its file.
    """

    def __init__(self, source: LogSource) -> None:
        self.source = source
        self._tables: WeakValueDictionary[tuple[Any, ...], Table] = WeakValueDictionary()

    def __repr__(self) -> str:
        return f"Log({str(self.path)!r}, {self.format}, {len(self)} messages)"

    def __len__(self) -> int:
        """Number of messages."""
        return self.source.count

    @property
    def path(self) -> Path:
        """The file."""
        return self.source.path

    @property
    def size_bytes(self) -> int:
        """Size of the file."""
        return self.source.size_bytes

    @property
    def format(self) -> str:
        """ "tlog", "raw MAVLink", "bin" or "ulg"."""
        return self.source.format

    @cached_property
    def keys(self) -> tuple[Key, ...]:
        """The kinds of messages in the log, sorted by system, component and name."""
        found = (
            Key(name=s.name, system_id=s.system_id, component_id=s.component_id, count=len(s.order))
            for s in self.source.streams
        )
        return tuple(sorted(found, key=lambda key: (key.system_id, key.component_id, key.name)))

    @cached_property
    def systems(self) -> tuple[int, ...]:
        """System ids received, ascending."""
        return tuple(sorted({stream.system_id for stream in self.source.streams}))

    @cached_property
    def boots(self) -> tuple[Boot, ...]:
        """Boots of all systems, by system and number."""
        times = self.source.time_us
        found = []
        for system_id in self.systems:
            orders = [s.order for s in self.source.streams if s.system_id == system_id]
            starts = self.source.boot_starts.get(system_id, np.empty(0, dtype=np.int64)).tolist()
            edges = [0, *starts, self.source.count]
            for number, (begin, end) in enumerate(pairwise(edges)):
                first, last, start_us, end_us = end, begin, 0, 0
                for order in orders:
                    low, high = np.searchsorted(order, (begin, end))
                    if low == high:
                        continue
                    first, last = min(first, int(order[low])), max(last, int(order[high - 1]))
                    span = times[order[low:high]]
                    span = span[span > 0]
                    if len(span):
                        start_us = min(start_us or int(span.min()), int(span.min()))
                        end_us = max(end_us, int(span.max()))
                if first < end:
                    found.append(
                        Boot(
                            system_id=system_id,
                            number=number,
                            first=first,
                            last=last,
                            start_us=start_us,
                            end_us=end_us,
                        )
                    )
        return tuple(found)

    def _repr_html_(self) -> str:
        """The log as a table of its messages, for notebooks."""
        title = f"{self.path.name}: {self.format}, {self.duration_s:.1f} s, {len(self)} messages"
        rows = [(key.name, f"{key.system_id}/{key.component_id}", key.count) for key in self.keys]
        return html_table(title, rows, ("message", "sender", "number"))

    @cached_property
    def clock(self) -> LogClock:
        """The clock of all times that are printed and accepted for the log."""
        return make_clock(self.source)

    def inside(
        self,
        order: NDArray[np.int64],
        *,
        from_s: float | None = None,
        to_s: float | None = None,
        boot: int | None = None,
    ) -> NDArray[np.bool_]:
        """Mask of the messages in a part of the log.

        Args:
            order: positions of messages.
            from_s, to_s: seconds of `clock`; None: no limit. `to_s` itself is excluded.
            boot: number of a boot of the clock's vehicle; None: that part of each boot.

        Raises:
            LogError: a time is negative or not a number, the end is before the beginning, nothing was
                recorded in that time, or the boot does not exist.
        """
        clock = self.clock
        for option, value in (("from_s", from_s), ("to_s", to_s)):
            if value is not None and not (math.isfinite(value) and value >= 0.0):
                raise LogError(f"`{option}` {value:g} is no time; give {clock.text}")
        if from_s is not None and to_s is not None and to_s <= from_s:
            raise LogError(f"`to_s` {to_s:g} is not behind `from_s` {from_s:g}; give a later time")
        boots = int(clock.boot[-1]) + 1
        if boot is not None and not 0 <= boot < boots:
            raise LogError(f"`boot` {boot} is not in {self.path}; it has 0 to {boots - 1}")
        low = -math.inf if from_s is None else from_s * 1e6
        high = math.inf if to_s is None else to_s * 1e6
        timed = (clock.time_us >= low) & (clock.time_us < high)
        if boot is not None:
            timed &= clock.boot == boot
        if not timed.any():
            spans = [self._clock_span_us(number) for number in (range(boots) if boot is None else (boot,))]
            there = ", ".join(f"{1e-6 * first:.1f} to {1e-6 * last:.1f}" for first, last in spans)
            raise NothingThere(f"{self.path} has nothing at that time; it has {there} s ({clock.text})")
        return timed[order]

    def boots_at(self, from_s: float | None, to_s: float | None) -> list[int]:
        """Boots with messages between two times of `clock`."""
        low = -math.inf if from_s is None else from_s * 1e6
        high = math.inf if to_s is None else to_s * 1e6
        times = self.clock.time_us
        return [int(number) for number in np.unique(self.clock.boot[(times >= low) & (times < high)])]

    def _clock_span_us(self, boot: int) -> tuple[int, int]:
        times = self.clock.time_us[self.clock.boot == boot]
        return int(times.min()), int(times.max())

    @cached_property
    def _recorded_us(self) -> tuple[int, int]:
        """First and last time of a record."""
        ends = self.source.log_time_us(np.array([0, self.source.count - 1], dtype=np.int64))
        return int(ends[0]), int(ends[1])

    @property
    def start_unix_us(self) -> int | None:
        """Unix time of the first record; None when it is not in the file."""
        return self._recorded_us[0] or None

    @property
    def duration_s(self) -> float:
        """Time from the first record to the last; without record times, the longest time of a system."""
        first, last = self._recorded_us
        if last > first:
            return (last - first) * 1e-6
        by_system: dict[int, int] = {}
        for boot in self.boots:
            by_system[boot.system_id] = by_system.get(boot.system_id, 0) + boot.end_us - boot.start_us
        return max(by_system.values(), default=0) * 1e-6

    def has(
        self, name: str, *, system_id: Ids = None, component_id: Ids = None, boot: int | None = None
    ) -> bool:
        """Whether there is a message of that name from the specified components."""
        return any(len(self._rows(stream, boot)) for stream in self._find((name,), system_id, component_id))

    def rate_hz(
        self, name: str, *, system_id: Ids = None, component_id: Ids = None, boot: int | None = None
    ) -> float:
        """Mean rate of a message while it was sent, on vehicle time; gaps are left out.

        If several components send it, the highest rate; 0 when there is none, or only one message.
        """
        rates = (
            self.stream_rate_hz(stream, self._rows(stream, boot))
            for stream in self._find((name,), system_id, component_id)
        )
        return max(rates, default=0.0)

    def stream_rate_hz(self, stream: Stream, rows: NDArray[np.int64] | slice = slice(None)) -> float:
        """Mean rate of one stream while it was sent, counted over at least one second; 0: not known.

        For a message with instances (two IMUs in HIGHRES_IMU) it is the rate of the fastest instance.
        """
        order = stream.order[rows]
        if len(order) < 2:
            return 0.0
        times = self._rate_times_us(stream, order)
        field = stream.description.instance_field
        if field is None:
            return _rate_hz(times)
        values = self.stream_table(stream)[field][rows]
        instances = np.unique(values)
        if len(instances) > _MAX_RATED_INSTANCES:  # names of values or parameters
            return _rate_hz(times)
        return max(_rate_hz(times[values == instance]) for instance in instances)

    def _rate_times_us(self, stream: Stream, order: Positions) -> NDArray[np.int64]:
        """The times from which a stream's rate is computed.

        A message with its own stamp uses that stamp. The vehicle time of other messages increases in steps
        with the messages around them; the record times are finer, if the record was made in real time.
        """
        times = self.source.time_us[order]
        stamped = stamp_field(stream.name, stream.description.definition.field_names) is not None
        if stamped and times[0] != times[-1]:
            return times
        recorded = self.source.log_time_us(order)
        if times[0] == times[-1]:  # no running clock: systems without an autopilot, or stamps that are all 0
            if recorded[0] != recorded[-1]:
                return recorded
            return np.maximum.accumulate(self.source.time_us)[order]
        first, last = self._recorded_us
        spans = [boot.end_us - boot.start_us for boot in self.boots if boot.system_id == stream.system_id]
        real_time = last > first and 0.5 < sum(spans) / (last - first) < 2.0
        return recorded if real_time else times

    def table(
        self,
        name: str,
        *,
        system_id: int | None = None,
        component_id: int | None = None,
        instance: int | str | None = None,
        boot: int | None = None,
    ) -> Table:
        """Columns of one message of one component.

        Args:
            name: "ATTITUDE", in any case.
            system_id, component_id: ids of the sender; None is sufficient if only one component sent it.
            instance: value of the message's instance field (id of a battery, name of a value); None: all.
            boot: number of the system's boot; None: all.

        Raises:
            LogError: the log has no such message, or several components sent it.
        """
        found = self._find((name,), system_id, component_id)
        if not found:
            raise self._missing(name, system_id, component_id)
        if len(found) > 1:
            senders = ", ".join(f"{stream.system_id}/{stream.component_id}" for stream in found)
            raise LogError(
                f"{self.path}: {found[0].name} comes from {senders} (system/component); "
                "give system_id and component_id"
            )
        return self.stream_table(found[0], instance=instance, boot=boot)

    def tables(
        self, name: str, *, system_id: Ids = None, component_id: Ids = None, boot: int | None = None
    ) -> list[Table]:
        """Tables of a message, one for each component that sent it; empty when none sent it."""
        found = (
            self.stream_table(stream, boot=boot) for stream in self._find((name,), system_id, component_id)
        )
        return [table for table in found if len(table)]

    def stream_table(
        self, stream: Stream, *, instance: int | str | None = None, boot: int | None = None
    ) -> Table:
        """Columns of one stream; see `table`."""
        key = (id(stream), instance, boot)
        table = self._tables.get(key)
        if table is None:
            table = self._tables[key] = self._decode(stream, instance, boot)
        return table

    def select(
        self,
        names: str | Iterable[str] | None = None,
        *,
        system_id: Ids = None,
        component_id: Ids = None,
        boot: int | None = None,
        condition: MessageCondition | Callable[[Table], NDArray[np.bool_]] | None = None,
    ) -> list[Selection]:
        """Streams, and the rows of each, that `messages` would return.

        Raises:
            LogError: a name is not in the dialect.
        """
        selections: list[Selection] = []
        for stream in self._find(_names(names), system_id, component_id):
            rows = self._rows(stream, boot)
            if condition is not None and len(rows):
                if hasattr(condition, "mask"):
                    order = stream.order[rows].astype(np.int64)
                    kept = condition.mask(order, partial(self._tables_for, stream))
                else:
                    kept = condition(self.stream_table(stream).select(rows))
                rows = rows[np.asarray(kept, dtype=np.bool_)]
            if len(rows):
                selections.append((stream, rows))
        return selections

    def messages(
        self,
        names: str | Iterable[str] | None = None,
        *,
        system_id: Ids = None,
        component_id: Ids = None,
        boot: int | None = None,
        condition: MessageCondition | Callable[[Table], NDArray[np.bool_]] | None = None,
    ) -> Iterator[tuple[int, Message]]:
        """(vehicle time in microseconds, message) in the order of the file.

        Args:
            names: names of messages; None: all. Names that are not in the log are ignored.
            system_id, component_id: ids of the sender; None: any.
            boot: number of the system's boot; None: all.
            condition: selects messages by their values: an object with `mask`, or a function that returns a
                mask for a table.

        Raises:
            LogError: a name is not in the dialect.
        """
        selections = self.select(
            names, system_id=system_id, component_id=component_id, boot=boot, condition=condition
        )
        return messages_in_order(self.source, selections)

    def _find(self, names: Iterable[str] | None, system_id: Ids, component_id: Ids) -> list[Stream]:
        wanted = None if names is None else {self.source.dialect.find(name).name for name in names}
        return [
            stream
            for stream in self.source.streams
            if (wanted is None or stream.name in wanted)
            and _is_in(stream.system_id, system_id)
            and _is_in(stream.component_id, component_id)
        ]

    def _tables_for(self, stream: Stream, name: str) -> list[Table]:
        """The tables of its vehicle that a condition on messages of a stream may use."""
        return [self.stream_table(found) for found in self._find((name,), stream.system_id, None)]

    def _rows(self, stream: Stream, boot: int | None) -> NDArray[np.int64]:
        if boot is None:
            return np.arange(len(stream.order))
        starts = self.source.boot_starts.get(stream.system_id, np.empty(0, dtype=np.int64))
        edges = np.concatenate(([0], starts, [self.source.count]))
        if not 0 <= boot < len(edges) - 1:
            return np.arange(0)
        return np.arange(*np.searchsorted(stream.order, edges[boot : boot + 2]))

    def _decode(self, stream: Stream, instance: int | str | None, boot: int | None) -> Table:
        rows = self._rows(stream, boot)
        chosen: slice | NDArray[np.int64] = slice(None) if boot is None else rows
        columns: Mapping[str, NDArray[Any]] = self.source.columns(stream, chosen)
        table = Table(
            self.source,
            stream.description,
            system_id=stream.system_id,
            component_id=stream.component_id,
            positions=stream.order[chosen],
            columns=columns,
            instance=instance,
            boot=boot,
        )
        return table if instance is None else self._of_instance(table, instance)

    def _of_instance(self, table: Table, instance: int | str) -> Table:
        field = table.description.instance_field
        if field is None:
            raise LogError(f"{table.name} has no instances; leave instance out")
        values = table[field]
        wanted = instance.encode() if values.dtype.kind == "S" and isinstance(instance, str) else instance
        rows = np.flatnonzero(values == wanted)
        if not len(rows):
            there = ", ".join(str(item) for item in np.unique(values).tolist())
            raise LogError(f"{self.path}: no {table.name} with {field} {instance!r}; there is {there}")
        return table.select(rows)

    def _missing(self, name: str, system_id: int | None, component_id: int | None) -> LogError:
        senders = [f"{s.system_id}/{s.component_id}" for s in self._find((name,), None, None)]
        if senders:
            sender = "/".join("*" if number is None else str(number) for number in (system_id, component_id))
            return LogError(
                f"{self.path}: no {name.upper()} from {sender}; it comes from {', '.join(senders)}"
            )
        names = sorted({stream.name for stream in self.source.streams})
        return LogError(f"{self.path} has no {name.upper()}; it has {', '.join(names)}")


def _rate_hz(times_us: NDArray[np.int64]) -> float:
    """Messages per second while they were sent; gaps are left out."""
    steps = np.diff(times_us)
    steps = steps[steps >= 0]
    if not len(steps):
        return 0.0
    limit = max(_LONG_GAP_US, _LONG_GAP_INTERVALS * float(np.median(steps)))
    steps = steps[steps <= limit]
    total = int(steps.sum())
    return len(steps) / (max(total, _LEAST_SPAN_US) * 1e-6) if total else 0.0


def _names(names: str | Iterable[str] | None) -> Sequence[str] | None:
    if names is None:
        return None
    return (names,) if isinstance(names, str) else tuple(names)


def _is_in(number: int, wanted: Ids) -> bool:
    return wanted is None or (number == wanted if isinstance(wanted, int) else number in wanted)
