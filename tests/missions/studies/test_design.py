"""Designs: which trial has which values and which seed."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from missions.errors import PlanError
from missions.studies import Design, Study, grid, latin_hypercube, listed, random_sample
from missions.studies.rows import RowSchema
from missions.studies.study import MAX_RUNS, Trials, run_of
from tests.missions.studies.small import STUDY, Row


def test_a_grid_has_all_combinations_the_last_parameter_fastest() -> None:
    cells = grid(a=(1, 2), b=("x", "y", "z")).cells
    assert [tuple(cell.values()) for cell in cells] == [
        (1, "x"), (1, "y"), (1, "z"), (2, "x"), (2, "y"), (2, "z"),
    ]  # fmt: skip


def test_designs_are_combined() -> None:
    design = (
        listed([{"a": 1, "b": 2.0}, {"a": 3, "b": 4.0}]) * grid(c=(True, False)) * latin_hypercube(d=(0, 1))
    )
    assert len(design.cells) == 4 and dict(design.cells[1]) == {"a": 1, "b": 2.0, "c": False}
    assert design.names == {"a", "b", "c", "d"}


def test_a_latin_hypercube_has_one_value_in_each_part_of_each_distribution() -> None:
    """McKay, Beckman and Conover 1979: that is its definition."""
    design = latin_hypercube(wind_m_s=(2.0, 12.0), mass_kg=stats.norm(1.5, 0.1))
    drawn = design.drawn(seed=5, runs=50)
    parts = np.floor(50 * (drawn["wind_m_s"] - 2.0) / 10.0)
    assert sorted(parts) == list(range(50))
    assert sorted(np.floor(50 * stats.norm(1.5, 0.1).cdf(drawn["mass_kg"]))) == list(range(50))
    assert abs(np.corrcoef(drawn["wind_m_s"], drawn["mass_kg"])[0, 1]) < 0.5
    again = design.drawn(seed=6, runs=50)
    assert not np.any(again["wind_m_s"] == drawn["wind_m_s"])


def test_of_a_random_sample_the_first_values_are_the_same_for_any_number() -> None:
    design = random_sample(a=(0.0, 1.0), b=(0.0, 1.0))
    few, many = design.drawn(1, 5), design.drawn(1, 4000)
    assert np.array_equal(few["a"], many["a"][:5]) and np.array_equal(few["b"], many["b"][:5])
    assert stats.kstest(many["b"], "uniform").pvalue > 1e-3


def test_all_cells_of_a_run_have_its_seed_and_its_drawn_values() -> None:
    trials = Trials(STUDY, runs=5, seed=3)
    assert len(trials) == 20
    for run in range(5):
        row = [trials[4 * run + cell] for cell in range(4)]
        assert [trial.cell for trial in row] == [0, 1, 2, 3]
        assert {trial.seed for trial in row} == {3 * MAX_RUNS + run}
        assert len({trial.values["gust_m_s"] for trial in row}) == 1
        assert run_of(row[0].seed) == (3, run)
    with pytest.raises(IndexError, match=r"trial 20 is not in 0\.\.19"):
        trials[20]


def test_studies_with_different_seeds_have_no_seed_in_common() -> None:
    last, first = Trials(STUDY, MAX_RUNS, 0), Trials(STUDY, 1, 1)
    assert last[len(last) - 1].seed < first[0].seed


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (lambda: grid(a="abc"), "a = 'abc' is not a sequence of values"),
        (lambda: grid(a=()), "is not a sequence of values"),
        (lambda: grid(a=(1, 1)), "two cells of the design have the same values"),
        (lambda: grid(a=([1],)), r"a = \[1\] is not accepted; numbers, texts"),
        (lambda: listed([]), "0 cells"),
        (lambda: listed([{"a": 1}, {"b": 1}]), "all cells must have the same parameters"),
        (lambda: latin_hypercube(a=(2.0, 1.0)), "is not a range"),
        (lambda: latin_hypercube(a=(0.0, float("inf"))), "is not a range"),
        (lambda: grid(a=(1,)) * grid(a=(2,)), "both designs have the parameter a"),
        (lambda: grid(a=(1,)) * latin_hypercube(a=(0, 1)), "both designs have the parameter a"),
        (lambda: random_sample(a=(0, 1)) * latin_hypercube(b=(0, 1)), "both designs sample"),
    ],
)
def test_wrong_designs_are_refused(wrong: Any, words: str) -> None:
    with pytest.raises(PlanError, match=words):
        wrong()


@dataclass(frozen=True, slots=True, kw_only=True)
class Wind:
    wind_m_s: float

    def __post_init__(self) -> None:
        if self.wind_m_s < 0.0:
            raise ValueError(f"`wind_m_s` {self.wind_m_s} is below 0")


@dataclass
class Clash:
    wind_m_s: float


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"name": "a b"}, "name 'a b'"),
        ({"runs": 0}, "`runs` 0"),
        ({"row": dict}, "is not a dataclass"),
        ({"row": Clash}, "wind_m_s: a parameter and a field of the row"),
        ({"success": "count"}, "success 'count' is not a field of Row that is True or False"),
        ({"metrics": ("speed",)}, "metrics speed: Row has no such field"),
        ({"baseline": 4}, "baseline 4 is not a cell; there are 4"),
        ({"parameters": Wind}, r"do not make Wind\(wind_m_s\)"),
    ],
)
def test_wrong_studies_are_refused(changes: dict[str, Any], words: str) -> None:
    with pytest.raises(PlanError, match=words):
        replace(STUDY, **changes)


@pytest.mark.parametrize(
    ("runs", "seed", "words"), [(0, 0, "`runs` 0"), (1, -1, "`seed` -1"), (1, 2**60, "`seed`")]
)
def test_wrong_numbers_are_refused(runs: int, seed: int, words: str) -> None:
    with pytest.raises(PlanError, match=words):
        Trials(STUDY, runs, seed)


def test_parameters_may_be_a_dataclass() -> None:
    study = Study(name="wind", trial=lambda p, s: p, row=Wind, design=Design(), parameters=None)
    assert study.schema.kinds == {"wind_m_s": float}
    with pytest.raises(ValueError, match="below 0"):  # checked when the study is made
        replace(study, row=Row, parameters=Wind, design=grid(wind_m_s=(1.0, -1.0)))


def test_what_differs_in_rows_differs_in_the_fingerprint() -> None:
    one = Trials(STUDY, 5, 0).fingerprint()
    others = [
        Trials(STUDY, 6, 0),
        Trials(STUDY, 5, 1),
        Trials(replace(STUDY, options={"a": 1}), 5, 0),
        Trials(replace(STUDY, design=STUDY.design * grid(c=(1,))), 5, 0),
        Trials(replace(STUDY, design=grid(kind=("a",)) * latin_hypercube(gust_m_s=(0.0, 3.1))), 5, 0),
        Trials(replace(STUDY, row=Wind, success="", design=Design()), 5, 0),
    ]
    assert Trials(STUDY, 5, 0).fingerprint() == one
    assert len({one, *(other.fingerprint() for other in others)}) == 7


@dataclass
class Bad:
    place: dict


@dataclass
class Taken:
    seed: int


@pytest.mark.parametrize(
    ("row", "words"), [(Bad, "Bad.place: .* has no column"), (Taken, "Taken.seed: the study has")]
)
def test_rows_without_a_column_are_refused(row: type, words: str) -> None:
    with pytest.raises(PlanError, match=words):
        RowSchema.of(row)


def test_values_of_a_row_are_plain() -> None:
    row = Row(
        error_m=np.float64(1.5), count=np.int64(3), found=np.bool_(True), text="t", path=np.array([1, 2]),
        figures={"a": np.float32(2.0)}, maybe=None,  # type: ignore[dict-item]
    )  # fmt: skip
    values = RowSchema.of(Row).values(row)
    assert values == (1.5, 3, True, "t", [1.0, 2.0], {"a": 2.0}, None)
    assert [type(value) for value in values[:3]] == [float, int, bool]
    with pytest.raises(TypeError, match=r"count = 1.5 is not accepted: int is"):
        RowSchema.of(Row).values(replace(row, count=1.5))
