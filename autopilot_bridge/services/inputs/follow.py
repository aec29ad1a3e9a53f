"""The target to follow: FOLLOW_TARGET, and on ArduPilot the GLOBAL_POSITION_INT of another system.

Sources: MAVLink common.xml; PX4 1.16 uses FOLLOW_TARGET. ArduPilot 4.6 (AP_Follow) uses both, once
FOLL_ENABLE is set, of the system FOLL_SYSID or of the first system received.
"""

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from autopilot_bridge.dispatch import receives
from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.components import AUTOPILOT_COMPONENT
from autopilot_bridge.mavlink.wire_units import degrees, metres, velocity_of
from autopilot_bridge.services.channel import Receiver, Source
from autopilot_bridge.services.microservice import Microservice
from autopilot_bridge.services.parts import AutopilotParts

_HAS_POSITION: Final = 1  # of est_capabilities
_HAS_VELOCITY: Final = 2
_MAX_SPEED_M_S: Final = 200.0
_SIGMA_M: Final = 1.0
_FORGET_S: Final = 10.0  # after this time another system may be followed


class FollowService(Microservice):
    """Keeps `surroundings.leader` up to date.

    Args:
        parts: of the autopilot.
        by_position: GLOBAL_POSITION_INT of another system is a target too (ArduPilot).

    Attributes:
        leader_id: id of the followed system; 0: none received.
    """

    def __init__(self, parts: AutopilotParts, *, by_position: bool) -> None:
        self._context = parts.commander.context
        self._system_id = parts.system_id
        self._by_position = by_position
        self.leader_id = 0

    @property
    def receivers(self) -> Mapping[int, Receiver]:
        """FOLLOW_TARGET, and GLOBAL_POSITION_INT where the firmware follows it."""
        taken = dict(super().receivers)
        if not self._by_position:
            del taken[dialect.MAVLINK_MSG_ID_GLOBAL_POSITION_INT]
        return taken

    @receives(dialect.MAVLink_follow_target_message)
    def _on_follow_target(
        self, message: dialect.MAVLink_follow_target_message, source: Source, time_us: int
    ) -> None:
        self._take(message, source, time_us, *_of_follow(message))

    @receives(dialect.MAVLink_global_position_int_message)
    def _on_position(
        self, message: dialect.MAVLink_global_position_int_message, source: Source, time_us: int
    ) -> None:
        if source.component_id == AUTOPILOT_COMPONENT:
            self._take(message, source, time_us, *self._of_position(message))

    def _take(
        self,
        message: dialect.MAVLink_global_position_int_message | dialect.MAVLink_follow_target_message,
        source: Source,
        time_us: int,
        alt_m: float,
        velocity: tuple[float, float, float] | None,
        sigma_m: float,
    ) -> None:
        parameters: Any = getattr(self._context.parameters, "follow", None)
        frame, leader = self._context.frame, self._context.surroundings.leader
        if parameters is None or not parameters.enabled or frame is None:
            return
        if source.system_id == self._system_id:
            return
        if parameters.system_id not in (0, source.system_id):
            return
        if parameters.system_id == 0 and source.system_id != self.leader_id:
            if self.leader_id and leader.age_s(time_us) <= _FORGET_S:
                return
            leader.forget()
        lat_deg, lon_deg = degrees(message.lat), degrees(message.lon)
        if not (math.isfinite(alt_m) and abs(alt_m) < 1e5 and abs(lat_deg) <= 90.0 and abs(lon_deg) <= 180.0):
            return
        if lat_deg == 0.0 and lon_deg == 0.0:
            return
        self.leader_id = source.system_id
        place = np.array(frame.ned_from_geodetic(lat_deg, lon_deg, alt_m))
        if float(np.abs(place).max()) < 1e6:
            leader.take(time_us, place, None if velocity is None else np.array(velocity), sigma_m=sigma_m)

    def _of_position(
        self, message: dialect.MAVLink_global_position_int_message
    ) -> tuple[float, tuple[float, float, float] | None, float]:
        """(altitude over mean sea level, velocity, 1-sigma) of a GLOBAL_POSITION_INT."""
        context = self._context
        alt_m = metres(message.alt)
        parameters: Any = getattr(context.parameters, "follow", None)
        home_down_m = float(context.home_ned_m[2])
        if parameters is not None and parameters.relative_altitude and context.frame is not None:
            over_home_m = metres(message.relative_alt)
            alt_m = context.frame.origin.alt_m - (home_down_m if math.isfinite(home_down_m) else 0.0)
            alt_m += over_home_m
        return alt_m, velocity_of(message), _SIGMA_M


def _of_follow(
    message: dialect.MAVLink_follow_target_message,
) -> tuple[float, tuple[float, float, float] | None, float]:
    """(altitude over mean sea level, velocity, 1-sigma) of a FOLLOW_TARGET."""
    capabilities = int(message.est_capabilities)
    north, east, down = (float(part) for part in message.vel)
    has_velocity = capabilities & _HAS_VELOCITY and max(abs(north), abs(east), abs(down)) < _MAX_SPEED_M_S
    velocity = (north, east, down) if has_velocity and not math.isnan(north + east + down) else None
    reported = float(message.position_cov[0])
    sigma_m = min(30.0, max(_SIGMA_M, reported)) if reported > 0.0 else _SIGMA_M
    alt_m = float(message.alt) if capabilities & _HAS_POSITION else math.nan
    return alt_m, velocity, sigma_m
