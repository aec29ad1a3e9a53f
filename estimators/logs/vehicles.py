"""Vehicles of a log: what they are, their modes, and when they were armed, all from HEARTBEAT."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import dialect, enum_name
from estimators.logs.table import Table
from estimators.vehicle_time import AUTOPILOT

if TYPE_CHECKING:
    from estimators.logs.log import Log

_HEARTBEAT: Final = "HEARTBEAT"
_ARMED: Final = dialect.MAV_MODE_FLAG_SAFETY_ARMED
_CUSTOM: Final = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeSpan:
    """Time in one mode, from the first HEARTBEAT that tells it to the first that tells another (or to the
    last one).

    Attributes:
        mode: name, as ground stations call it.
        custom_mode: number in HEARTBEAT.
        boot: number of the boot.
        start_us, end_us: vehicle time.
    """

    mode: str
    custom_mode: int
    boot: int
    start_us: int
    end_us: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """Time armed, from the first HEARTBEAT that says so to the first that does not (or to the last one).

    Attributes:
        boot: number of the boot.
        start_us, end_us: vehicle time.
    """

    boot: int
    start_us: int
    end_us: int


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleReport:
    """One vehicle.

    Attributes:
        system_id: its id.
        autopilot, type: names of MAV_AUTOPILOT and MAV_TYPE without the prefix, "PX4", "QUADROTOR"; of the
            newest HEARTBEAT.
        boots: how many boots of it are in the log.
        modes, flights: in the order of the log.
    """

    system_id: int
    autopilot: str
    type: str
    boots: int
    modes: tuple[ModeSpan, ...]
    flights: tuple[Flight, ...]


def vehicles(log: "Log") -> tuple[VehicleReport, ...]:
    """Vehicles whose autopilot sent a HEARTBEAT, by system id."""
    found = []
    if not any(stream.name == _HEARTBEAT for stream in log.source.streams):
        return ()
    for table in sorted(log.tables(_HEARTBEAT, component_id=AUTOPILOT), key=lambda item: item.system_id):
        kinds = np.flatnonzero(
            (table["autopilot"] != dialect.MAV_AUTOPILOT_INVALID) & (table["type"] != dialect.MAV_TYPE_GCS)
        )
        if not len(kinds):
            continue
        table = table.select(kinds)
        starts = log.source.boot_starts.get(table.system_id, np.empty(0, dtype=np.int64))
        boot_of = np.searchsorted(starts, table.order, side="right")
        autopilot, vehicle_type = int(table["autopilot"][-1]), int(table["type"][-1])
        found.append(
            VehicleReport(
                system_id=table.system_id,
                autopilot=_enum_name("MAV_AUTOPILOT", autopilot),
                type=_enum_name("MAV_TYPE", vehicle_type),
                boots=len(starts) + 1,
                modes=_modes(table, boot_of, autopilot, vehicle_type),
                flights=_flights(table, boot_of),
            )
        )
    return tuple(found)


def mode_name(autopilot: int, vehicle_type: int, base_mode: int, custom_mode: int) -> str:
    """Name of a mode as ground stations call it, from the fields of HEARTBEAT; "MODE 7" when it has none."""
    from pymavlink import mavutil  # here, for it takes its time

    if autopilot == dialect.MAV_AUTOPILOT_PX4:
        return str(mavutil.interpret_px4_mode(base_mode, custom_mode))
    names = mavutil.mode_mapping_bynumber(vehicle_type) if base_mode & _CUSTOM else None
    return str((names or {}).get(custom_mode, f"MODE {custom_mode}"))


def _modes(
    table: Table, boot_of: NDArray[np.int64], autopilot: int, vehicle_type: int
) -> tuple[ModeSpan, ...]:
    custom, base = table["custom_mode"], table["base_mode"]
    # PX4's name of a mode depends on the base mode too, but not on whether it is armed; and other flags of it
    # change in flight without another mode.
    pairs, which = np.unique(
        np.stack((custom.astype(np.int64), (base & ~np.uint8(_ARMED)).astype(np.int64)), axis=1),
        axis=0,
        return_inverse=True,
    )
    names = [mode_name(autopilot, vehicle_type, int(b), int(c)) for c, b in pairs]
    named = np.array([names.index(name) for name in names])[which.reshape(-1)]
    firsts, ends = _spans(custom, named, boot_of)
    return tuple(
        ModeSpan(
            mode=mode_name(autopilot, vehicle_type, int(base[first]), int(custom[first])),
            custom_mode=int(custom[first]),
            boot=int(boot_of[first]),
            start_us=int(table.time_us[first]),
            end_us=int(table.time_us[end]),
        )
        for first, end in zip(firsts, ends, strict=True)
    )


def _flights(table: Table, boot_of: NDArray[np.int64]) -> tuple[Flight, ...]:
    armed = (table["base_mode"] & _ARMED) != 0
    return tuple(
        Flight(boot=int(boot_of[first]), start_us=int(table.time_us[first]), end_us=int(table.time_us[end]))
        for first, end in zip(*_spans(armed, boot_of, boot_of), strict=True)
        if armed[first]
    )


def _spans(
    values: NDArray[Any], others: NDArray[Any], boot_of: NDArray[np.int64]
) -> tuple[Sequence[int], Sequence[int]]:
    """First rows of runs of equal values, and rows that end them: the next run's first, in the same boot."""
    changes = (np.diff(values) != 0) | (np.diff(others) != 0) | (np.diff(boot_of) != 0)
    firsts = np.concatenate(([0], np.flatnonzero(changes) + 1))
    nexts = np.append(firsts[1:], len(values) - 1)
    ends = np.where(boot_of[nexts] == boot_of[firsts], nexts, nexts - 1)
    return firsts.tolist(), ends.tolist()


@cache
def _enum_name(enum: str, value: int) -> str:
    return enum_name(enum, value) or f"{enum} {value}"
