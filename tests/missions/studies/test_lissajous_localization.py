"""The localisation study: an independent reproduction of Table IV; the same for any number of workers."""

import math

import numpy as np
import pytest

from estimators.lissajous.model import AXIS, Discretisation, axis, correct, course, course_variance, predict
from estimators.target_fusion.transform import INFORMATION, add_information, belief_of, ground_target
from missions.studies import Inline, Pool, Results, read_results, run_study
from missions.studies import lissajous_setting as setting
from missions.studies.lissajous_localization import study
from missions.studies.lissajous_setting import CELLS, PAPER, Equations, block_of
from missions.studies.lissajous_table import cells_of, lines_of
from missions.studies.lissajous_trial import errors_of, sample_run, simulate
from missions.studies.options import LocalizationStudyOptions

RUNS = 50

REPRODUCED = {
    (0.0, 0.5): (2.8076, 0.2555, 0.2555, 0.2555),
    (0.0, 0.75): (1.9788, 0.2253, 0.2253, 0.2253),
    (0.0, 1.4): (1.1570, 0.1996, 0.1996, 0.1996),
    (0.0, 2.3): (1.1659, 0.1954, 0.1954, 0.1954),
    (0.0, 3.0): (1.1299, 0.1953, 0.1953, 0.1953),
    (0.001, 0.5): (1.2971, 5.4448, 0.7338, 0.6963),
    (0.001, 0.75): (1.2253, 4.9462, 0.6657, 0.6246),
    (0.001, 1.4): (1.1697, 4.1058, 0.5834, 0.5448),
    (0.001, 2.3): (1.1556, 3.5180, 0.5170, 0.4692),
    (0.001, 3.0): (1.1438, 3.2262, 0.4938, 0.4419),
    (0.01, 0.5): (1.2450, 17.0919, 0.7896, 0.5991),
    (0.01, 0.75): (1.2026, 16.1915, 0.7701, 0.5529),
    (0.01, 1.4): (1.1850, 14.6819, 0.7494, 0.5386),
    (0.01, 2.3): (1.1786, 12.5245, 0.7013, 0.5122),
    (0.01, 3.0): (1.1700, 12.2498, 0.6881, 0.4935),
    (0.1, 0.5): (1.2319, 50.8553, 1.6335, 0.5845),
    (0.1, 0.75): (1.2068, 45.4864, 1.6013, 0.5749),
    (0.1, 1.4): (1.1996, 43.7521, 1.5951, 0.5744),
    (0.1, 2.3): (1.2034, 42.4782, 1.5860, 0.5918),
    (0.1, 3.0): (1.1917, 42.0603, 1.5722, 0.5810),
}
"""N, K, P with the sign of 25a as printed, and P corrected: another program's medians of 1000 runs."""

AS_PRINTED = {
    (0.0, 1.4): (1.0775, 0.1943, 0.1943),
    (0.001, 0.5): (1.2187, 6.2843, 0.6593),
    (0.001, 3.0): (0.9810, 35.4723, 1.6152),
    (0.1, 2.3): (1.0224, 89.7554, 2.9983),
    (0.1, 3.0): (0.9821, 331.5298, 11.9999),
}
"""The same with equation 17 as printed, in truth and filter."""


def localized(folder, *, runs, equations="both", engine=None, seed=0, **options) -> Results:
    given = {"runs": runs, "seed": seed, "engine": engine or Inline(), "picture": False}
    return run_study(
        study(LocalizationStudyOptions(equations=equations)), out=folder / "study", **given, **options
    ).results


@pytest.fixture(scope="module")
def localization(tmp_path_factory):
    return localized(tmp_path_factory.mktemp("localization"), runs=RUNS)


@pytest.fixture(scope="module")
def cells(localization):
    return {(cell["epsilon"], cell["delta"]): cell for cell in cells_of(localization)}


@pytest.mark.slow
def test_there_are_twenty_cells_beside_the_papers(cells) -> None:
    assert len(cells) == 20
    for key, cell in cells.items():
        assert cell["paper_n_rmse"] == PAPER[key].n_rmse
        assert cell["paper_k_rmse"] == PAPER[key].k_rmse
        assert cell["paper_p_rmse"] == PAPER[key].p_rmse
        assert cell["runs"] == RUNS
        assert {"n_rmse", "k_rmse", "p_rmse", "wins"} <= cell.keys()


@pytest.mark.parametrize("cell", CELLS)
def test_medians_are_those_of_an_independent_program(cells, cell: tuple[float, float]) -> None:
    """Within five standard errors of ours and theirs."""
    found = cells[cell]
    expected = dict(zip(("n", "k", "sign_as_printed_p", "p"), REPRODUCED[cell], strict=True))
    if cell in AS_PRINTED:
        expected |= dict(zip(("as_printed_n", "as_printed_k", "as_printed_p"), AS_PRINTED[cell], strict=True))
    for key, median in expected.items():
        error = found[f"{key}_error"] * math.sqrt(1.0 + RUNS / 1000.0)
        assert abs(found[f"{key}_rmse"] - median) < 5.0 * error + 0.01 * median, key


def test_corrected_p_is_no_worse_than_the_papers_and_wins_where_it_lost(cells) -> None:
    for (epsilon, _), cell in cells.items():
        allowed = 1.05 + 3.0 * cell["p_error"] / cell["p_rmse"]
        assert cell["p_rmse"] <= allowed * cell["paper_p_rmse"]
        if epsilon == 0.1:
            assert cell["p_rmse"] <= allowed * cell["paper_p_rmse"] / 3.0
            assert cell["wins"] >= 95.0
            assert cell["paper_wins"] < 30.0


