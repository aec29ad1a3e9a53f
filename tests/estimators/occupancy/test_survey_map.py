"""The published magnetic map, as estimators and missions read it; written by the simulator's own class."""

import math
from pathlib import Path

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.occupancy.survey_map import load_survey_map
from flightsim.home import Home
from flightsim.payload import MagneticMap

HOME = Home(lat_deg=47.4, lon_deg=8.5, alt_m=480.0)


def published(hole: bool = False, gradient: bool = True) -> MagneticMap:
    north = np.linspace(-500.0, 700.0, 13)
    east = np.linspace(-300.0, 300.0, 7)
    total = 48_000.0 + 0.01 * north[:, None] + 20.0 * np.sin(east / 100.0)[None, :]
    if hole:
        total[6, 3] = np.nan
    slope = np.full(total.shape, -0.02) if gradient else None
    return MagneticMap(
        north_m=north,
        east_m=east,
        total_field_nt=total,
        height_m=100.0,
        home=HOME,
        vertical_gradient_nt_m=slope,
    )


def saved(tmp_path: Path, **kind: bool) -> Path:
    path = tmp_path / "map.npz"
    published(**kind).save(path)
    return path


def test_reads_what_the_simulator_says(tmp_path):
    read, written = load_survey_map(saved(tmp_path)), published()
    rng = np.random.default_rng(1)
    for north, east, height in zip(
        rng.uniform(-500, 700, 50), rng.uniform(-300, 300, 50), rng.uniform(50, 200, 50), strict=True
    ):
        expected = float(written.interpolate(np.array(north), np.array(east), height))
        assert read.total_nt(north, east, height) == pytest.approx(expected, abs=1e-6)


def test_unknown_gradient_is_none(tmp_path):
    read = load_survey_map(saved(tmp_path, gradient=False))
    assert read.total_nt(0.0, 0.0, 50.0) == read.total_nt(0.0, 0.0, 150.0)


def test_no_data_off_the_map_and_beside_holes(tmp_path):
    read = load_survey_map(saved(tmp_path, hole=True))
    assert math.isnan(read.total_nt(701.0, 0.0, 100.0))
    assert math.isnan(read.total_nt(110.0, 10.0, 100.0))
    assert math.isfinite(read.total_nt(700.0, 300.0, 100.0))


def test_area_without_data_is_refused_with_what_there_is(tmp_path):
    read = load_survey_map(saved(tmp_path, hole=True))
    area = {"what": "the search area"}
    read.require_data(south_m=-500.0, north_m=0.0, west_m=-300.0, east_m=300.0, **area)
    with pytest.raises(EstimatorError, match=r"does not cover it; it reaches from north -500 to 700 m"):
        read.require_data(south_m=-600.0, north_m=0.0, west_m=-300.0, east_m=300.0, **area)
    with pytest.raises(EstimatorError, match="no data in part of it"):
        read.require_data(south_m=-100.0, north_m=200.0, west_m=-300.0, east_m=300.0, **area)


@pytest.mark.parametrize("content", [b"", b"not a zip", b"PK\x03\x04garbage"])
def test_garbage_is_refused_by_name(tmp_path, content):
    path = tmp_path / "bad.npz"
    path.write_bytes(content)
    with pytest.raises(EstimatorError, match=r"`map_file` .*bad\.npz"):
        load_survey_map(path)


def test_missing_file_is_refused_by_name(tmp_path):
    with pytest.raises(EstimatorError, match=r"`map_file` .*nowhere\.npz"):
        load_survey_map(tmp_path / "nowhere.npz")


@pytest.mark.parametrize(
    ("change", "reported"),
    [
        ({"total_field_nt": None}, "has no total_field_nt"),
        ({"format": "other"}, "format other"),
        ({"total_field_nt": np.full((13, 7), np.nan)}, "has no data"),
        ({"total_field_nt": np.zeros((3, 3))}, "does not fit"),
        ({"north_m": np.linspace(700.0, -500.0, 13)}, "does not fit"),
        ({"home_lat_deg": 95.0}, r"latitude 95\.0 deg is not in"),
        ({"height_m": "high"}, "height_m holds"),
    ],
)
def test_damaged_contents_are_refused_by_name(tmp_path, change, reported):
    path = saved(tmp_path)
    with np.load(path) as archive:
        contents = {name: archive[name] for name in archive.files} | change
    np.savez(path, **{name: value for name, value in contents.items() if value is not None})
    with pytest.raises(EstimatorError, match=reported):
        load_survey_map(path)
