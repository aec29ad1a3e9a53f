"""The workers of a study in other processes: which trial goes to which, time limits, and workers that are
killed.

One loop serves the process pool and Ray. They differ in how a worker is started and how messages reach it.
"""

from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from autopilot_bridge.clock.pacing import wall_time_s
from missions.errors import MissionError
from missions.studies.job import Job
from missions.studies.rows import TrialOutcome, TrialResult

__all__ = ["Broken", "Crew", "Died", "Event", "Ready", "Worker", "supervise"]

TICK_S: Final = 0.2
MAX_BATCH: Final = 256
_FAILED_STARTS: Final = 3
_MEMORY: Final = 0.9  # share of the past in the running mean of the time of a trial


class Worker(ABC):
    """One worker.

    Attributes:
        ready: it has done its warm-up.
        batch: numbers of the trials that it has received and not answered, the first one first.
        since_s: wall time since when it computes the first one.
    """

    def __init__(self) -> None:
        self.ready = False
        self.batch: deque[int] = deque()
        self.since_s = 0.0

    @abstractmethod
    def send(self, indices: Sequence[int]) -> None:
        """Give it trials to run. An error of the transport is reported as an event later."""

    @abstractmethod
    def kill(self) -> None:
        """Terminate it at once."""


@dataclass(frozen=True, slots=True)
class Ready:
    """The worker has loaded the study."""


@dataclass(frozen=True, slots=True)
class Died:
    """The worker is gone.

    Attributes:
        reason: how it ended, such as "SIGKILL".
    """

    reason: str


@dataclass(frozen=True, slots=True)
class Broken:
    """The worker can't load the study; others can't either.

    Attributes:
        reason: the error.
    """

    reason: str


Event = Ready | Died | Broken | Sequence[TrialResult]


class Crew(ABC):
    """The workers of an engine, and the way to them.

    Attributes:
        batch_s: time that the trials of one batch should take together, so that messages cost little beside
            them.
        whole_batches: a worker answers for a batch as a whole.
    """

    batch_s: float = 0.02
    whole_batches = False

    def __init__(self) -> None:
        self.workers: list[Worker] = []

    @property
    @abstractmethod
    def capacity(self) -> int:
        """How many workers there may be now."""

    @abstractmethod
    def start(self) -> Worker:
        """Start a worker."""

    @abstractmethod
    def events(self, timeout_s: float) -> Iterable[tuple[Worker, Event]]:
        """What the workers have sent. Waits for the first event, at most for the timeout."""

    @abstractmethod
    def close(self, *, at_once: bool) -> None:
        """End all workers.

        Args:
            at_once: without waiting for what they compute.
        """


@dataclass(slots=True)
class _Progress:
    """The trials that have no result yet."""

    job: Job
    waiting: deque[int]
    alone: deque[int] = field(default_factory=deque)
    attempts: dict[int, int] = field(default_factory=dict)
    outstanding: int = 0
    mean_s: float = 0.0
    failed_starts: int = 0

    @property
    def unassigned(self) -> int:
        return len(self.waiting) + len(self.alone)

    def batch_for(self, crew: Crew) -> list[int]:
        """The next trials for a worker without work, or with little."""
        if self.alone:
            return [self.alone.popleft()]
        if not self.waiting:
            return []
        count = 1
        if self.mean_s > 0.0:
            limit_s = self.job.time_limit_s
            most_s = crew.batch_s if limit_s is None else min(crew.batch_s, 0.1 * limit_s)
            fair = len(self.waiting) // (2 * max(1, len(crew.workers)))
            count = max(1, min(MAX_BATCH, int(most_s / self.mean_s), fair))
        return [self.waiting.popleft() for _ in range(min(count, len(self.waiting)))]

    def took(self, time_s: float) -> None:
        first = self.mean_s == 0.0
        self.mean_s = time_s if first else _MEMORY * self.mean_s + (1.0 - _MEMORY) * time_s


