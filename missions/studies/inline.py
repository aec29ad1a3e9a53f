"""Trials in this process, one after the other."""

import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from types import FrameType

from missions.errors import PlanError
from missions.studies.crew import timed_out
from missions.studies.job import Job
from missions.studies.rows import TrialResult
from missions.studies.trial_runner import TrialRunner

__all__ = ["Inline"]

_AGAIN_S = 1.0


class Inline:
    """The engine that runs trials in this process.

    A time limit is kept by SIGALRM, in the main thread: it interrupts Python code. A trial that does not
    return from compiled code is not interrupted; a pool of one worker terminates it. Windows has no SIGALRM.
    """

    name = "inline"
    workers = 1

    def results(self, job: Job, indices: Sequence[int]) -> Iterator[TrialResult | None]:
        """Run trials in their order.

        Raises:
            PlanError: a time limit, on Windows.
        """
        if sys.platform == "win32" and job.time_limit_s is not None:
            raise PlanError(
                f"`time_limit_s` {job.time_limit_s:g} is not possible in this process on Windows; "
                "a `Pool` of one worker keeps it"
            )
        runner = TrialRunner(job.trials, job.keep_logs)
        try:
            for index in indices:
                if job.time_limit_s is None:
                    yield runner.run(index)
                else:
                    yield _limited(runner, index, job.time_limit_s)
        finally:
            runner.close()


class _TimeUp(KeyboardInterrupt):
    """The time limit of a trial; a KeyboardInterrupt, so that event loops and flights end for it."""


def _limited(runner: TrialRunner, index: int, limit_s: float) -> TrialResult:
    if sys.platform == "win32" or threading.current_thread() is not threading.main_thread():
        return runner.run(index)
    up = False

    def on_alarm(number: int, frame: FrameType | None) -> None:
        nonlocal up
        up = True
        raise _TimeUp

    before = signal.signal(signal.SIGALRM, on_alarm)
    try:
        try:
            signal.setitimer(signal.ITIMER_REAL, limit_s, _AGAIN_S)  # again, if the trial's code catches it
            result = runner.run(index)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
    except KeyboardInterrupt:
        if not up:
            raise
        return timed_out(index, limit_s)
    finally:
        signal.signal(signal.SIGALRM, before)
    return timed_out(index, limit_s) if up else result
