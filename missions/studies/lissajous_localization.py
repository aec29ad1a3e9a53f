"""The Monte Carlo study `lissajous-localization`: two drones on Lissajous paths localise a target (Table IV).

Every run has its own random stream, named by seed, cell and run, so its result does not depend on the number
of workers or runs. All estimators of a run process the same flight.
"""

from collections.abc import Callable, Sequence
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

from estimators.lissajous.model import Discretisation
from missions.studies import lissajous_setting as setting
from missions.studies.lissajous_run import NORMALS, run_once
from missions.studies.lissajous_setting import CELLS, DT, STEPS, Block, Column, Equations, block_of
from missions.studies.pool import work_through

Array = NDArray[np.float64]

MAX_RUNS: Final = 1_000_000
_CHUNK: Final = 50
_DRONES: Final = len(setting.START)
_NO_TRACE: Final = np.zeros((0, 0, 4))

_ROOTS: Final = tuple(
    np.ascontiguousarray(np.linalg.cholesky(m))
    for m in (setting.START_COVARIANCE, setting.PROCESS, setting.SENSOR, setting.SIGHT)
)
_TARGET: Final = setting.target_places()


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyRequest:
    """The request of a study.

    Attributes:
        runs: number of runs per cell.
        seed: the same seed gives the same table.
        workers: number of processes; 1: this process.
        equations: readings of the equations to compute.
    """

    runs: int = 1000
    seed: int = 0
    workers: int = 1
    equations: tuple[Equations, ...] = tuple(Equations)

    def __post_init__(self) -> None:
        if not 1 <= self.runs <= MAX_RUNS:
            raise ValueError(f"{self.runs} runs are not possible; 1 to {MAX_RUNS} are")
        if self.seed < 0:
            raise ValueError(f"seed {self.seed} is below 0")
        if self.workers < 1:
            raise ValueError(f"{self.workers} workers are not possible; 1 or more are")
        if not self.equations:
            raise ValueError(f"no equations are named; there are {', '.join(Equations)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyResult:
    """Errors of all runs.

    Attributes:
        request: the request of the study.
        complete: whether all runs were done.
        failure: reason why runs are missing; "" if none are missing or the user interrupted the study.
        errors: errors by equations: (cells, runs, estimators), in the order of `CELLS` and of the block's
            columns; NaN: the run was not done.
    """

    request: StudyRequest
    complete: bool
    failure: str = ""
    errors: dict[Equations, Array] = field(repr=False)


@dataclass(frozen=True, slots=True)
class _Task:
    cell: int
    first: int
    last: int
    seed: int
    equations: tuple[Equations, ...]


def run_study(request: StudyRequest, on_progress: Callable[[float], None] | None = None) -> StudyResult:
    """Compute all cells.

    Args:
        request: request of the study.
        on_progress: called with the finished share.

    After an interruption (Ctrl-C) or a killed worker the finished runs are returned, marked incomplete.
    """
    chunks = [(first, min(first + _CHUNK, request.runs)) for first in range(0, request.runs, _CHUNK)]
    tasks = [
        _Task(cell, first, last, request.seed, request.equations)
        # all cells in parallel, so that the results are useful after an interruption
        for first, last in chunks
        for cell in range(len(CELLS))
    ]
    errors = {
        equations: np.full((len(CELLS), request.runs, len(block_of(equations).columns)), np.nan)
        for equations in request.equations
    }
    done = 0
    complete, failure = False, ""
    try:
        for task, found in work_through(_work, tasks, request.workers):
            for equations, values in zip(request.equations, found, strict=True):
                errors[equations][task.cell, task.first : task.last] = values
            done += 1
            if on_progress is not None:
                on_progress(done / len(tasks))
        complete = True
    except KeyboardInterrupt:
        pass
    except BrokenProcessPool:
        failure = "a worker process was killed; is there memory for so many (`workers`)?"
    return StudyResult(request=request, complete=complete, failure=failure, errors=errors)


def compile_study() -> None:
    """Compile or load the kernels, so that they are ready for the workers."""
    simulate(block_of(Equations.CORRECTED), 0, 0, 0, steps=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleRun:
    """One run with the data of figures 6 and 7.

    Attributes:
        block: the estimators of the run.
        target: (steps, 2), true positions.
        drones: (steps, drones, 4), true states.
        first_drone: (steps, estimators, 2), estimated positions of the first drone.
        estimates: (steps, estimators, 2), estimated positions of the target.
        errors: (estimators,) error of each.
    """

    block: Block
    target: Array
    drones: Array
    first_drone: Array
    estimates: Array
    errors: Array


def sample_run(seed: int = 0, run: int = 0) -> SampleRun:
    """One run of the cell that figures 6 and 7 of the paper show, with the corrected equations."""
    block = block_of(Equations.CORRECTED)
    trace: Array = np.zeros((STEPS, _DRONES + len(block.columns), 4))
    errors = simulate(block, CELLS.index(setting.SAMPLE_CELL), seed, run, trace=trace)
    return SampleRun(
        block=block,
        target=_TARGET,
        drones=trace[:, :_DRONES],
        first_drone=trace[:, _DRONES:, :2],
        estimates=trace[:, _DRONES:, 2:],
        errors=errors,
    )


def simulate(
    block: Block, cell: int, seed: int, run: int, *, steps: int = STEPS, trace: Array = _NO_TRACE
) -> Array:
    """Errors (estimators,) of one run of a cell."""
    epsilon, delta = CELLS[cell]
    nominal = setting.nominal_omega(delta)
    variance = setting.frequency_variance(epsilon, delta)
    start_root, process_root, sensor_root, sight_root = _ROOTS
    draw = np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=(cell, run))))
    omega = nominal + np.sqrt(variance) * draw.standard_normal((_DRONES, 2))
    start = setting.START + np.einsum("dij,dj->di", start_root, draw.standard_normal((_DRONES, 4)))
    normals = draw.standard_normal((steps, _DRONES, NORMALS))
    errors: Array = np.zeros(len(block.columns))
    run_once(
        DT,
        int(block.truth),
        omega,
        start,
        nominal,
        setting.START,
        setting.START_COVARIANCE,
        variance,
        setting.PROCESS,
        process_root,
        setting.SENSOR,
        sensor_root,
        setting.SIGHT,
        sight_root,
        _TARGET,
        np.array([column.kind for column in block.columns]),
        np.array([int(column.form) for column in block.columns]),
        np.array([float(column.with_frequency) for column in block.columns]),
        normals,
        errors,
        trace,
    )
    return errors


def _work(task: _Task) -> Sequence[Array]:
    """Errors (runs, estimators) of some runs of a cell, for each of the readings of the equations."""
    blocks = [block_of(equations) for equations in task.equations]
    found: dict[tuple[Discretisation, Column], list[float]] = {}
    for truth in dict.fromkeys(block.truth for block in blocks):
        columns = dict.fromkeys(
            column for block in blocks if block.truth is truth for column in block.columns
        )
        shared = Block(equations=task.equations[0], truth=truth, columns=tuple(columns))
        runs = range(task.first, task.last)
        errors = np.array([simulate(shared, task.cell, task.seed, run) for run in runs])
        for index, column in enumerate(columns):
            found[truth, column] = errors[:, index].tolist()
    return [np.array([found[block.truth, column] for column in block.columns]).T for block in blocks]
