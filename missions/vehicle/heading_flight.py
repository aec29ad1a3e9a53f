"""Flight of headings: by commands if the autopilot supports them (ArduPilot), otherwise by a stream of rolls
(PX4).
"""

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Final

from autopilot_bridge.mavlink import dialect
from missions.errors import MissionError, PlanError
from missions.piloting.heading import HeadingController, heading_deg
from missions.vehicle import telemetry
from missions.vehicle.adapter import Mode
from missions.vehicle.attitude_pilot import AttitudePilot
from missions.vehicle.attitude_setpoint import AttitudeSetpoint
from missions.vehicle.guided import GuidedSession

if TYPE_CHECKING:
    from missions.vehicle.vehicle import Vehicle

_RATE_HZ: Final = 25.0
_HEADING: Final = 1.0  # GUIDED_CHANGE_HEADING: heading of the vehicle, not course over ground
_TURN_M_S2: Final = 5.0
_SETTLED_RAD: Final = math.radians(5.0)


class HeadingFlight:
    """An aircraft that flies headings; see `FixedWingFlight.heading_flight`.

    Attributes:
        heading_rad: the last commanded heading.
    """

    def __init__(self, vehicle: "Vehicle", pilot: AttitudePilot, controller: HeadingController) -> None:
        self.heading_rad = math.nan
        self._vehicle = vehicle
        self._pilot = pilot
        self._controller = controller
        self._ended = False

    async def turn_to(self, heading_rad: float, *, wait: bool = False, timeout_s: float = 60.0) -> None:
        """Turn to a heading, the short way round, and hold it.

        Args:
            wait: whether to wait until the yaw is within 5 degrees of it.
        """
        if not math.isfinite(heading_rad):
            raise PlanError(f"a heading of {heading_rad} can't be flown; give an angle")
        vehicle = self._vehicle
        self.heading_rad = math.remainder(heading_rad, math.tau)
        if vehicle.adapter.roll_alone:
            await vehicle.command_int(
                dialect.MAV_CMD_GUIDED_CHANGE_HEADING,
                dialect.MAV_FRAME_GLOBAL,
                (_HEADING, heading_deg(self.heading_rad), _TURN_M_S2, 0.0),
                0,
                0,
                0.0,
            )
        if wait:
            await vehicle.wait_until(
                self._settled,
                what=f"heading {math.degrees(self.heading_rad):.0f} deg",
                on=("ATTITUDE",),
                timeout_s=timeout_s,
            )

    def _settled(self) -> bool:
        attitude = self._vehicle.latest(telemetry.Attitude)
        return (
            attitude is not None
            and abs(math.remainder(attitude.yaw_rad - self.heading_rad, math.tau)) < _SETTLED_RAD
        )

    async def change_altitude(self, altitude_m: float) -> None:
        """Change the height above home."""
        if self._vehicle.adapter.roll_alone:
            await self._vehicle.change_altitude(altitude_m)
        self._pilot.hold(altitude_m=altitude_m)

    async def change_airspeed(self, airspeed_m_s: float) -> None:
        """Change the airspeed."""
        if self._vehicle.adapter.roll_alone:
            await self._vehicle.change_airspeed(airspeed_m_s)
        self._pilot.hold(airspeed_m_s=airspeed_m_s)

    def setpoint(self, _time_s: float) -> AttitudeSetpoint | None:
        """The setpoint that is streamed to PX4."""
        if self._ended:
            return None
        attitude = self._vehicle.latest(telemetry.Attitude)
        if attitude is None:
            raise MissionError(f"the vehicle reports no attitude (ATTITUDE); {self._vehicle.heard()}")
        airspeed = self._pilot.airspeed_true_m_s
        roll = self._controller.roll_rad(
            heading_rad=attitude.yaw_rad,
            wanted_rad=self.heading_rad,
            airspeed_m_s=airspeed if math.isfinite(airspeed) else 15.0,
        )
        return self._pilot.setpoint(self._vehicle.clock.time_us, roll)

    def end(self) -> None:
        """Stop the setpoints."""
        self._ended = True


@asynccontextmanager
async def open_heading_flight(
    vehicle: "Vehicle", altitude_m: float, airspeed_m_s: float | None
) -> AsyncIterator[HeadingFlight]:
    """Enter the guided mode, keep the present heading, and hold the position at the end."""
    pilot = vehicle.pilot
    if pilot is None:
        raise PlanError("call `await vehicle.prepare_piloting()` on the ground, before takeoff")
    limits = await vehicle.limits()
    bank_max = min(math.radians(40.0), 0.9 * getattr(limits, "bank_max_rad", math.radians(40.0)))
    await pilot.prepare(altitude_m, airspeed_m_s)
    flight = HeadingFlight(vehicle, pilot, HeadingController(bank_max_rad=bank_max))
    attitude = vehicle.latest(telemetry.Attitude)
    flight.heading_rad = 0.0 if attitude is None else attitude.yaw_rad
    if vehicle.adapter.roll_alone:
        await vehicle.set_mode(Mode.GUIDED)
        await pilot.begin()
        await flight.turn_to(flight.heading_rad)
        try:
            yield flight
        finally:
            flight.end()
        await vehicle.hold()
        return
    session = GuidedSession(vehicle, _RATE_HZ, (0.0, 0.0, 0.0))
    following = asyncio.ensure_future(session.follow(flight.setpoint))
    try:
        await vehicle.wait_until(
            lambda: following.done() or vehicle.custom_mode == vehicle.adapter.modes[Mode.GUIDED],
            what="guided mode",
            on=("HEARTBEAT",),
            timeout_s=10.0,
        )
        if following.done():
            following.result()
        yield flight
        if following.done():
            following.result()
        await session.finish()
    finally:
        flight.end()
        following.cancel()
        await asyncio.gather(following, return_exceptions=True)
        await session.stop()