def supervise(crew: Crew, job: Job, indices: Sequence[int]) -> Iterator[TrialResult | None]:
    """Run trials, and yield each result once, in any order; None: time has passed without one.

    A worker that is killed is replaced. A trial that it computed alone is begun again, at most
    `job.attempts` times. The trials of a batch are begun again one by one, because it is not known which of
    them ended the worker. The same holds for the time limit.

    Raises:
        MissionError: the workers can't load the study, or are killed before they can.
    """
    state = _Progress(job, deque(indices), outstanding=len(indices))
    finished = False
    try:
        while state.outstanding:
            _staff(crew, state)
            _assign(crew, state)
            any_result = False
            for worker, event in crew.events(TICK_S):
                for result in _handled(crew, state, worker, event):
                    any_result = True
                    state.outstanding -= 1
                    yield result
            for result in _overdue(crew, state):
                any_result = True
                state.outstanding -= 1
                yield result
            if not any_result:
                yield None
        finished = True
    finally:
        crew.close(at_once=not finished)


def _staff(crew: Crew, state: _Progress) -> None:
    """Start workers, as many as there is work for."""
    idle = sum(not worker.batch for worker in crew.workers)
    for _ in range(min(crew.capacity - len(crew.workers), state.unassigned - idle)):
        crew.workers.append(crew.start())


def _assign(crew: Crew, state: _Progress) -> None:
    for worker in crew.workers:
        if not worker.ready or (worker.batch and (crew.whole_batches or state.alone)):
            continue
        batch: list[int] = []
        if not worker.batch or state.mean_s * len(worker.batch) < 0.5 * crew.batch_s:
            batch = state.batch_for(crew)
        if batch:
            if not worker.batch:
                worker.since_s = wall_time_s()
            worker.batch.extend(batch)
            worker.send(batch)


def _handled(crew: Crew, state: _Progress, worker: Worker, event: Event) -> Iterator[TrialResult]:
    match event:
        case Ready():
            worker.ready, state.failed_starts = True, 0
        case Broken(reason):
            raise MissionError(f"study {state.job.study.name} can't start: {reason}")
        case Died(reason):
            crew.workers.remove(worker)
            if not worker.ready:
                state.failed_starts += 1
                if state.failed_starts >= max(_FAILED_STARTS, crew.capacity):
                    raise MissionError(
                        f"the workers end before they begin ({reason}); is there memory for so many?"
                    )
            yield from _lost(state, worker.batch, reason)
        case _:
            for result in event:
                if result.index not in worker.batch:
                    continue  # answered late, after it was given to another worker
                worker.batch.remove(result.index)
                worker.since_s = wall_time_s()
                state.took(result.wall_time_s)
                yield replace(result, attempts=state.attempts.pop(result.index, 0) + 1)


def _lost(state: _Progress, batch: Iterable[int], reason: str) -> Iterator[TrialResult]:
    """The results of trials whose worker was killed; those that are begun again have none yet."""
    lost = list(batch)
    if len(lost) != 1:
        state.alone.extend(lost)
        return
    (index,) = lost
    attempts = state.attempts[index] = state.attempts.get(index, 0) + 1
    if attempts < state.job.attempts:
        state.alone.append(index)
        return
    error = f"its worker process was killed ({reason}) in each of {attempts} attempts"
    yield TrialResult(index=index, outcome=TrialOutcome.LOST, error=error, attempts=attempts)


def _overdue(crew: Crew, state: _Progress) -> Iterator[TrialResult]:
    """Kill workers whose trial has reached the time limit, and yield these trials' results."""
    limit_s = state.job.time_limit_s
    if limit_s is None:
        return
    now_s = wall_time_s()
    for worker in list(crew.workers):
        if not worker.batch or now_s - worker.since_s <= limit_s:
            continue
        worker.kill()
        crew.workers.remove(worker)
        if len(worker.batch) > 1:
            state.alone.extend(worker.batch)
            continue
        (index,) = worker.batch
        yield timed_out(index, limit_s, state.attempts.pop(index, 0) + 1)


def timed_out(index: int, limit_s: float, attempts: int = 1) -> TrialResult:
    """The result of a trial that was terminated at the time limit."""
    return TrialResult(
        index=index,
        outcome=TrialOutcome.TIMED_OUT,
        error=f"it did not end within the time limit of {limit_s:g} s",
        wall_time_s=limit_s,
        attempts=attempts,
    )
