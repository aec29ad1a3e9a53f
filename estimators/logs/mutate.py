"""A recorded log with inserted faults: the data that would have been received if a sensor or the link had
failed.
"""

import math
from collections.abc import Iterator, Sequence
from typing import Any, Final

import numpy as np
from fastcrc.crc16 import mcrf4xx
from numpy.typing import NDArray

from autopilot_bridge.mavlink import MessageDefinition
from autopilot_bridge.mavlink.frame import HEADER_SIZE_V1, HEADER_SIZE_V2, INCOMPAT_SIGNED, MAGIC_V2
from autopilot_bridge.mavlink.wire_units import degrees, to_e7
from estimators.errors import LogError
from estimators.logs.columns import record_dtype
from estimators.logs.faults import Fault, FaultKind
from estimators.logs.iterate import Selection
from estimators.logs.log import Log
from estimators.logs.raw_records import Record, positions, read_records, record_times_us
from estimators.logs.source import Stream
from estimators.logs.units import to_si
from flightsim.foundation.geodesy import MEAN_RADIUS_M, longitude_near

_SPIKE_SHARE: Final = 0.01
_GLOBAL: Final = frozenset({"lat", "lon"})

Rows = NDArray[np.int64]

_LONGEST_STEP: Final = 10.0
"""Largest number of spells of an intermittent fault that a pause of the log can span."""
_LAST_US: Final = np.iinfo(np.int64).max


def mutated_records(
    log: Log, selections: Sequence[Selection], faults: Sequence[Fault], *, seed: int = 0
) -> Iterator[Record]:
    """Iterate over the records of a log with faults, sorted by time.

    Changed frames get a new checksum and lose their signature, if they had one.

    Args:
        log: an open telemetry log.
        selections: the messages to keep, from `Log.select`.
        faults: the faults to insert.
        seed: seed of the random numbers.

    Raises:
        LogError: a fault affects no message, or a field that a message does not have.
    """
    clock_s: NDArray[np.float64] = (log.clock.time_us * 1e-6).astype(np.float64)
    gone: list[NDArray[np.int64]] = []
    later: dict[int, int] = {}
    changed: dict[int, bytes] = {}
    streams = {id(stream): (stream, rows) for stream, rows in selections}
    for number, fault in enumerate(faults):
        touched = 0
        for key, (stream, rows) in streams.items():
            if stream.name not in fault.fields:
                continue
            rng = np.random.default_rng([seed, number, stream.system_id, stream.component_id, touched])
            order = stream.order[rows].astype(np.int64)
            times_s = clock_s[order]
            hit = np.flatnonzero((times_s >= fault.from_s) & (times_s < fault.to_s))
            if not len(hit):
                continue
            touched += len(hit)
            lost = _lost(fault, times_s[hit], rng)
            if lost is not None and (fault.kind is not FaultKind.OFF or _is_alone(stream, fault)):
                gone.append(order[hit[lost]])
                keep = np.ones(len(rows), dtype=np.bool_)
                keep[hit[lost]] = False
                streams[key] = (stream, rows[keep])
            elif fault.kind is FaultKind.DELAYED:
                assert fault.value is not None
                for position in order[hit].tolist():
                    later[position] = later.get(position, 0) + round(fault.value * 1e6)
            else:
                changed |= _changed(log, stream, rows[hit], times_s[hit], fault, rng, changed)
        if not touched:
            names = ", ".join(fault.fields)
            raise LogError(
                f"{log.path}: nothing for the fault {fault.kind} between its times; it needs {names}"
            )
    kept = positions(selections)
    if gone:
        kept = np.setdiff1d(kept, np.concatenate(gone), assume_unique=True)
    times = record_times_us(log, kept)
    for row, position in enumerate(kept.tolist()):
        times[row] = min(int(times[row]) + later.get(position, 0), _LAST_US)
    sorting = np.argsort(times, kind="stable") if later else np.arange(len(kept))
    ordered = kept[sorting]
    for position, time_us, (_, frame) in zip(
        ordered.tolist(), times[sorting].tolist(), read_records(log, ordered), strict=True
    ):
        yield time_us, changed.get(position, frame)


def _is_alone(stream: Stream, fault: Fault) -> bool:
    """Whether a message has only failing values; an IMU message is still sent when only its gyro is off."""
    fields = fault.fields[stream.name]
    others = {"xacc", "xgyro", "groundspeed", "press_abs", "load"}
    return not fields or not others & (set(stream.description.definition.field_names) - set(fields))


def _lost(fault: Fault, times_s: NDArray[np.float64], rng: np.random.Generator) -> Rows | None:
    """The messages that do not arrive; None: the kind of fault loses none."""
    count = len(times_s)
    match fault.kind:
        case FaultKind.OFF:
            return np.arange(count)
        case FaultKind.DROP:
            assert fault.value is not None
            return np.flatnonzero(rng.random(count) < fault.value)
        case FaultKind.SLOW:
            assert fault.value is not None
            factor = int(fault.value)
            return np.flatnonzero((np.arange(count) + 1) % factor != 0)
        case FaultKind.INTERMITTENT:
            assert fault.value is not None
            # Stamps may go back or, if damaged, jump far: a step back takes no time, and a jump at most some
            # spells.
            steps_s = np.clip(np.diff(times_s, prepend=times_s[0]), 0.0, _LONGEST_STEP * fault.value)
            elapsed_s = np.cumsum(steps_s)
            edges = [0.0]
            while edges[-1] <= elapsed_s[-1]:
                edges.append(edges[-1] + max(1e-3, float(rng.exponential(fault.value))))
            spell = np.searchsorted(np.array(edges), elapsed_s, side="right") - 1
            return np.flatnonzero(spell % 2 == 0)  # missing first
    return None


