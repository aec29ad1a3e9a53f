"""The trial of the study `lissajous-localization`: one run of a cell by all estimators.

Every run has its own random stream, named by seed, cell and run, so its result does not depend on the number
of workers or runs. All estimators of a run process the same flight.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from types import MappingProxyType
from typing import Final

import numpy as np
from numpy.typing import NDArray

from missions.studies import lissajous_setting as setting
from missions.studies.lissajous_run import NORMALS, run_once
from missions.studies.lissajous_setting import CELLS, DT, READINGS, STEPS, Block, Column, Equations, block_of
from missions.studies.results import Results
from missions.studies.study import run_of

Array = NDArray[np.float64]

_DRONES: Final = len(setting.START)
_NO_TRACE: Final = np.zeros((0, 0, 4))

_ROOTS: Final = tuple(
    np.ascontiguousarray(np.linalg.cholesky(m))
    for m in (setting.START_COVARIANCE, setting.PROCESS, setting.SENSOR, setting.SIGHT)
)
_TARGET: Final = setting.target_places()


@dataclass(frozen=True, slots=True, kw_only=True)
class LissajousCell:
    """Parameters of a trial: epsilon and delta of the paper's Table II."""

    epsilon: float
    delta: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Errors of the estimators in one run: the mean over time of sqrt((ex^2 + ey^2) / 2).

    Attributes:
        n, k, p, f: unfiltered, Kalman filter, the paper's, and frequencies as states, by the corrected
            equations.
        sign_p: the paper's with the sign of 25a as printed.
        printed_n, printed_k, printed_p: with 17 and 25a as printed.

    None: these equations were not requested.
    """

    n: float | None = None
    k: float | None = None
    p: float | None = None
    f: float | None = None
    sign_p: float | None = None
    printed_n: float | None = None
    printed_k: float | None = None
    printed_p: float | None = None


_FIELDS: Final[Mapping[Equations, tuple[str, ...]]] = MappingProxyType(
    {
        Equations.CORRECTED: ("n", "k", "p", "f"),
        Equations.SIGN_AS_PRINTED: ("n", "k", "sign_p"),
        Equations.AS_PRINTED: ("printed_n", "printed_k", "printed_p"),
    }
)
"""Fields of the row by the columns of each block."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalizationTrial:
    """One run of a cell by some readings of the equations.

    Attributes:
        equations: the readings.
    """

    equations: tuple[Equations, ...]

    def __call__(self, cell: LissajousCell, seed: int) -> Errors:
        """Errors of all estimators. Those that share a truth process the same flight."""
        study_seed, run = run_of(seed)
        index = CELLS.index((cell.epsilon, cell.delta))
        blocks = {equations: block_of(equations) for equations in self.equations}
        found: dict[str, float] = {}
        for truth in dict.fromkeys(block.truth for block in blocks.values()):
            columns: dict[Column, str] = {}
            for equations, block in blocks.items():
                if block.truth is truth:
                    columns |= dict(zip(block.columns, _FIELDS[equations], strict=True))
            shared = Block(equations=self.equations[0], truth=truth, columns=tuple(columns))
            errors = simulate(shared, index, study_seed, run)
            found |= dict(zip(columns.values(), errors.tolist(), strict=True))
        return Errors(**found)


def errors_of(results: Results) -> dict[Equations, Array]:
    """Errors by equations: (cells, runs, estimators), in the order of `CELLS` and of the block's columns;
    NaN: the run was not done.
    """
    values = {f.name: results.values(f.name) for f in fields(Errors)}
    readings = READINGS[str(results.options["equations"])]
    return {
        equations: np.stack([values[name] for name in _FIELDS[equations]], axis=-1) for equations in readings
    }


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
