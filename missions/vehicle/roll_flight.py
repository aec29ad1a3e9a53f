"""Flight by streamed roll commands, whether the autopilot holds altitude and airspeed itself or not."""

import asyncio

from missions.vehicle.attitude_pilot import AttitudePilot
from missions.vehicle.firmware import Mode
from missions.vehicle.guided import GuidedSession, SetpointSource
from missions.vehicle.vehicle import Vehicle


async def follow_rolls(
    vehicle: Vehicle, guided: GuidedSession, pilot: AttitudePilot, source: SetpointSource
) -> None:
    """Follow a source of roll commands to its end. An autopilot that holds altitude and airspeed itself
    receives both when it is in guided mode.

    Raises:
        MissionError: the vehicle left the guided mode, or its link was lost.
    """
    following = asyncio.ensure_future(guided.follow(source))
    try:
        if vehicle.firmware.roll_alone:
            await vehicle.link.wait_until(
                lambda: following.done() or vehicle.link.custom_mode == vehicle.firmware.modes[Mode.GUIDED],
                what="guided mode",
                on=("HEARTBEAT",),
                timeout_s=10.0,
            )
            if not following.done():
                await pilot.begin()
        await following
    finally:
        following.cancel()
        await asyncio.gather(following, return_exceptions=True)
