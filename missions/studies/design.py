"""Designs of studies: which values the parameters have in which trial.

A design has cells and sampled parameters. Cells are the variants that are compared: the combinations of a
grid, or a list. Sampled parameters are drawn once for each run and are the same in all cells of that run
(common random numbers), so that cells can be compared in pairs.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from itertools import product
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from flightsim.foundation.random_streams import RandomStreams
from missions.errors import PlanError

__all__ = ["Design", "Distribution", "Value", "grid", "latin_hypercube", "listed", "random_sample"]

Value = bool | int | float | str
"""A parameter's value."""

Variant = Mapping[str, Value]

MAX_CELLS: Final = 10_000
_KINDS: Final = (bool, int, float, str)


class Distribution(Protocol):
    """A distribution that values are drawn from, such as a frozen one of `scipy.stats`."""

    def ppf(self, probability: NDArray[np.float64], /) -> Any:
        """The quantiles of probabilities in 0..1."""


class Sampling(StrEnum):
    """How the sampled parameters are drawn."""

    LATIN_HYPERCUBE = "latin hypercube"
    RANDOM = "random"


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """Cells, and parameters that are drawn for each run. Made by `grid`, `listed`, `latin_hypercube` and
    `random_sample`; `a * b` combines two designs of different parameters.

    Attributes:
        cells: parameter values of each variant; all have the same names.
        sampled: distributions of the drawn parameters: (low, high), drawn uniformly, or an object with `ppf`.
        sampling: how they are drawn.
    """

    cells: tuple[Variant, ...] = field(default_factory=lambda: ({},))
    sampled: Mapping[str, tuple[float, float] | Distribution] = field(default_factory=dict)
    sampling: Sampling = Sampling.LATIN_HYPERCUBE

    def __post_init__(self) -> None:
        if not 1 <= len(self.cells) <= MAX_CELLS:
            raise PlanError(f"a design of {len(self.cells)} cells is not accepted; 1 to {MAX_CELLS} are")
        names = list(self.cells[0])
        for cell in self.cells:
            if list(cell) != names:
                raise PlanError(
                    f"all cells must have the same parameters: {dict(cell)} has not those of "
                    f"{dict(self.cells[0])}"
                )
            for name, value in cell.items():
                if not isinstance(value, _KINDS):
                    raise PlanError(f"{name} = {value!r} is not accepted; numbers, texts, True and False are")
        if len({tuple(cell.items()) for cell in self.cells}) < len(self.cells):
            raise PlanError("two cells of the design have the same values; give each once")
        for name, bounds in self.sampled.items():
            if name in names:
                raise PlanError(f"parameter {name} is in the cells and is sampled; leave one of them out")
            if isinstance(bounds, tuple) and not (
                len(bounds) == 2 and np.isfinite(bounds).all() and bounds[0] < bounds[1]
            ):
                raise PlanError(f"{name} = {bounds} is not a range; give (low, high), or a distribution")

    def __mul__(self, other: "Design") -> "Design":
        """Each cell of this design with each cell of the other, and the sampled parameters of both."""
        double = self.names & other.names
        if double:
            raise PlanError(f"both designs have the parameter {', '.join(sorted(double))}")
        if self.sampled and other.sampled and self.sampling is not other.sampling:
            raise PlanError("both designs sample, in different ways; sample all parameters in one of them")
        cells = tuple({**a, **b} for a, b in product(self.cells, other.cells))
        sampling = self.sampling if self.sampled else other.sampling
        return replace(self, cells=cells, sampled={**self.sampled, **other.sampled}, sampling=sampling)

    @property
    def names(self) -> frozenset[str]:
        """Names of all parameters."""
        return frozenset(self.cells[0]) | frozenset(self.sampled)

    def drawn(self, seed: int, runs: int) -> Mapping[str, NDArray[np.float64]]:
        """Values (runs,) of the sampled parameters.

        Args:
            seed: seed of the study.
            runs: number of runs. A Latin hypercube depends on it. Of a random sample, the first values are
                the same for any number.
        """
        if not self.sampled:
            return {}
        from scipy.stats import qmc

        generator = RandomStreams(seed).generator("study", "sample")
        count = len(self.sampled)
        if self.sampling is Sampling.LATIN_HYPERCUBE:
            unit = qmc.LatinHypercube(count, rng=generator).random(runs)
        else:
            unit = generator.random((runs, count))
        return {
            name: _quantiles(bounds, unit[:, index])
            for index, (name, bounds) in enumerate(self.sampled.items())
        }

    def fingerprint(self) -> str:
        """Text that differs for designs that differ."""
        ranges = [(n, b if isinstance(b, tuple) else _of_distribution(b)) for n, b in self.sampled.items()]
        content = repr(([tuple(cell.items()) for cell in self.cells], ranges, str(self.sampling)))
        return hashlib.blake2b(content.encode(), digest_size=16).hexdigest()


def _quantiles(bounds: tuple[float, float] | Distribution, unit: NDArray[np.float64]) -> NDArray[np.float64]:
    if isinstance(bounds, tuple):
        low, high = bounds
        return np.asarray(low + (high - low) * unit, dtype=np.float64)
    return np.asarray(bounds.ppf(unit), dtype=np.float64)


def _of_distribution(distribution: Distribution) -> tuple[float, ...]:
    """A distribution by its quantiles: objects have no stable text."""
    return tuple(np.asarray(distribution.ppf(np.array([0.03, 0.31, 0.5, 0.77, 0.98]))).tolist())


def grid(**levels: Sequence[Value]) -> Design:
    """All combinations of the values of each parameter; the last one changes fastest.

        grid(wind_m_s=(0.0, 4.0, 8.0), pattern=("L1", "L2"))

    Raises:
        PlanError: a parameter has no values, or the same twice.
    """
    for name, values in levels.items():
        if isinstance(values, str) or not len(values):
            raise PlanError(f"{name} = {values!r} is not a sequence of values; give (a, b, ...)")
    combined = product(*levels.values())
    return Design(cells=tuple(dict(zip(levels, row, strict=True)) for row in combined))


def listed(cells: Sequence[Variant]) -> Design:
    """The cells of a list, each with the values of all parameters.

    Raises:
        PlanError: the list is empty, or the names differ.
    """
    return Design(cells=tuple(dict(cell) for cell in cells))


def latin_hypercube(**bounds: tuple[float, float] | Distribution) -> Design:
    """Parameters that are drawn as a Latin hypercube over the runs (`scipy.stats.qmc`): each of as many equal
    parts of a parameter's distribution as there are runs has one value.

        latin_hypercube(wind_m_s=(0.0, 12.0), mass_kg=scipy.stats.norm(1.5, 0.1))

    Raises:
        PlanError: a range is not (low, high).
    """
    return Design(sampled=bounds, sampling=Sampling.LATIN_HYPERCUBE)


def random_sample(**bounds: tuple[float, float] | Distribution) -> Design:
    """Parameters that are drawn independently for each run; otherwise as `latin_hypercube`."""
    return Design(sampled=bounds, sampling=Sampling.RANDOM)
