"""MAVSDK's asyncio interface: connecting to a vehicle, and waiting on its streams with a deadline."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from enum import Enum
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


def worded(value: Any) -> str:
    """What MAVSDK gave, in words; some of its classes have no text of their own."""
    if isinstance(value, list):
        return f"[{', '.join(map(worded, value))}]"
    if type(value).__module__.startswith("mavsdk.") and not isinstance(value, Exception | Enum):
        fields = ", ".join(f"{name}={worded(each)}" for name, each in vars(value).items())
        return f"{type(value).__name__}({fields})"
    return str(value)


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
        raise AssertionError(f"{what} was not seen; last: {worded(last)}") from None
    raise AssertionError(f"the stream ended before {what}")
