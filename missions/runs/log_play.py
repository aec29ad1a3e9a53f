"""Plays a telemetry log to a link, like a connected vehicle."""

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
_MOMENT_US: Final = 20_000
_IDLE_MOMENTS: Final = 10
# of log time; the link is serviced and progress is shown at least this often
_LONGEST_WAIT_US: Final = 200_000


@dataclass(slots=True)
class Played:
    """Progress of the playback.

    Attributes:
        frames: number of frames sent, or dropped by a link whose reader is too slow or disconnected
            (`Link.counters`).
        log_s: seconds of the log played so far, from the first played record.
    """

    frames: int = 0
    log_s: float = 0.0


def play(
    log: Log,
    selections: Sequence[Selection],
    link: Link,
    *,
    speed: float = 1.0,
    loop: bool = False,
    on_progress: Callable[[Played], None] | None = None,
    sign: Callable[[bytes], bytes] | None = None,
) -> Played:
    """Send the frames of a log at their recorded times. Blocks until all are sent; returns the progress.

    Playback begins when there is a receiver: a server (tcpin, udpin) waits for its first client. At infinite
    speed the reader of a stream limits the rate. Received data are read and discarded: a log does not answer
    requests.

    Args:
        log: an open telemetry log.
        selections: what to play, from `Log.select`.
        link: an open link.
        speed: log seconds per wall second, at least 0.1; infinity: as fast as possible.
        loop: begin again at the end, until interrupted.
        on_progress: called a few times a second.
        sign: puts a signature under each frame; None: they are sent as they are in the log.

    Raises:
        LogError: the speed is too small, or nothing is selected.
    """
    if not speed >= MIN_SPEED:
        raise LogError(f"speed {speed:g} is not accepted; give {MIN_SPEED:g} or more, or max")
    order = positions(selections)
    if not len(order):
        raise LogError(f"nothing of {log.path} is selected; choose other messages, sources or conditions")
    played = Played()
    while not link.peers:
        link.receive()
        _wait()
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
                _report_progress(played, now_us, on_progress)
            if pace is None and played.frames % 1000 == 0:
                link.receive()
                _report_progress(played, due_us, on_progress)
            while pace is None and link.congested:
                link.receive()
                _wait()
            link.send(frame if sign is None else sign(frame))
            played.frames += 1
            played.log_s = due_us * 1e-6
        _report_progress(played, round(played.log_s * 1e6), on_progress)
        if not loop:
            _drain(link)
            return played


def _wait() -> None:
    """Wait a short wall time for the link's own work."""
    clock = RealTimeClock()
    clock.wait_until(0)
    clock.wait_until(_MOMENT_US)


def _drain(link: Link) -> None:
    """Let a slow stream transmit the queued data, as long as it makes progress."""
    counters = link.counters
    idle = 0
    while idle < _IDLE_MOMENTS and link.peers:
        before = counters.bytes_out
        link.receive()
        idle = 0 if counters.bytes_out != before else idle + 1
        _wait()


def _report_progress(played: Played, now_us: int, on_progress: Callable[[Played], None] | None) -> None:
    played.log_s = now_us * 1e-6
    if on_progress is not None:
        on_progress(played)
