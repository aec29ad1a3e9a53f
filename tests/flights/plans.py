"""Uploading and reading back missions, fences and rally points over the link, as a ground station does."""

import math
from collections.abc import Sequence
from typing import Any, Final

from autopilot_bridge.mavlink import dialect
from tests.flights.flight import SYSTEM_ID, Flight

MISSION, FENCE, RALLY = 0, 1, 2
RELATIVE_INT: Final = 6
PLAIN: Final = 2
_METRES_PER_DEG: Final = math.radians(6_371_000.0)


def geodetic(flight: Flight, north_m: float, east_m: float) -> tuple[float, float]:
    """(latitude, longitude) deg of a place given from home."""
    home = flight.sitl.spec.place
    lat = home.lat_deg + north_m / _METRES_PER_DEG
    return lat, home.lon_deg + east_m / (_METRES_PER_DEG * math.cos(math.radians(home.lat_deg)))


def at(
    flight: Flight,
    command: int,
    north_m: float,
    east_m: float,
    height_m: float = 0.0,
    *params: float,
    frame: int = RELATIVE_INT,
) -> tuple[Any, ...]:
    """An item at a place: (frame, command, four parameters, x, y, z)."""
    lat, lon = geodetic(flight, north_m, east_m)
    values = (*params, *(0.0,) * (4 - len(params)))
    return (frame, command, *values, round(lat * 1e7), round(lon * 1e7), height_m)


def do(command: int, *params: float, x: int = 0, y: int = 0, z: float = 0.0) -> tuple[Any, ...]:
    """An item without a place."""
    return (PLAIN, command, *params, *(0.0,) * (4 - len(params)), x, y, z)


def upload(
    flight: Flight, items: Sequence[tuple[Any, ...]], kind: int = MISSION, *, floats: bool = False
) -> int:
    """Upload a plan; the result of its MISSION_ACK. ArduPilot's home is put before a mission.

    Args:
        floats: in MISSION_ITEM messages, as old clients do.
    """
    plan = list(items)
    if flight.flavour == "ardupilot" and kind == MISSION:
        plan.insert(0, at(flight, 16, 0.0, 0.0))
    for name in ("MISSION_ACK", "MISSION_REQUEST", "MISSION_REQUEST_INT"):
        flight.newest.pop(name, None)
    flight.send(dialect.MAVLink_mission_count_message(SYSTEM_ID, 1, len(plan), kind))
    for _ in range(10 * len(plan) + 20):
        flight.fly(0.1)
        ack = flight.newest.get("MISSION_ACK")
        if ack is not None:
            assert ack.mission_type == kind
            return int(ack.type)
        for name in ("MISSION_REQUEST", "MISSION_REQUEST_INT"):
            request = flight.newest.pop(name, None)
            if request is not None:
                _send(flight, request.seq, plan[request.seq], kind, floats)
    raise AssertionError("an upload without an end")


def _send(flight: Flight, seq: int, item: tuple[Any, ...], kind: int, floats: bool) -> None:
    frame, command, p1, p2, p3, p4, x, y, z = item
    make = dialect.MAVLink_mission_item_int_message
    if floats:
        make = dialect.MAVLink_mission_item_message
        frame = 3 if frame == RELATIVE_INT else frame
        x, y = (x, y) if frame == PLAIN else (x * 1e-7, y * 1e-7)
    flight.send(make(SYSTEM_ID, 1, seq, frame, command, 0, 1, p1, p2, p3, p4, x, y, z, kind))


def download(flight: Flight, kind: int = MISSION) -> list[Any]:
    """Read a plan back: its MISSION_ITEM_INTs."""
    flight.newest.pop("MISSION_COUNT", None)
    flight.send(dialect.MAVLink_mission_request_list_message(SYSTEM_ID, 1, kind))
    flight.fly(0.2)
    items = []
    for seq in range(flight.newest["MISSION_COUNT"].count):
        flight.newest.pop("MISSION_ITEM_INT", None)
        flight.send(dialect.MAVLink_mission_request_int_message(SYSTEM_ID, 1, seq, kind))
        flight.fly(0.2)
        items.append(flight.newest["MISSION_ITEM_INT"])
    flight.send(dialect.MAVLink_mission_ack_message(SYSTEM_ID, 1, 0, kind))
    flight.fly(0.2)
    return items


def square(
    flight: Flight, half_m: float, north_m: float = 0.0, *, inside: bool = True
) -> list[tuple[Any, ...]]:
    """A square of a fence."""
    corners = ((-half_m, -half_m), (-half_m, half_m), (half_m, half_m), (half_m, -half_m))
    command = 5001 if inside else 5002
    return [at(flight, command, north_m + n, e, 0.0, 4.0, frame=0) for n, e in corners]
