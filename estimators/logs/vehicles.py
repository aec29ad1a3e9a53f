"""Vehicles of a log: their type, their modes, and when they were armed, all from HEARTBEAT."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from autopilot_bridge.mavlink import dialect, enum_name
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from estimators.logs.ardupilot_firmware import firmware_of, mode_names
from estimators.logs.log import Log
from estimators.logs.table import Table
from flightsim.foundation.plain_text import plain_text

_HEARTBEAT: Final = "HEARTBEAT"
_STATUSTEXT: Final = "STATUSTEXT"
_AUTOPILOT_VERSION: Final = "AUTOPILOT_VERSION"
_ARMED: Final = dialect.MAV_MODE_FLAG_SAFETY_ARMED
_CUSTOM: Final = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED


@dataclass(frozen=True, slots=True, kw_only=True)
class ModeSpan:
    """Time in one mode, from the first HEARTBEAT that reports it to the first that reports another mode (or
    to the last one).

    Attributes:
        mode: name as in ground stations.
        custom_mode: number in HEARTBEAT.
        boot: number of the boot of the log's clock.
        start_us, end_us: on the log's clock.
    """

    mode: str
    custom_mode: int
    boot: int
    start_us: int
    end_us: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """Time armed, from the first HEARTBEAT that reports armed to the first that does not (or to the last
    one).

    Attributes:
        boot: number of the boot of the log's clock.
        start_us, end_us: on the log's clock.
    """

    boot: int
    start_us: int
    end_us: int


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleReport:
    """One vehicle.

    Attributes:
        system_id: its id.
        firmware: its name and version, "ArduCopter V3.3-dev (82481f30)", "PX4 1.16.1"; "": not known.
        autopilot, type: names of MAV_AUTOPILOT and MAV_TYPE without the prefix, "PX4", "QUADROTOR"; of the
            newest HEARTBEAT.
        boots: number of its boots in the log.
        modes, flights: in the order of the log.
    """

    system_id: int
    firmware: str
    autopilot: str
    type: str
    boots: int
    modes: tuple[ModeSpan, ...]
    flights: tuple[Flight, ...]


def vehicles(log: Log) -> tuple[VehicleReport, ...]:
    """Vehicles whose autopilot sent a HEARTBEAT, by system id."""
    found = []
    if not any(stream.name == _HEARTBEAT for stream in log.source.streams):
        return ()
    for table in sorted(
        log.tables(_HEARTBEAT, component_id=AUTOPILOT_COMPONENT), key=lambda item: item.system_id
    ):
        kinds = np.flatnonzero(
            (table["autopilot"] != dialect.MAV_AUTOPILOT_INVALID) & (table["type"] != dialect.MAV_TYPE_GCS)
        )
        if not len(kinds):
            continue
        table = table.select(kinds)
        starts = log.source.boot_starts.get(table.system_id, np.empty(0, dtype=np.int64))
        times_us, boot_of = log.clock.time_us[table.order], log.clock.boot[table.order]
        autopilot, vehicle_type = int(table["autopilot"][-1]), int(table["type"][-1])
        text, version = _firmware(log, table.system_id, autopilot)
        found.append(
            VehicleReport(
                system_id=table.system_id,
                firmware=text,
                autopilot=_enum_name("MAV_AUTOPILOT", autopilot),
                type=_enum_name("MAV_TYPE", vehicle_type),
                boots=len(starts) + 1,
                modes=_modes(table, times_us, boot_of, autopilot, vehicle_type, version),
                flights=_flights(table, times_us, boot_of),
            )
        )
    return tuple(found)


def mode_name(
    autopilot: int,
    vehicle_type: int,
    base_mode: int,
    custom_mode: int,
    version: tuple[int, int] | None = None,
) -> str:
    """Name of a mode as in ground stations, from the fields of HEARTBEAT; "MODE 7" when it has no name.

    Args:
        autopilot, vehicle_type, base_mode, custom_mode: of HEARTBEAT.
        version: version of an ArduPilot firmware, major and minor; None: not known.
    """
    if autopilot == dialect.MAV_AUTOPILOT_PX4:
        from pymavlink import mavutil  # imported here because it is slow

        return str(mavutil.interpret_px4_mode(base_mode, custom_mode))
    names = mode_names(vehicle_type, version) if base_mode & _CUSTOM else {}
    return names.get(custom_mode, f"MODE {custom_mode}")


def _firmware(log: Log, system_id: int, autopilot: int) -> tuple[str, tuple[int, int] | None]:
    """Name and version of a vehicle's firmware, from its banner, else from AUTOPILOT_VERSION."""
    for table in _of_autopilot(log, _STATUSTEXT, system_id):
        made_by = firmware_of(plain_text(text.decode("ascii", "replace")) for text in table["text"].tolist())
        if made_by.text:
            return made_by.text, made_by.version
    for table in _of_autopilot(log, _AUTOPILOT_VERSION, system_id):
        numbers = table["flight_sw_version"]
        if numbers.any():
            number = int(numbers[np.flatnonzero(numbers)[0]])
            major, minor, patch = number >> 24, number >> 16 & 0xFF, number >> 8 & 0xFF
            name = "PX4" if autopilot == dialect.MAV_AUTOPILOT_PX4 else "firmware"
            return f"{name} {major}.{minor}.{patch}", (major, minor)
    return "", None


