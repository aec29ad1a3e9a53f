"""Motion of an aircraft without GPS in TUNNEL messages, for another aircraft.

MAVLink's messages of velocity are against the ground. HIGHRES_IMU has all that is needed, at 50 Hz and more,
and each lost one is a lost piece of the way. So here are sums since the start: what is between two messages
is known from these two, however many were lost. docs/mavlink/handoff.md has the payload's table.
"""

from dataclasses import dataclass
from typing import Annotated, Final

from autopilot_bridge.mavlink.tunnel import Tunnel, Wire

__all__ = [
    "VEHICLE_MOTION",
    "VEHICLE_MOTION_PAYLOAD",
    "VehicleMotion",
    "motion_message",
    "read_motion_payload",
]

VEHICLE_MOTION_PAYLOAD: Final = 0xF51E
_SUMS: Final = (
    "sums of the way forward, right and down against the air, each in the level frame of its time, m, "
    "and of the turn about the vertical, rad; since the start"
)
_RATES: Final = (
    "their present rates: velocity against the air, whose norm is the true airspeed, m/s, and yaw rate, rad/s"
)

Four = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleMotion:
    """Motion of one aircraft, in its level frame. Its onboard computer may have another system id."""

    system: Annotated[int, Wire("B", "system id of the tracker, 1 to 255", least=1)]
    number: Annotated[int, Wire("H", "counts the messages, modulo 65536", modulo=True)]
    time_us: Annotated[int, Wire("Q", "microseconds since the tracker's boot")]
    sums: Annotated[Four, Wire("4d", _SUMS, name="way, turn")]
    rates: Annotated[Four, Wire("4f", _RATES, name="velocity, yaw rate")]
    heading_rad: Annotated[float, Wire("f", "magnetic, rad; NaN: not known", nan=True)]
    height_m: Annotated[float, Wire("f", "pressure altitude, m; NaN: not known", name="altitude", nan=True)]


VEHICLE_MOTION: Final = Tunnel(VehicleMotion, VEHICLE_MOTION_PAYLOAD)
motion_message = VEHICLE_MOTION.message
read_motion_payload = VEHICLE_MOTION.read
