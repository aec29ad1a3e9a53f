"""Runs coroutines concurrently on vehicle time, and to their end."""

import asyncio
from collections.abc import Coroutine, Iterable
from typing import Any

from autopilot_bridge.errors import BridgeError
from missions.errors import MissionError, PlanError


async def run_concurrently(coroutines: Iterable[Coroutine[Any, Any, None]]) -> None:
    """Run all coroutines. The first failure cancels the others and is raised.

    Other failures that happen before all have ended are added to the raised error as notes (PEP 678).

    Raises:
        MissionError, PlanError, BridgeError: the first failure.
    """
    try:
        async with asyncio.TaskGroup() as group:
            for coroutine in coroutines:
                group.create_task(coroutine)
    except* (MissionError, PlanError, BridgeError) as errors:
        first, *others = _single(errors)
        for text in dict.fromkeys(map(str, others)):
            if text != str(first):
                first.add_note(f"also failed: {text}")
        raise first from None


async def run_to_end(coroutine: Coroutine[Any, Any, None]) -> None:
    """Run a coroutine to its end, also when the present task is cancelled meanwhile: by a signal, or by the
    failure of another vehicle. That is raised afterwards.

    Raises:
        CancelledError: the present task was cancelled.
    """
    task = asyncio.ensure_future(coroutine)
    cancelled: asyncio.CancelledError | None = None
    while not task.done():
        try:
            await asyncio.shield(task)
        except asyncio.CancelledError as error:
            cancelled = error
    if cancelled is not None:
        raise cancelled


def _single(error: BaseException) -> list[BaseException]:
    """The single errors in a group and in the groups inside it."""
    if isinstance(error, BaseExceptionGroup):
        return [single for part in error.exceptions for single in _single(part)]
    return [error]