def _of_autopilot(log: Log, name: str, system_id: int) -> list[Table]:
    if not any(key.name == name and key.system_id == system_id for key in log.keys):
        return []
    return log.tables(name, system_id=system_id, component_id=AUTOPILOT_COMPONENT)


def _modes(
    table: Table,
    times_us: NDArray[np.int64],
    boot_of: NDArray[np.int64],
    autopilot: int,
    vehicle_type: int,
    version: tuple[int, int] | None,
) -> tuple[ModeSpan, ...]:
    custom, base = table["custom_mode"], table["base_mode"]
    # PX4's mode names depend on the base mode too, but not on the armed flag; and other flags of it
    # change in flight without another mode.
    pairs, which = np.unique(
        np.stack((custom.astype(np.int64), (base & ~np.uint8(_ARMED)).astype(np.int64)), axis=1),
        axis=0,
        return_inverse=True,
    )
    names = [mode_name(autopilot, vehicle_type, int(b), int(c), version) for c, b in pairs]
    named = np.array([names.index(name) for name in names])[which.reshape(-1)]
    firsts, ends = _spans(custom, named, boot_of)
    return tuple(
        ModeSpan(
            mode=mode_name(autopilot, vehicle_type, int(base[first]), int(custom[first]), version),
            custom_mode=int(custom[first]),
            boot=int(boot_of[first]),
            start_us=int(times_us[first]),
            end_us=int(times_us[end]),
        )
        for first, end in zip(firsts, ends, strict=True)
    )


def _flights(table: Table, times_us: NDArray[np.int64], boot_of: NDArray[np.int64]) -> tuple[Flight, ...]:
    armed = (table["base_mode"] & _ARMED) != 0
    return tuple(
        Flight(boot=int(boot_of[first]), start_us=int(times_us[first]), end_us=int(times_us[end]))
        for first, end in zip(*_spans(armed, boot_of, boot_of), strict=True)
        if armed[first]
    )


def _spans(
    values: NDArray[Any], others: NDArray[Any], boot_of: NDArray[np.int64]
) -> tuple[Sequence[int], Sequence[int]]:
    """First rows of runs of equal values, and the rows that end them, which are the first of the next run in
    the same boot.
    """
    changes = (np.diff(values) != 0) | (np.diff(others) != 0) | (np.diff(boot_of) != 0)
    firsts = np.concatenate(([0], np.flatnonzero(changes) + 1))
    nexts = np.append(firsts[1:], len(values) - 1)
    ends = np.where(boot_of[nexts] == boot_of[firsts], nexts, nexts - 1)
    return firsts.tolist(), ends.tolist()


@cache
def _enum_name(enum: str, value: int) -> str:
    return enum_name(enum, value) or f"{enum} {value}"
