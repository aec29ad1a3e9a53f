"""Waiting on MAVSDK's streams, with a deadline."""

import asyncio
from collections.abc import AsyncIterator, Callable
from typing import Any, Final

WALL_DEADLINE_S: Final = 100.0
"""Generous: on a machine with a lot else to do a flight takes many times longer."""


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
