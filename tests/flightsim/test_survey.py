"""Surveys of a true field: the error they leave, and what they say of it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import Akima1DInterpolator

from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    MagneticMap,
    SurveyParameters,
    SyntheticMapParameters,
    surveyed,
    synthetic_map,
    truth_behind,
)
from flightsim.payload.survey import _between

PERFECT = SurveyParameters(
    noise_nt=0.0,
    levelling_nt=0.0,
    diurnal_nt=0.0,
    track_error_m=0.0,
    height_error_m=0.0,
    gradient_error_nt_m=0.0,
)


def field(seed: int = 1) -> MagneticMap:
    return synthetic_map(
        SyntheticMapParameters(
            south_m=-1600.0, north_m=1600.0, west_m=-1600.0, east_m=1600.0, spacing_m=50.0, height_m=80.0
        ),
        home=Home(),
        seed=RandomStreams(seed).child("magnetic_map"),
    )


def error(seed: int, parameters: SurveyParameters) -> tuple[float, float]:
    """(root mean square error, stated error), nT."""
    truth = field(seed)
    published = surveyed(truth, parameters, seed=RandomStreams(seed).child("magnetic_survey"))
    difference = published.total_field_nt - truth.total_field_nt
    return float(np.sqrt(np.mean(difference**2))), published.error_nt or 0.0


def test_between_lines_it_is_akimas_interpolation() -> None:
    lines_m = np.linspace(-500.0, 500.0, 7)
    values = np.random.default_rng(1).normal(size=(3, 7))
    grid_m = np.linspace(-500.0, 500.0, 101)
    expected = Akima1DInterpolator(lines_m, values, axis=1)(grid_m)
    np.testing.assert_allclose(_between(lines_m, values, grid_m), expected, atol=1e-12)


def test_the_map_has_an_error_and_the_survey_states_no_less() -> None:
    """Tie lines have errors of their own, so what they differ by is up to twice the map's error."""
    true_nt, stated_nt = np.array([error(seed, SurveyParameters()) for seed in range(8)]).T
    assert np.all((true_nt > 0.5) & (true_nt < 1.2))
    assert 1.0 < stated_nt.mean() / true_nt.mean() < 2.0
    assert np.all(stated_nt > 0.9 * true_nt)


def test_what_lies_between_the_lines_is_not_on_the_map() -> None:
    """Without any error of a reading, the error is that of the interpolation, and lines themselves are
    right.
    """
    truth = field()
    errors = {}
    for spacing_m in (100.0, 200.0, 400.0):
        parameters = replace(PERFECT, line_spacing_m=spacing_m)
        published = surveyed(truth, parameters, seed=np.random.SeedSequence(1))
        difference = published.total_field_nt - truth.total_field_nt
        np.testing.assert_allclose(difference[:, :: round(spacing_m / 50.0)], 0.0, atol=1e-6)
        errors[spacing_m] = float(np.sqrt(np.mean(difference**2)))
        assert published.line_spacing_m == pytest.approx(spacing_m)
    assert errors[100.0] < 0.3 * errors[200.0] < 0.3 * errors[400.0]
    assert errors[400.0] > 0.4


def test_errors_of_lines_are_stripes() -> None:
    truth = field()
    parameters = replace(PERFECT, levelling_nt=2.0)
    published = surveyed(truth, parameters, seed=np.random.SeedSequence(3))
    plain = surveyed(truth, PERFECT, seed=np.random.SeedSequence(3))
    stripes = published.total_field_nt - plain.total_field_nt
    on_lines = stripes[:, ::4]
    assert on_lines.std(axis=0).max() < 1e-6  # one level along each line
    assert 1.0 < on_lines[0].std() < 3.0


def test_the_survey_has_a_stream_of_its_own_and_repeats_itself() -> None:
    truth = field()
    first, again, other = (
        surveyed(truth, SurveyParameters(), seed=np.random.SeedSequence(seed)).total_field_nt
        for seed in (1, 1, 2)
    )
    assert first.tobytes() == again.tobytes()
    assert not np.allclose(first, other, atol=0.1)


def test_a_survey_has_no_data_where_there_is_none(tmp_path) -> None:
    truth = field()
    total = truth.total_field_nt.copy()
    total[10:14, 20:24] = np.nan
    published = surveyed(
        replace(truth, total_field_nt=total), SurveyParameters(), seed=np.random.SeedSequence(1)
    )
    np.testing.assert_array_equal(np.isnan(published.total_field_nt), np.isnan(total))
    published.save(tmp_path / "map.npz")
    read = MagneticMap.load(tmp_path / "map.npz")
    assert (read.error_nt, read.line_spacing_m) == (published.error_nt, published.line_spacing_m)


def test_the_truth_behind_a_map_is_off_by_what_the_map_states() -> None:
    published = replace(field(), error_nt=1.7, line_spacing_m=160.0)
    truth = truth_behind(published, SurveyParameters(), seed=np.random.SeedSequence(1))
    difference = truth.total_field_nt - published.total_field_nt
    assert np.sqrt(np.mean(difference**2)) == pytest.approx(1.7)
    silent = replace(published, error_nt=None)
    difference = truth_behind(silent, SurveyParameters(), seed=np.random.SeedSequence(1)).total_field_nt
    assert 0.4 < np.sqrt(np.mean((difference - published.total_field_nt) ** 2)) < 1.5


@pytest.mark.parametrize("name", ["error_nt", "line_spacing_m"])
def test_a_stated_error_that_is_none_is_refused(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name} 0 is not accepted"):
        replace(field(), **{name: 0.0})
