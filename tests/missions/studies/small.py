"""Studies whose trials are cheap, for tests of the engines."""

import math
import os
import signal
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from flightsim.foundation.random_streams import RandomStreams
from missions.studies import Study, grid, latin_hypercube, trial_folder


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A row with every kind of column."""

    error_m: float
    count: int
    found: bool
    text: str
    path: tuple[float, ...]
    figures: Mapping[str, float]
    maybe: float | None


def trial(parameters: Mapping[str, Any], seed: int) -> Row:
    """A draw that depends on everything that a trial has; some of kind b fail."""
    draw = RandomStreams(seed).generator("small")
    error_m = parameters["wind_m_s"] + parameters["gust_m_s"] + draw.standard_normal()
    if parameters["kind"] == "b" and seed % 5 == 3:
        raise ValueError(f"no luck with seed {seed}")
    (trial_folder() / "log.txt").write_text(f"{error_m!r}\n")
    return Row(
        error_m=error_m,
        count=int(draw.integers(10)),
        found=bool(error_m < 6.0),
        text=f"{parameters['kind']}{seed}",
        path=tuple(draw.standard_normal(seed % 4)),
        figures={"sine": math.sin(error_m)} | ({"cosine": math.cos(error_m)} if seed % 2 else {}),
        maybe=None if draw.random() < 0.3 else error_m,
    )


STUDY = Study(
    name="small",
    trial=trial,
    row=Row,
    design=grid(wind_m_s=(0.0, 4.0), kind=("a", "b")) * latin_hypercube(gust_m_s=(0.0, 3.0)),
    runs=12,
    success="found",
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble:
    """The trial above, with trouble in some.

    Attributes:
        folder: where it notes which trials it has begun.
        killed: seeds of the trials of kind a and wind 0 whose process is killed when they are begun first.
        always: seeds of those whose process is killed whenever they are begun.
        endless: seeds of those that never end.
    """

    folder: Path
    killed: tuple[int, ...] = ()
    always: tuple[int, ...] = ()
    endless: tuple[int, ...] = ()

    def __call__(self, parameters: Mapping[str, Any], seed: int) -> Row:
        if parameters["kind"] == "a" and parameters["wind_m_s"] == 0.0:
            mark = self.folder / f"begun-{seed}"
            if seed in self.always or (seed in self.killed and not mark.exists()):
                mark.touch()
                os.kill(os.getpid(), signal.SIGKILL)
            while seed in self.endless:
                pass
        return trial(parameters, seed)


def troubled(folder: Path, **trouble: tuple[int, ...]) -> Study[Any, Any]:
    """The study above, with trouble."""
    return replace(STUDY, trial=Trouble(folder=folder, **trouble))


@dataclass(frozen=True, slots=True, kw_only=True)
class NeverDone:
    """A trial that writes the number of its process to the standard output, and does not end."""

    def __call__(self, _parameters: object, _seed: int) -> Row:
        os.write(1, f"{os.getpid()}\n".encode())
        signal.pause()
        raise AssertionError


NEVER_DONE = replace(STUDY, trial=NeverDone())

KILLED_AT = 25


def run_until_killed(out: str) -> None:
    """Run the study in two processes, and be killed after some trials."""
    from missions.studies import Pool, run_study
    from missions.studies.engine import Progress

    def kill(progress: Progress) -> None:
        if progress.done >= KILLED_AT:
            os.kill(os.getpid(), signal.SIGKILL)

    run_study(STUDY, engine=Pool(2), out=out, on_progress=kill)


if __name__ == "__main__":
    from tests.missions.studies import small  # functions are pickled by the name of their module

    small.run_until_killed(sys.argv[1])
