"""What an engine is: where the trials of a study are run."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from missions.studies.job import Job
from missions.studies.rows import TrialResult

__all__ = ["Engine", "Progress"]


class Engine(Protocol):
    """Where trials are run: `Inline`, `Pool` or `RayCluster`.

    Attributes:
        name: for the summary.
        workers: number of workers; 0: as many as the cluster has.
    """

    @property
    def name(self) -> str: ...
    @property
    def workers(self) -> int: ...
    def results(self, job: Job, indices: Sequence[int]) -> Iterator[TrialResult | None]:
        """Run trials, and yield each result once, in any order; None: time has passed without one.

        Raises:
            MissionError: the engine can't start, or has ended.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far a study is.

    Attributes:
        trials: number of trials.
        done: number of finished trials, including those of earlier sessions.
        failed: number of trials among them that were not successful.
        rate_hz: trials per second of wall time in this session; 0: not known yet.
    """

    trials: int
    done: int
    failed: int
    rate_hz: float

    @property
    def left_s(self) -> float | None:
        """Estimated time to the end; None: not known yet."""
        return (self.trials - self.done) / self.rate_hz if self.rate_hz > 0.0 else None
