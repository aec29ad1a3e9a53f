"""Flight of a multicopter straight to a point (DO_REPOSITION), watched until it is there."""

import math
from typing import Final

from autopilot_bridge.mavlink import dialect
from autopilot_bridge.mavlink.wire_units import e7
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from missions.errors import MissionError, PlanError
from missions.vehicle.commands import HEARTBEAT_AGE_US, VehicleCommands
from missions.vehicle.telemetry import Position

_FARTHEST_M: Final = 10_000.0  # largest distance from home; farther coordinates are probably a mistake
_SLOW_M_S: Final = 0.7


class PointFlight:
    """One flight to a point; see `Vehicle.goto`.

    Args:
        commands: commands to the vehicle.
        target: the point.
    """

    def __init__(self, commands: VehicleCommands, target: GeodeticPosition) -> None:
        self._commands = commands
        self._link = commands.link
        self._target = target
        self._frame = LocalFrame(target)

    async def fly(self, tolerance_m: float, timeout_s: float | None) -> None:
        """Command the flight, and wait until the vehicle is within the tolerance and slow."""
        link, target, firmware = self._link, self._target, self._link.firmware
        self._check_target()
        await self._commands.command_int(
            dialect.MAV_CMD_DO_REPOSITION,
            dialect.MAV_FRAME_GLOBAL,
            (-1.0, 1.0, 0.0, firmware.unset),
            e7(target.lat_deg),
            e7(target.lon_deg),
            target.alt_m,
        )
        accepted_us = link.clock.time_us

        def there() -> bool:
            if link.heartbeat_us is not None and link.heartbeat_us >= accepted_us + HEARTBEAT_AGE_US:
                self._require_armed()
            p = link.latest(Position)
            return (
                p is not None and self._distance_m() < tolerance_m and math.hypot(*p.vel_ned_m_s) < _SLOW_M_S
            )

        away_m = self._distance_m()
        limit_s = timeout_s or 30.0 + (away_m / 2.0 if math.isfinite(away_m) else 60.0)
        await link.wait_until(
            there,
            what=lambda: f"arrival (still {self._distance_m():.1f} m away)",
            on=("GLOBAL_POSITION_INT", "HEARTBEAT"),
            timeout_s=limit_s,
        )

    def _distance_m(self) -> float:
        """Distance to the target; infinite while no position is known."""
        p = self._link.latest(Position)
        return math.hypot(*self._frame.ned_from_geodetic(p.lat_deg, p.lon_deg, p.alt_m)) if p else math.inf

    def _check_target(self) -> None:
        home, target = self._link.home, self._target
        ned = LocalFrame(home).ned_from_geodetic(target.lat_deg, target.lon_deg, target.alt_m)
        away_m = math.hypot(*ned)
        if not away_m <= _FARTHEST_M:
            raise PlanError(
                f"the target {target} is {away_m * 1e-3:.1f} km from home; accepted: at most "
                f"{_FARTHEST_M * 1e-3:g} km"
            )
        # altitudes are compared, not the frame's down: far away the horizon is below it
        self._commands.heights.check(target.alt_m - home.alt_m, "goto")

    def _require_armed(self) -> None:
        link = self._link
        if link.armed:
            return
        reported = f" ({link.texts.newest[-1].text!r})" if link.texts.newest else ""
        raise MissionError(
            f"the vehicle is disarmed {self._distance_m():.1f} m before the target{reported}; "
            f"{link.last_received()}"
        )