def test_frequencies_as_states_cost_nothing_and_hold_the_error_of_known_ones(cells) -> None:
    """What the paper leaves to future work: the error of epsilon 0 at every epsilon."""
    for (epsilon, delta), cell in cells.items():
        assert cell["f_rmse"] < 1.25 * cells[0.0, delta]["k_rmse"]
        if epsilon:
            assert cell["f_rmse"] < 0.55 * cell["p_rmse"]


def test_without_uncertainty_k_p_and_f_are_one_filter(cells) -> None:
    for delta in setting.DELTAS:
        cell = cells[0.0, delta]
        assert cell["k_rmse"] == cell["p_rmse"] == cell["sign_as_printed_p_rmse"]
        assert cell["f_rmse"] == pytest.approx(cell["k_rmse"], rel=1e-6)
        assert cell["k_wins"] == cell["wins"]


@pytest.mark.slow
def test_workers_and_runs_change_no_run(tmp_path) -> None:
    corrected = Equations.CORRECTED
    alone = errors_of(localized(tmp_path / "alone", runs=3, equations="corrected"))[corrected]
    shared = errors_of(localized(tmp_path / "shared", runs=52, equations="corrected", engine=Pool(2)))[
        corrected
    ]
    assert np.array_equal(alone, shared[:, :3])
    other = errors_of(localized(tmp_path / "other", runs=3, equations="corrected", seed=1))[corrected]
    assert not np.any(other == alone)


def test_equations_that_are_not_requested_change_no_run(localization, tmp_path) -> None:
    alone = localized(tmp_path, runs=2, equations="printed")
    for equations, errors in errors_of(alone).items():
        assert np.array_equal(errors, errors_of(localization)[equations][:, :2])
    (cell, *_) = cells_of(alone)
    assert "p_rmse" in cell and "f_rmse" not in cell


def test_an_interruption_keeps_what_is_there(tmp_path) -> None:
    def interrupt(progress) -> None:
        if progress.done >= progress.trials // 2:
            raise KeyboardInterrupt

    results = localized(tmp_path, runs=2, equations="corrected", on_progress=interrupt)
    assert not results.complete and results.table.num_rows == 20
    cells = cells_of(results)
    assert [cell["runs"] for cell in cells] == [1.0] * 20
    assert len(lines_of(results)) == 2 + 20 + 2
    assert read_results(tmp_path / "study").table.equals(results.table)


def test_a_run_is_the_equations_one_after_the_other() -> None:
    """The study's P, step by step in plain Python on the same random numbers: the same error."""
    cell, run = CELLS.index((0.01, 1.4)), 5
    block = block_of(Equations.CORRECTED)
    epsilon, delta = CELLS[cell]
    nominal, variance = setting.nominal_omega(delta), setting.frequency_variance(epsilon, delta)
    draw = np.random.Generator(np.random.PCG64(np.random.SeedSequence(0, spawn_key=(cell, run))))
    omega = nominal + np.sqrt(variance) * draw.standard_normal((2, 2))
    roots = [np.linalg.cholesky(m) for m in (setting.START_COVARIANCE, setting.PROCESS, setting.SENSOR)]
    truth = setting.START + np.einsum("dij,dj->di", roots[0], draw.standard_normal((2, 4)))
    normals = draw.standard_normal((setting.STEPS, 2, 10))
    target, sight_root = setting.target_places(), np.linalg.cholesky(setting.SIGHT)
    states, spreads = setting.START.copy(), setting.START_COVARIANCE.copy()
    total, belief, dt = 0.0, np.zeros(5), setting.DT
    for k in range(setting.STEPS):
        information = np.zeros(INFORMATION)
        for d in range(2):
            matrix = np.eye(4)
            axes = np.zeros((2, AXIS))
            for i in range(2):
                w = omega[d, i]
                corner = 1.0 - 0.5 * (dt * w) ** 2
                matrix[2 * i : 2 * i + 2, 2 * i : 2 * i + 2] = [[corner, dt], [-dt * w**2, corner]]
                axis(int(Discretisation.SERIES), nominal[d, i], dt, axes[i])
            truth[d] = matrix @ truth[d] + roots[1][d] @ normals[k, d, :4]
            measured = truth[d] + roots[2][d] @ normals[k, d, 4:8]
            heading = math.atan2(truth[d, 3], truth[d, 1])
            c, s = math.cos(heading), math.sin(heading)
            seen = np.array([[c, s], [-s, c]]) @ (target[k] - truth[d, [0, 2]])
            seen = seen + sight_root[d] @ normals[k, d, 8:]
            predict(states[d], spreads[d], axes, setting.PROCESS[d], np.diag(variance[d]), np.zeros((2, 2)))
            correct(states[d], spreads[d], measured, setting.SENSOR[d], np.zeros((4, 12)))
            p = spreads[d]
            ground_target(  # type: ignore[call-arg]
                *states[d, [0, 2]],
                *(p[0, 0], p[0, 2], p[2, 2]),
                course(states[d]),
                course_variance(states[d], p),
                seen,
                setting.SIGHT[d],
                belief,
            )
            add_information(belief, information)
        belief_of(information, belief)
        total += math.sqrt(0.5 * float(np.sum((belief[:2] - target[k]) ** 2)))
    assert simulate(block, cell, 0, run)[2] == pytest.approx(total / setting.STEPS, rel=1e-9)


def test_the_sample_run_has_what_the_figures_show() -> None:
    sample = sample_run()
    off = np.sqrt(0.5 * np.sum((sample.estimates - sample.target[:, None]) ** 2, axis=2)).mean(axis=0)
    assert off == pytest.approx(sample.errors)
    assert sample.errors[3] < sample.errors[2] < sample.errors[0] < sample.errors[1]
    assert np.abs(sample.first_drone[:, 2] - sample.drones[:, 0, [0, 2]]).mean() < 1.0
