"""Ranges between vehicles in TUNNEL messages: one message per measured vehicle.

MAVLink has no message for the distance to another vehicle. DISTANCE_SENSOR is for obstacles in a direction of
the body, and has no field for a vehicle's identity. docs/mavlink/vehicle_range.md has the payload's table.
"""

from dataclasses import dataclass
from typing import Annotated, Final

from autopilot_bridge.mavlink.tunnel import Tunnel, Wire

__all__ = ["VEHICLE_RANGE", "VEHICLE_RANGE_PAYLOAD", "VehicleRange", "range_message", "read_range_payload"]

VEHICLE_RANGE_PAYLOAD: Final = 0xF519
_NUMBER: Final = (
    "counts the radio's measurements from 0, failed ones included, modulo 65536; a gap shows lost ones"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleRange:
    """One measured range."""

    to_system: Annotated[
        int, Wire("B", "system id of the measured vehicle, 1 to 255", name="system", least=1)
    ]
    number: Annotated[int, Wire("H", _NUMBER, modulo=True)]
    sigma_m: Annotated[float, Wire("f", "standard deviation of the range, m, above 0", above=0.0)]
    time_us: Annotated[
        int, Wire("Q", "time of the measurement, microseconds since the boot of the measuring vehicle")
    ]
    range_m: Annotated[float, Wire("f", "slant range, m, not negative", least=0.0)]


VEHICLE_RANGE: Final = Tunnel(VehicleRange, VEHICLE_RANGE_PAYLOAD)
range_message = VEHICLE_RANGE.message
read_range_payload = VEHICLE_RANGE.read
