"""Plays a telemetry log to a link, as if the vehicle were there."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from autopilot_bridge.clock import RealTimeClock
from autopilot_bridge.links import Link
from estimators.logs import Log, LogError
from estimators.logs.iterate import Selection
from estimators.logs.raw_records import positions, read_records

MIN_SPEED: Final = 0.1
_LONGEST_WAIT_US: Final = 200_000  # of log time, so that the link is looked after and progress is shown


@dataclass(slots=True)
class Played:
    """How far it is.

    Attributes:
        frames: sent.
        log_s: seconds of the log behind us, since the first record that is played.
        rounds: times that the end was reached.
    """

    frames: int = 0
    log_s: float = 0.0
    rounds: int = 0


def play(
    log: Log,
    selections: Sequence[Selection],
    link: Link,
    *,
    speed: float = 1.0,
    loop: bool = False,
    on_progress: Callable[[Played], None] | None = None,
) -> Played:
    """Send the frames of a log when their time has come; blocks until all are sent.

    What the link brings is read and dropped: a log answers nobody.

    Args:
        log: an open telemetry log.
        selections: what to play, from `Log.select`.
        link: an open link.
        speed: log seconds per wall second, from 0.1; infinity: as fast as possible.
        loop: begin again at the end, until interrupted.
        on_progress: called a few times a second.

    Raises:
        LogError: the speed is too small, or nothing is selected.
    """
    if not speed >= MIN_SPEED:
        raise LogError(f"speed {speed:g} is not accepted; give {MIN_SPEED:g} or more, or max")
    order = positions(selections)
    if not len(order):
        raise LogError(f"nothing of {log.path} is selected; choose other messages, sources or conditions")
    played = Played()
    while True:
        pace = None if math.isinf(speed) else RealTimeClock(speed, max_lag_s=math.inf)
        first_us: int | None = None
        now_us = 0
        for time_us, frame in read_records(log, order):
            first_us = time_us if first_us is None else first_us
            due_us = time_us - first_us
            while pace is not None and now_us < due_us:
                now_us = min(due_us, now_us + _LONGEST_WAIT_US)
                pace.wait_until(now_us)
                link.receive()
                _tell(played, now_us, on_progress)
            if pace is None and played.frames % 1000 == 0:
                link.receive()
            link.send(frame)
            played.frames += 1
            played.log_s = due_us * 1e-6
        played.rounds += 1
        _tell(played, round(played.log_s * 1e6), on_progress)
        if not loop:
            return played


def _tell(played: Played, now_us: int, on_progress: Callable[[Played], None] | None) -> None:
    played.log_s = now_us * 1e-6
    if on_progress is not None:
        on_progress(played)
