"""Kernels of the control laws with arrays as navigation state and setpoint, which tests fill by place."""

from collections.abc import Callable
from typing import Any

import numpy as np

from autopilot_bridge.navigation.layout import NAV_SIZE, NavigationState
from flightsim.foundation.records import Record, size_of, the_record, viewed


def on_arrays(setpoint: type[Record], *kernels: Callable[..., Any]) -> tuple[Callable[..., Any], ...]:
    """The kernels, each with arrays in the place of the records of navigation state and setpoint."""
    kinds: dict[int, type[Record]] = {NAV_SIZE: NavigationState, size_of(setpoint): setpoint}

    def record(argument: Any) -> Any:
        plain = isinstance(argument, np.ndarray) and argument.dtype == np.float64
        kind = kinds.get(argument.size) if plain else None
        return argument if kind is None else the_record(viewed(argument, kind), kind)

    def taking(kernel: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *arguments: kernel(*map(record, arguments))

    return tuple(map(taking, kernels))