def _changed(
    log: Log,
    stream: Stream,
    rows: Rows,
    times_s: NDArray[np.float64],
    fault: Fault,
    rng: np.random.Generator,
    before: dict[int, bytes],
) -> dict[int, bytes]:
    """New frames of these messages, by position."""
    definition = stream.description.definition
    fields = fault.fields[stream.name] or tuple(
        field.name
        for field in definition.wire_fields
        if field.code in "fd" or (field.code in "hiHI" and field.name in stream.description.units)
        if not field.name.startswith("time_")
    )
    for field in fields:
        if field not in definition.field_names:
            raise LogError(
                f"{stream.name} has no field {field!r}; it has {', '.join(definition.field_names)}"
            )
    order = stream.order[rows].astype(np.int64)
    raw = [
        before.get(position, frame)
        for position, (_, frame) in zip(order.tolist(), read_records(log, order), strict=True)
    ]
    records = np.frombuffer(
        b"".join(_payload(frame, definition.size) for frame in raw), record_dtype(definition)
    )
    records = records.copy()
    for field in fields:
        column = records[field]
        if column.dtype.kind not in "iuf":
            raise LogError(f"{stream.name}.{field} is a text; faults change numbers")
        scale = 1.0 / to_si(stream.description.units.get(field, ""))[0]
        if field in _GLOBAL:
            scale = _wire_per_metre(field, records)
        spoiled = _spoiled(column.astype(np.float64), times_s, fault, scale, rng)
        if field == "lon" and fault.kind is not FaultKind.GARBAGE:  # an error across 180 degrees
            spoiled = to_e7(longitude_near(degrees(spoiled)))
        records[field] = _fitted(spoiled, column.dtype)
    return {
        position: _reframed(frame, record.tobytes(), definition)
        for position, frame, record in zip(order.tolist(), raw, records, strict=True)
    }


def _wire_per_metre(field: str, records: NDArray[np.void]) -> float:
    """Wire value (degE7) of one metre to the north or the east."""
    per_metre = to_e7(math.degrees(1.0 / MEAN_RADIUS_M))
    if field == "lon":
        per_metre /= max(0.01, math.cos(math.radians(degrees(float(records["lat"][0])))))
    return per_metre


def _spoiled(
    values: NDArray[np.float64],
    times_s: NDArray[np.float64],
    fault: Fault,
    scale: float,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Wire values with the fault applied."""
    amount = 0.0 if fault.value is None else fault.value * scale
    shape = (len(values),) + (1,) * (values.ndim - 1)
    match fault.kind:
        case FaultKind.STUCK | FaultKind.OFF:  # a driver still reads values that are no longer updated
            return np.broadcast_to(values[:1], values.shape)
        case FaultKind.GARBAGE:
            return rng.uniform(-amount, amount, values.shape)
        case FaultKind.WRONG:
            return values + amount
        case FaultKind.DRIFT:
            since_s = times_s - max(fault.from_s, float(times_s[0]))
            return values + amount * since_s.reshape(shape)
        case FaultKind.NOISE:
            return values + rng.normal(0.0, max(amount, 0.0), values.shape)
        case FaultKind.SPIKE:
            return values + amount * (rng.random(len(values)) < _SPIKE_SHARE).reshape(shape)
        case _:
            raise AssertionError(fault.kind)


def _fitted(values: NDArray[np.float64], dtype: np.dtype[Any]) -> NDArray[Any]:
    if dtype.kind == "f":
        return values.astype(dtype)
    limits = np.iinfo(dtype)
    return np.clip(np.rint(values), limits.min, limits.max).astype(dtype)


def _payload(frame: bytes, size: int) -> bytes:
    start = HEADER_SIZE_V2 if frame[0] == MAGIC_V2 else HEADER_SIZE_V1
    return frame[start : start + min(frame[1], size)].ljust(size, b"\0")


def _reframed(frame: bytes, payload: bytes, definition: MessageDefinition) -> bytes:
    """The frame with another payload; MAVLink 2 omits trailing zeros (guide, "Payload truncation")."""
    if frame[0] == MAGIC_V2:
        body = payload.rstrip(b"\0") or b"\0"
        flags = frame[2] & ~INCOMPAT_SIGNED
        header = bytes((len(body), flags)) + frame[3:HEADER_SIZE_V2]
    else:
        body = payload[: frame[1]].ljust(frame[1], b"\0")
        header = frame[1:HEADER_SIZE_V1]
    covered = header + body
    crc = mcrf4xx(covered + bytes((definition.crc_extra,)))
    return frame[:1] + covered + crc.to_bytes(2, "little")
