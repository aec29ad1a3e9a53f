"""Score of how well commanded headings were held, after the turn to each was finished."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.tracking.metrics import rms
from flightsim.foundation.vectors import wrap_pi
from missions.occupancy.pilot import HeadingCommand

Array = NDArray[np.float64]

SETTLING_S: Final = 5.0
TURN_RATE_RAD_S: Final = math.radians(15.0)
SAME_RAD: Final = math.radians(5.0)
"""A command that differs by less from the previous one is not a turn; its whole error counts immediately."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingScore:
    """Heading error: yaw against commanded heading, after each command has settled. NaN when none settled.

    Attributes:
        rms_rad, p95_rad, largest_rad: root mean square, 95th percentile and maximum of the absolute error.
        settled_s: time for which commands were settled.
        commands: number of commands.
    """

    rms_rad: float
    p95_rad: float
    largest_rad: float
    settled_s: float
    commands: int


def settled_errors(
    commands: Sequence[HeadingCommand], time_s: Array, yaw_rad: Array, *, end_s: float
) -> tuple[Array, Array]:
    """Times and errors (n,), rad, of the samples at which the newest command was settled.

    A command is settled 5 s after the time its turn takes at 15 deg/s. Small changes, as when the next cell
    is straight ahead, do not count as a turn.

    Args:
        commands: commands in the order of time.
        time_s, yaw_rad: (m,) measured yaw, in the order of time.
        end_s: end of the search.
    """
    times: list[Array] = []
    errors: list[Array] = []
    settled_from_s = math.inf
    for k, command in enumerate(commands):
        start_s = command.time_us * 1e-6
        stop_s = commands[k + 1].time_us * 1e-6 if k + 1 < len(commands) else end_s
        change_rad = math.pi  # the first command: the initial heading is not known
        if k:
            before_rad = commands[k - 1].heading_rad
            change_rad = abs(math.remainder(command.heading_rad - before_rad, math.tau))
        if change_rad > SAME_RAD:
            turned_s = start_s + SETTLING_S + change_rad / TURN_RATE_RAD_S
            # a turn that is not finished yet continues
            settled_from_s = (
                turned_s if settled_from_s <= start_s or k == 0 else max(settled_from_s, turned_s)
            )
        kept = (time_s >= max(start_s, settled_from_s)) & (time_s < stop_s)
        difference = yaw_rad[kept] - command.heading_rad
        times.append(time_s[kept])
        errors.append(wrap_pi(difference))
    if not times:
        return np.zeros(0), np.zeros(0)
    return np.concatenate(times), np.concatenate(errors)


def heading_score(
    commands: Sequence[HeadingCommand], time_s: Array, yaw_rad: Array, *, end_s: float
) -> HeadingScore:
    """Figures of `settled_errors`."""
    times, errors = settled_errors(commands, time_s, yaw_rad, end_s=end_s)
    if not len(errors):
        return HeadingScore(
            rms_rad=math.nan, p95_rad=math.nan, largest_rad=math.nan, settled_s=0.0, commands=len(commands)
        )
    size = np.abs(errors)
    step_s = float(np.median(np.diff(time_s))) if len(time_s) > 1 else 0.0
    return HeadingScore(
        rms_rad=rms(size),
        p95_rad=float(np.percentile(size, 95.0)),
        largest_rad=float(size.max()),
        settled_s=step_s * len(times),
        commands=len(commands),
    )
