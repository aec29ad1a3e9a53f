"""What `flightsim.foundation.kernels.bound` saves at a call that takes arrays, and in a physics step.

    python -m benchmarks.bound_kernels

The step of the multicopter's controller, with its arrays handed over once (`bound`) and at every call
(`compiled_for`). Processor time of the fastest of nine pieces.
"""

import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from autopilot_bridge.control import controller
from autopilot_bridge.control.multicopter import MulticopterController, setpoint
from autopilot_bridge.navigation import layout as nav
from flightsim.foundation.kernels import bound, compiled_for

CALLS = 100_000
PIECES = 9


def handed_over(function: Callable[..., Any], *arguments: object, then: tuple[object, ...] = ()) -> Any:
    """As `bound`, with the arrays handed over at every call."""
    return partial(compiled_for(function, *arguments, *then), *arguments)


def microseconds(binding: Callable[..., Any]) -> float:
    """Time of one step of the controller."""
    controller.bound = binding  # type: ignore[attr-defined]
    state = np.zeros(nav.NAV_SIZE)
    state[nav.Q] = 1.0
    flying = MulticopterController(physics_rate_hz=250, nav=state)
    flying.setpoint[setpoint.LEVEL] = setpoint.TRAJECTORY
    step = flying.step
    step()
    pieces = []
    for _ in range(PIECES):
        start = time.process_time()
        for _ in range(CALLS):
            step()
        pieces.append(time.process_time() - start)
    return 1e6 * min(pieces) / CALLS


if __name__ == "__main__":
    for name, binding in (("bound", bound), ("compiled_for", handed_over)):
        sys.stdout.write(f"{name:12} {microseconds(binding):.3f} us\n")
