"""The contents and defects of a log in figures."""

from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import place_columns
from estimators.logs.log import Log
from estimators.logs.source import SourceLoss, UnknownMessage
from estimators.logs.vehicles import VehicleReport, vehicles
from estimators.received import GAP_US, received_positions, together
from flightsim.foundation.plain_text import plain_text

_MAX_INSTANCES: Final = 32
_POSITIONS: Final = {"GLOBAL_POSITION_INT": ("time_boot_ms", 1000), "HIL_STATE_QUATERNION": ("time_usec", 1)}
"""Messages whose places and times are checked, with their stamp and its unit in microseconds."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StreamReport:
    """One message of one component.

    Attributes:
        name, system_id, component_id: the message and its sender.
        count: number of messages.
        rate_hz: mean rate while it was sent.
        longest_gap_s: longest time between consecutive messages, in vehicle time, in one boot.
        instances: values of its instance field, at most 32; empty for messages without.
    """

    name: str
    system_id: int
    component_id: int
    count: int
    rate_hz: float
    longest_gap_s: float
    instances: tuple[int | str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Gap:
    """A time in which no message of a system with an autopilot was received, although its clock advanced.

    Attributes:
        system_id: which system.
        boot: number of the boot of the log's clock.
        start_us, end_us: times of the last message before and the first after it, on the log's clock.
    """

    system_id: int
    boot: int
    start_us: int
    end_us: int


@dataclass(frozen=True, slots=True, kw_only=True)
class BootReport:
    """One boot of a system: its number, and vehicle time of its first and newest message."""

    system_id: int
    number: int
    start_us: int
    end_us: int


@dataclass(frozen=True, slots=True, kw_only=True)
class LeftOut:
    """Messages of one component with positions or times that no vehicle can have: their number by reason."""

    name: str
    system_id: int
    component_id: int
    count_by_reason: dict[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class LogReport:
    """Figures of a log.

    Attributes:
        path, format, size_bytes: the file.
        dialect: dialect with which it was read.
        messages: number of valid messages.
        duration_s, start_unix_us: as in `Log`.
        bytes_by_kind: the bytes of the file, by the use of each; the sum is `size_bytes`.
        drops: number of dropped items, by reason.
        remarks: figures that only this format has: MAVLink versions, kind of time stamps.
        losses: losses from sequence numbers, for each component.
        unknown: messages that the dialect does not know.
        boots, gaps: for each system.
        left_out: positions and times that no vehicle can have, which comparisons leave out.
        vehicles: their types, modes and flights.
        streams: rates, by system, component and name.
        clock: origin of the times of gaps, modes and flights.
    """

    path: str
    format: str
    size_bytes: int
    dialect: str
    messages: int
    duration_s: float
    start_unix_us: int | None
    bytes_by_kind: dict[str, int]
    drops: dict[str, int]
    remarks: dict[str, int | str]
    losses: tuple[SourceLoss, ...]
    unknown: tuple[UnknownMessage, ...]
    boots: tuple[BootReport, ...]
    gaps: tuple[Gap, ...]
    left_out: tuple[LeftOut, ...]
    vehicles: tuple[VehicleReport, ...]
    streams: tuple[StreamReport, ...]
    clock: str

    def to_dict(self) -> dict[str, Any]:
        """The report for JSON: numbers, texts, lists and dictionaries."""
        return asdict(self)


def report_of(log: Log) -> LogReport:
    """Make the report of a log."""
    source = log.source
    return LogReport(
        path=str(log.path),
        format=log.format,
        size_bytes=log.size_bytes,
        dialect=source.dialect.name,
        messages=len(log),
        duration_s=log.duration_s,
        start_unix_us=log.start_unix_us,
        bytes_by_kind=dict(source.bytes_by_kind),
        drops=dict(source.drops),
        remarks=dict(source.remarks),
        losses=tuple(source.losses),
        unknown=tuple(source.unknown),
        boots=tuple(
            BootReport(
                system_id=boot.system_id, number=boot.number, start_us=boot.start_us, end_us=boot.end_us
            )
            for boot in log.boots
        ),
        gaps=_gaps(log),
        left_out=_left_out(log),
        vehicles=vehicles(log),
        streams=_streams(log),
        clock=log.clock.text,
    )


def _streams(log: Log) -> tuple[StreamReport, ...]:
    found = []
    for stream in log.source.streams:
        steps = np.diff(log.source.time_us[stream.order])
        field = stream.description.instance_field
        instances: list[int | str] = []
        if field is not None:
            values = np.unique(log.stream_table(stream)[field])[:_MAX_INSTANCES]
            instances = [
                plain_text(item.decode("ascii", "replace")) if isinstance(item, bytes) else item
                for item in values.tolist()
            ]
        found.append(
            StreamReport(
                name=stream.name,
                system_id=stream.system_id,
                component_id=stream.component_id,
                count=len(stream.order),
                rate_hz=log.stream_rate_hz(stream),
                longest_gap_s=max(0, int(steps.max(initial=0))) * 1e-6,
                instances=tuple(instances),
            )
        )
    return tuple(sorted(found, key=lambda item: (item.system_id, item.component_id, item.name)))


def _left_out(log: Log) -> tuple[LeftOut, ...]:
    found = []
    for stream in log.source.streams:
        stamp = _POSITIONS.get(stream.name)
        if stamp is None:
            continue
        counts: dict[str, int] = {}
        for boot in (boot.number for boot in log.boots if boot.system_id == stream.system_id):
            table = log.table(
                stream.name, system_id=stream.system_id, component_id=stream.component_id, boot=boot
            )
            lat_deg, lon_deg, alt_m = place_columns(table)
            placed = (lat_deg != 0.0) | (lon_deg != 0.0)  # ArduPilot sends 0, 0 until it has a position
            time_us = table[stamp[0]].astype(np.int64) * stamp[1]
            own = received_positions(time_us[placed], lat_deg[placed], lon_deg[placed], alt_m[placed])
            counts = together(counts, own.left_out)
        if counts:
            found.append(
                LeftOut(
                    name=stream.name,
                    system_id=stream.system_id,
                    component_id=stream.component_id,
                    count_by_reason=counts,
                )
            )
    return tuple(found)


def _gaps(log: Log) -> tuple[Gap, ...]:
    found = []
    clock = log.clock
    # A system without an autopilot has no clock that advances by itself.
    clocked = {
        stream.system_id for stream in log.source.streams if stream.component_id == AUTOPILOT_COMPONENT
    }
    for boot in log.boots:
        if boot.system_id not in clocked:
            continue
        orders = [
            stream.order[slice(*np.searchsorted(stream.order, (boot.first, boot.last + 1)))]
            for stream in log.source.streams
            if stream.system_id == boot.system_id
        ]
        order = np.sort(np.concatenate(orders))
        times = np.maximum.accumulate(log.source.time_us[order])
        order, times = order[times > 0], times[times > 0]
        for row in np.flatnonzero(np.diff(times) > GAP_US).tolist():
            before, after = int(order[row]), int(order[row + 1])
            own = boot.system_id == clock.system_id
            found.append(
                Gap(
                    system_id=boot.system_id,
                    boot=int(clock.boot[after]),
                    start_us=int(times[row] if own else clock.time_us[before]),
                    end_us=int(times[row + 1] if own else clock.time_us[after]),
                )
            )
    return tuple(found)
