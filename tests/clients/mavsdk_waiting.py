"""MAVSDK's asyncio interface: connecting to a vehicle, and waiting on its streams with a deadline."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any, Final

WALL_DEADLINE_S: Final = 100.0
"""Generous: on a machine with a lot else to do a flight takes many times longer."""


@asynccontextmanager
async def ground_station(url: str) -> AsyncIterator[Any]:
    """The vehicle at the other end of a link, for the plugins of a ground station."""
    from mavsdk.asyncio import ComponentType, Configuration, Mavsdk

    configuration = Configuration.create_with_component_type(ComponentType.GROUND_STATION)
    async with Mavsdk(configuration) as mavsdk:
        await mavsdk.add_any_connection(url)
        system = await mavsdk.first_autopilot(timeout_s=WALL_DEADLINE_S)
        assert system is not None, f"no autopilot on {url}"
        yield system


async def first(
    stream: AsyncIterator[Any], found: Callable[[Any], bool], what: str, wait_s: float = WALL_DEADLINE_S
) -> Any:
    """First element of a telemetry stream that satisfies `found`."""
    last: Any = None
    try:
        async with asyncio.timeout(wait_s):
            async for last in stream:
                if found(last):
                    return last
    except TimeoutError:
        raise AssertionError(f"{what} was not seen; last: {last}") from None
    raise AssertionError(f"the stream ended before {what}")
