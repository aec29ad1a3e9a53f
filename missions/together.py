"""Doing things side by side on vehicle time."""

import asyncio
from collections.abc import Coroutine, Iterable
from typing import Any

from autopilot_bridge.errors import BridgeError
from missions.errors import MissionError, PlanError


async def together(coroutines: Iterable[Coroutine[Any, Any, None]]) -> None:
    """Run them all; the first failure ends the others, and is the one that is told.

    Raises:
        MissionError, PlanError, BridgeError: what the first failure was.
    """
    try:
        async with asyncio.TaskGroup() as group:
            for coroutine in coroutines:
                group.create_task(coroutine)
    except* (MissionError, PlanError, BridgeError) as errors:
        first: BaseException = errors
        while isinstance(first, BaseExceptionGroup):
            first = first.exceptions[0]
        raise first from None
