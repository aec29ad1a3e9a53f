"""MAVSDK's asyncio interface: connecting to a vehicle, and waiting on its streams with a deadline."""

import asyncio
import time
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from enum import Enum
from typing import Any, Final, TypeVar

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


T = TypeVar("T")
_STOOD_STILL: Final = ("TIMEOUT", "BUSY", "PROTOCOL_ERROR", "ERROR")
QUIET_S: Final = 5.0
"""PX4 ends an upload that stands still only when its client is silent: a new MISSION_COUNT keeps it open."""


def stood_still(error: Exception, deadline_s: float) -> bool:
    """Whether a transfer of a plan failed as one does that stood still, and may be begun anew.

    A vehicle gives up a transfer after 5 s of its own time. In a fast simulation that is a quarter of a
    second, for which a client on a machine with other work may well have to wait. That ends in a TIMEOUT, or
    in the error that a vehicle answers with to items it no longer waits for.
    """
    return str(error).split(";")[0].strip() in _STOOD_STILL and time.monotonic() < deadline_s


def transfer(ask: Callable[[], T]) -> T:
    """What an upload or a download gives, begun anew when it stood still for too long."""
    from mavsdk.exceptions import MavsdkError

    deadline_s = time.monotonic() + WALL_DEADLINE_S
    while True:
        try:
            return ask()
        except MavsdkError as error:
            if not stood_still(error, deadline_s):
                raise
        time.sleep(QUIET_S)


async def transferred(ask: Callable[[], Awaitable[T]]) -> T:
    """`transfer` by asyncio."""
    from mavsdk.exceptions import MavsdkError

    deadline_s = time.monotonic() + WALL_DEADLINE_S
    while True:
        try:
            return await ask()
        except MavsdkError as error:
            if not stood_still(error, deadline_s):
                raise
        await asyncio.sleep(QUIET_S)


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
