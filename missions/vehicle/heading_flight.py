"""Flight of headings: by commands if the autopilot supports them (ArduPilot), otherwise by a stream of rolls
(PX4).
"""

import asyncio
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from autopilot_bridge.mavlink import dialect
from missions.errors import MissionError, PlanError
from missions.vehicle.adapters import Adapter
from missions.vehicle.attitude_pilot import AttitudePilot
from missions.vehicle.commands import VehicleCommands
from missions.vehicle.firmware import Mode
from missions.vehicle.guided import guided_session
from missions.vehicle.parameters import VehicleParameters
from missions.vehicle.piloting import HeadingController, heading_deg
from missions.vehicle.setpoint import AttitudeSetpoint
from missions.vehicle.telemetry import Attitude

_RATE_HZ: Final = 25.0
_HEADING: Final = 1.0  # GUIDED_CHANGE_HEADING: heading of the vehicle, not course over ground
_TURN_M_S2: Final = 5.0
_SETTLED_RAD: Final = math.radians(5.0)


class HeadingFlight:
    """An aircraft that flies headings; see `FixedWing.heading_flight`.

    Attributes:
        heading_rad: the last commanded heading.
    """

    def __init__(
        self, commands: VehicleCommands, adapter: Adapter, pilot: AttitudePilot, controller: HeadingController
    ) -> None:
        self.heading_rad = math.nan
        self._commands = commands
        self._link = commands.link
        self._adapter = adapter
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
        self.heading_rad = math.remainder(heading_rad, math.tau)
        if self._link.firmware.roll_alone:
            await self._commands.command_int(
                dialect.MAV_CMD_GUIDED_CHANGE_HEADING,
                dialect.MAV_FRAME_GLOBAL,
                (_HEADING, heading_deg(self.heading_rad), _TURN_M_S2, 0.0),
                0,
                0,
                0.0,
            )
        if wait:
            await self._link.wait_until(
                self._settled,
                what=f"heading {math.degrees(self.heading_rad):.0f} deg",
                on=("ATTITUDE",),
                timeout_s=timeout_s,
            )

    def _settled(self) -> bool:
        attitude = self._link.latest(Attitude)
        return (
            attitude is not None
            and abs(math.remainder(attitude.yaw_rad - self.heading_rad, math.tau)) < _SETTLED_RAD
        )

    async def change_altitude(self, altitude_m: float) -> None:
        """Change the height above home; refused below home as `Vehicle.change_altitude` is."""
        self._commands.heights.check(altitude_m, "change_altitude")
        if self._link.firmware.roll_alone:
            await self._adapter.change_altitude(altitude_m)
        self._pilot.hold(altitude_m=altitude_m)

    async def change_airspeed(self, airspeed_m_s: float) -> None:
        """Change the airspeed."""
        if self._link.firmware.roll_alone:
            await self._adapter.change_airspeed(airspeed_m_s)
        self._pilot.hold(airspeed_m_s=airspeed_m_s)

    def setpoint(self, _time_s: float) -> AttitudeSetpoint | None:
        """The setpoint that is streamed to PX4."""
        if self._ended:
            return None
        attitude = self._link.latest(Attitude)
        if attitude is None:
            raise MissionError(f"the vehicle reports no attitude (ATTITUDE); {self._link.last_received()}")
        airspeed = self._pilot.airspeed_true_m_s
        roll = self._controller.roll_rad(
            heading_rad=attitude.yaw_rad,
            wanted_rad=self.heading_rad,
            airspeed_m_s=airspeed if math.isfinite(airspeed) else 15.0,
        )
        return self._pilot.setpoint(self._link.clock.time_us, roll)

    def end(self) -> None:
        """Stop the setpoints."""
        self._ended = True


@asynccontextmanager
async def open_heading_flight(
    commands: VehicleCommands,
    adapter: Adapter,
    parameters: VehicleParameters,
    pilot: AttitudePilot,
    altitude_m: float,
    airspeed_m_s: float | None,
) -> AsyncIterator[HeadingFlight]:
    """Enter the guided mode, keep the present heading, and hold the position at the end."""
    link = commands.link
    guided = link.firmware.modes[Mode.GUIDED]
    limits = await parameters.limits()
    bank_max = min(math.radians(40.0), 0.9 * getattr(limits, "bank_max_rad", math.radians(40.0)))
    await pilot.prepare(altitude_m, airspeed_m_s)
    flight = HeadingFlight(commands, adapter, pilot, HeadingController(bank_max_rad=bank_max))
    attitude = link.latest(Attitude)
    flight.heading_rad = 0.0 if attitude is None else attitude.yaw_rad
    if link.firmware.roll_alone:
        await commands.set_mode(Mode.GUIDED)
        await pilot.begin()
        await flight.turn_to(flight.heading_rad)
        try:
            yield flight
        finally:
            flight.end()
        await commands.set_mode(Mode.HOLD)
        return
    async with guided_session(commands, _RATE_HZ) as session:
        following = asyncio.ensure_future(session.follow(flight.setpoint))
        try:
            await link.wait_until(
                lambda: following.done() or link.custom_mode == guided,
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
