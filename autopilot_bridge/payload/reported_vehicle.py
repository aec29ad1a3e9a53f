"""The payload's knowledge of its vehicle: only the messages that the autopilot has sent on their link."""

import math
from typing import Final

from autopilot_bridge.mavlink import MAVLinkMessage, dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import heading_of, metres, place_of, velocity_of
from flightsim.foundation.geodesy import GeodeticPosition
from flightsim.foundation.vectors import Quaternion, from_euler

Report = (
    dialect.MAVLink_global_position_int_message
    | dialect.MAVLink_attitude_message
    | dialect.MAVLink_system_time_message
    | dialect.MAVLink_heartbeat_message
)
"""The messages that are used."""
STALE_US: Final = 3_000_000


class ReportedVehicle:
    """The newest position, attitude and time of one vehicle.

    Attributes:
        position: from GLOBAL_POSITION_INT; None: never received.
        relative_alt_m: height over home.
        velocity_ned_m_s: over ground.
        heading_rad: heading of the nose from north; NaN: not received.
        q_ned_from_frd: from ATTITUDE; None: never received.
        armed: from its heartbeat.
    """

    def __init__(self, system_id: int) -> None:
        self._system_id = system_id
        self.position: GeodeticPosition | None = None
        self.relative_alt_m = math.nan
        self.velocity_ned_m_s = (0.0, 0.0, 0.0)
        self.heading_rad = math.nan
        self.q_ned_from_frd: Quaternion | None = None
        self.armed = False
        self._position_us = -STALE_US
        self._unix_minus_boot_us: int | None = None

    def handle(self, message: MAVLinkMessage, sender: tuple[int, int], time_us: int) -> bool:
        """Handle a message; True when it brought new data. Contents never raise."""
        if sender != (self._system_id, AUTOPILOT_COMPONENT):
            return False
        match message:
            case dialect.MAVLink_global_position_int_message():
                return self._note_position(message, time_us)
            case dialect.MAVLink_attitude_message():
                if not all(map(math.isfinite, (message.roll, message.pitch, message.yaw))):
                    return False
                self.q_ned_from_frd = from_euler(message.roll, message.pitch, message.yaw)
            case dialect.MAVLink_system_time_message():
                if message.time_unix_usec == 0:
                    return False
                self._unix_minus_boot_us = message.time_unix_usec - time_us
            case dialect.MAVLink_heartbeat_message():
                self.armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
            case _:
                return False
        return True

    def located(self, time_us: int) -> GeodeticPosition | None:
        """The position if it is recent; None: not known."""
        return self.position if time_us - self._position_us < STALE_US else None

    @property
    def home_alt_m(self) -> float:
        """Home's altitude above mean sea level; NaN: not known."""
        return math.nan if self.position is None else self.position.alt_m - self.relative_alt_m

    def unix_us(self, time_us: int) -> int:
        """Unix time, microseconds; 0: not known."""
        return 0 if self._unix_minus_boot_us is None else time_us + self._unix_minus_boot_us

    def _note_position(self, message: dialect.MAVLink_global_position_int_message, time_us: int) -> bool:
        place = place_of(message)
        if place is None or message.lat == 0 == message.lon:
            return False
        self.position = place
        self.relative_alt_m = metres(message.relative_alt)
        self.velocity_ned_m_s = velocity_of(message)
        self.heading_rad = heading_of(message)
        self._position_us = time_us
        return True
