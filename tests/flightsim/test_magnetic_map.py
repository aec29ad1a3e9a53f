"""Magnetic maps: interpolation against scipy, files, WMM, made-up geology, gridding, signatures, field."""

import lzma
import math
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import dblquad
from scipy.interpolate import RegularGridInterpolator

from flightsim.foundation.magnetics import magnetic_field_ned_gauss
from flightsim.foundation.random_streams import RandomStreams
from flightsim.home import Home
from flightsim.payload import (
    DipoleSignature,
    GaussianSignature,
    HomeFrame,
    MagneticField,
    MagneticMap,
    MagneticMapError,
    MagneticSpec,
    MainField,
    SyntheticMapParameters,
    magnetic_field_of,
    synthetic_map,
)
from flightsim.payload.survey_grid import map_from_survey
from tests.measured_survey import SURVEY, with_measured_survey

Array = NDArray[np.float64]

HOME = Home()


def small_map(**changes: object) -> MagneticMap:
    north_m, east_m = np.arange(-300.0, 401.0, 100.0), np.arange(-500.0, 601.0, 50.0)
    rng = np.random.default_rng(3)
    contents = {
        "north_m": north_m,
        "east_m": east_m,
        "total_field_nt": 48000.0 + 50.0 * rng.standard_normal((north_m.size, east_m.size)),
        "vertical_gradient_nt_m": -0.02 + 0.1 * rng.standard_normal((north_m.size, east_m.size)),
        "height_m": 100.0,
        "home": HOME,
    }
    return MagneticMap(**(contents | changes))  # type: ignore[arg-type]


def made(seed: int = 1, **changes: float) -> MagneticMap:
    one_layer = {"shallow_anomaly_nt": 0.0}
    return synthetic_map(
        SyntheticMapParameters(**(one_layer | changes)),
        home=HOME,
        seed=RandomStreams(seed).child("magnetic_map"),
    )


# --- the grid ---


def test_interpolation_is_scipy_s() -> None:
    grid = small_map()
    rng = np.random.default_rng(4)
    north_m, east_m = rng.uniform(-300.0, 400.0, 500), rng.uniform(-500.0, 600.0, 500)
    expected = RegularGridInterpolator((grid.north_m, grid.east_m), grid.total_field_nt)((north_m, east_m))
    np.testing.assert_allclose(grid.interpolate(north_m, east_m), expected, rtol=1e-13)
    gradient = RegularGridInterpolator((grid.north_m, grid.east_m), grid.vertical_gradient_nt_m)
    higher = expected + 25.0 * gradient((north_m, east_m))
    np.testing.assert_allclose(grid.interpolate(north_m, east_m, 125.0), higher, rtol=1e-13)
    for n, e, value in zip(north_m[:20].tolist(), east_m[:20].tolist(), expected[:20], strict=True):
        assert grid.total_at_nt(n, e) == pytest.approx(value, rel=1e-13)
    nodes = grid.interpolate(grid.north_m[:, None], grid.east_m[None, :])
    np.testing.assert_allclose(nodes, grid.total_field_nt, rtol=1e-13)


def test_edges_and_holes() -> None:
    total = small_map().total_field_nt.copy()
    total[3, 4] = np.nan  # north 0, east -300
    grid = small_map(total_field_nt=total)
    assert grid.contains(-300.0, -500.0) and grid.contains(400.0, 600.0)
    assert not grid.contains(-300.1, 0.0) and not grid.contains(0.0, 600.1)
    assert not grid.contains(50.0, -320.0)
    assert not grid.contains(math.nan, 0.0)
    assert grid.contains(150.0, -320.0)
    with pytest.raises(MagneticMapError, match=r"goal at north 50 m, east -320 m .* north -300 to 400 m"):
        grid.require_inside("goal", 50.0, -320.0)
    whole = grid.without_holes()
    neighbours = (total[2, 4], total[4, 4], total[3, 3], total[3, 5])
    assert whole.total_field_nt[3, 4] == pytest.approx(np.mean(neighbours))
    assert whole.without_holes() is whole


@pytest.mark.parametrize("gradient", [True, False])
def test_files_come_back(tmp_path: Path, gradient: bool) -> None:
    grid = small_map() if gradient else small_map(vertical_gradient_nt_m=None)
    path = tmp_path / "survey.map"
    grid.save(path)
    back = MagneticMap.load(path)
    assert (back.height_m, back.home) == (100.0, HOME)
    np.testing.assert_array_equal(back.total_field_nt, grid.total_field_nt)
    np.testing.assert_array_equal(back.north_m, grid.north_m)
    if gradient:
        np.testing.assert_array_equal(back.vertical_gradient_nt_m, grid.vertical_gradient_nt_m)
    else:
        assert back.vertical_gradient_nt_m is None


def test_a_file_is_read_with_numpy_alone(tmp_path: Path) -> None:
    """What the head of the module promises to whoever reads the file without this package."""
    grid = small_map()
    grid.save(tmp_path / "survey.npz")
    with np.load(tmp_path / "survey.npz", allow_pickle=False) as archive:
        assert str(archive["format"]) == "flightstack-magnetic-map-1"
        assert archive["total_field_nt"].shape == (archive["north_m"].size, archive["east_m"].size)
        assert float(archive["home_lat_deg"]) == HOME.lat_deg
        assert float(archive["height_m"]) == 100.0
        assert "vertical_gradient_nt_m" in archive.files


def test_files_that_are_no_maps_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "wrong"
    with pytest.raises(MagneticMapError, match="wrong can't be read: No such file"):
        MagneticMap.load(path)
    for contents in (b"PK\x03\x04 broken", b"north,east"):
        path.write_bytes(contents)
        with pytest.raises(MagneticMapError, match="wrong is not a magnetic map"):
            MagneticMap.load(path)
    with path.open("wb") as file:
        np.savez(file, format="something else", north_m=np.arange(3.0))
    with pytest.raises(MagneticMapError, match="it has no east_m, total_field_nt"):
        MagneticMap.load(path)
    grid = small_map()
    grid.save(path)
    with np.load(path) as archive:
        found = dict(archive)
    with path.open("wb") as file:
        np.savez(file, **(found | {"format": "flightstack-magnetic-map-9"}))
    with pytest.raises(MagneticMapError, match="has the format flightstack-magnetic-map-9"):
        MagneticMap.load(path)
    with path.open("wb") as file:
        np.savez(file, **(found | {"north_m": found["north_m"][:-1]}))
    with pytest.raises(MagneticMapError, match="does not fit"):
        MagneticMap.load(path)


@pytest.fixture(scope="module")
def file_bytes(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("maps") / "good"
    small_map().save(path)
    return path.read_bytes()


def test_the_same_map_gives_the_same_bytes(file_bytes: bytes, tmp_path: Path) -> None:
    small_map().save(tmp_path / "again")
    assert (tmp_path / "again").read_bytes() == file_bytes


@given(data=st.data())
def test_spoiled_files_are_refused_or_read(
    file_bytes: bytes, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    spoiled = bytearray(file_bytes)
    for _ in range(data.draw(st.integers(0, 4))):
        spoiled[data.draw(st.integers(0, len(spoiled) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "spoiled"
    path.write_bytes(bytes(spoiled[: data.draw(st.integers(0, len(spoiled)))]))
    with suppress(MagneticMapError):
        MagneticMap.load(path)


def test_csv_grids(tmp_path: Path) -> None:
    path = tmp_path / "grid.csv"
    lines = ["100,0,48003", "0,0,48001", "0,50,48002", "100,50,", "0,100,5", "100,100,6"]
    path.write_text("north_m,east_m,total_field_nt\n" + "\n".join(lines) + "\n")
    grid = MagneticMap.load_csv(path, home=HOME, height_m=80.0)
    np.testing.assert_array_equal(grid.total_field_nt, [[48001.0, 48002.0, 5.0], [48003.0, np.nan, 6.0]])
    assert grid.height_m == 80.0 and grid.spacing_m == (100.0, 50.0)
    for text, named in (
        ("lat,lon,nt\n1,2,3\n", "accepted is the header"),
        ("north_m,east_m,total_field_nt\n", "a header and no lines"),
        ("north_m,east_m,total_field_nt\n\n0,0\n", "line 3: '0,0'; accepted are three numbers"),
        ("north_m,east_m,total_field_nt\nx,0,1\n", "line 2: 'x,0,1'"),
        ("north_m,east_m,total_field_nt\n0,nan,1\n", "line 2: '0,nan,1'"),
        ("north_m,east_m,total_field_nt\n0,0,1,2\n", "line 2: '0,0,1,2'"),
        ("north_m,east_m,total_field_nt\n0,0,1\n0,9,1\n5,0,1\n7,9,1\n8,0,2\n", "even spacing"),
    ):
        path.write_text(text)
        with pytest.raises(MagneticMapError, match=named):
            MagneticMap.load_csv(path, home=HOME, height_m=80.0)
    with pytest.raises(MagneticMapError, match=r"none\.csv"):
        MagneticMap.load_csv(tmp_path / "none.csv", home=HOME, height_m=80.0)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"north_m": np.array([0.0])}, "north_m of a magnetic map"),
        ({"east_m": np.arange(-500.0, 601.0, 50.0)[::-1]}, "east_m of a magnetic map"),
        ({"total_field_nt": np.zeros((2, 2))}, r"grid of \(2, 2\) does not fit"),
        ({"total_field_nt": np.full((8, 23), np.nan)}, "has no data"),
        ({"height_m": math.nan}, "height_m nan is not finite"),
    ],
)
def test_bad_maps_are_refused(changes: dict[str, object], named: str) -> None:
    with pytest.raises(MagneticMapError, match=named):
        small_map(**changes)


# --- main field and geology ---


@pytest.mark.parametrize("home", [HOME, Home(lat_deg=-22.5, lon_deg=-42.6, alt_m=0.0)])
def test_main_field_is_wmm(home: Home) -> None:
    main = MainField(home, 2026.0)
    for north_m, east_m, height_m in (
        (0.0, 0.0, 0.0),
        (3000.0, -4000.0, 120.0),
        (-15e3, 12e3, 300.0),
        (20e3, 20e3, 1000.0),
    ):
        lat_deg, lon_deg = home.offset(north_m, east_m)
        field = 1e5 * magnetic_field_ned_gauss(lat_deg, lon_deg, home.alt_m + height_m, 2026.0)
        expected = np.linalg.norm(field)
        value = main.total_at_nt(np.array(north_m), np.array(east_m), height_m)
        assert value == pytest.approx(expected, abs=0.1)
    field = 1e5 * magnetic_field_ned_gauss(home.lat_deg, home.lon_deg, home.alt_m, 2026.0)
    np.testing.assert_allclose(main.total_nt * main.direction_ned, field, atol=0.1)


def test_geology_has_the_size_and_the_place_it_was_given() -> None:
    grid = made(south_m=-1000.0, west_m=-3000.0, north_m=5000.0, east_m=3050.0, anomaly_nt=40.0)
    assert grid.north_m[0] == -1000.0 and grid.north_m[-1] == 5000.0
    assert grid.east_m[0] == -3000.0 and 3050.0 <= grid.east_m[-1] < 3150.0
    main = MainField(HOME).total_at_nt(grid.north_m[:, None], grid.east_m[None, :], grid.height_m)
    anomaly = grid.total_field_nt - main
    assert np.sqrt(np.mean(anomaly**2)) == pytest.approx(40.0)
    assert abs(anomaly.mean()) < 1e-6


def test_the_ground_adds_a_layer_of_its_own() -> None:
    """The same deep rock, and beside it what is shallow: shorter, and independent of it."""
    deep, both = (made(anomaly_nt=40.0, shallow_anomaly_nt=size_nt) for size_nt in (0.0, 5.0))
    shallow = both.total_field_nt - deep.total_field_nt
    assert np.sqrt(np.mean(shallow**2)) == pytest.approx(5.0)
    roughness = [np.diff(part, axis=0).std() / part.std() for part in (shallow, deep.total_field_nt)]
    assert roughness[0] > 1.5 * roughness[1]


def test_geology_has_the_spectrum_it_was_given() -> None:
    """Radial amplitude spectrum: ln A + b/2 ln k falls with the slope -depth (Spector and Grant)."""
    depth_m, spacing_m = 300.0, 50.0
    logs = []
    for seed in range(20):
        grid = made(
            seed, spacing_m=spacing_m, source_depth_m=depth_m, spectral_exponent=2.0, anomaly_nt=100.0
        )
        main = MainField(HOME).total_at_nt(grid.north_m[:, None], grid.east_m[None, :], grid.height_m)
        anomaly = grid.total_field_nt - main
        window = np.hanning(anomaly.shape[0])[:, None] * np.hanning(anomaly.shape[1])[None, :]
        logs.append(np.abs(np.fft.fft2(window * anomaly)) ** 2)
    k = 2.0 * math.pi * np.fft.fftfreq(anomaly.shape[0], spacing_m)
    radial = np.hypot(k[:, None], k[None, :])
    power = np.mean(logs, axis=0)
    edges = np.linspace(0.004, 0.02, 12)
    middles = 0.5 * (edges[1:] + edges[:-1])
    amplitude = np.array([math.sqrt(power[(radial >= a) & (radial < b)].mean()) for a, b in pairwise(edges)])
    slope = np.polyfit(middles, np.log(amplitude) + np.log(middles), 1)[0]
    assert slope == pytest.approx(-depth_m, rel=0.1)


def test_the_vertical_gradient_continues_the_field_upwards() -> None:
    """Blakely, equation 12.6: a smooth map made for a deeper source is the same map seen from above."""
    low = made(anomaly_nt=100.0, source_depth_m=400.0, spectral_exponent=2.0)
    rng_alike = {"anomaly_nt": 100.0, "spectral_exponent": 2.0}
    high = made(source_depth_m=401.0, **rng_alike)
    assert low.vertical_gradient_nt_m is not None
    main = MainField(HOME)
    main_nt = main.total_at_nt(low.north_m[:, None], low.east_m[None, :], low.height_m)
    # Both are scaled to the same size; the ratio of their sizes is found by least squares.
    a, b = low.total_field_nt - main_nt, high.total_field_nt - main_nt
    gradient = low.vertical_gradient_nt_m - main.gradient_up_nt_m
    gradient = gradient - gradient.mean()
    (scale, metres), *_ = np.linalg.lstsq(np.stack([a.ravel(), gradient.ravel()], axis=1), b.ravel())
    assert scale > 0.9 and metres / scale == pytest.approx(1.0, rel=0.02)


def test_geology_is_its_seed_s() -> None:
    np.testing.assert_array_equal(made(1).total_field_nt, made(1).total_field_nt)
    assert not np.allclose(made(1).total_field_nt, made(2).total_field_nt)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"spacing_m": 0.0}, "spacing_m 0"),
        ({"spacing_m": 0.5}, r"spacing_m = 0\.5 is not accepted: it makes 8001 x 8001"),
        ({"north_m": -3000.0}, r"south_m and north_m = -2000\.0, -3000\.0"),
        ({"source_depth_m": -1.0}, "source_depth_m -1"),
    ],
)
def test_bad_geology_is_named(changes: dict[str, float], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        SyntheticMapParameters(**changes)


# --- survey lines to a map ---


def test_gridding_a_plane_gives_the_plane() -> None:
    rng = np.random.default_rng(5)
    north_m, east_m = rng.uniform(-2000.0, 2000.0, (2, 3000))
    places = np.array([HOME.offset(n, e) for n, e in zip(north_m.tolist(), east_m.tolist(), strict=True)])
    anomaly_nt = 10.0 + 0.02 * north_m - 0.03 * east_m
    grid = map_from_survey(places[:, 0], places[:, 1], anomaly_nt, home=HOME, height_m=100.0)
    assert np.isfinite(grid.total_field_nt).mean() > 0.97
    main = MainField(HOME).total_at_nt(grid.north_m[:, None], grid.east_m[None, :], 100.0)
    plane = 10.0 + 0.02 * grid.north_m[:, None] - 0.03 * grid.east_m[None, :]
    inside = np.isfinite(grid.total_field_nt)
    np.testing.assert_allclose((grid.total_field_nt - main)[inside], plane[inside], atol=1e-6)


def test_gaps_in_a_survey_have_no_data() -> None:
    north_m, east_m = (
        axis.ravel() for axis in np.meshgrid(np.arange(0, 5e3, 200.0), np.arange(0, 5e3, 200.0))
    )
    keep = np.hypot(north_m - 2500.0, east_m - 2500.0) > 1200.0
    north_m, east_m = north_m[keep], east_m[keep]
    places = np.array([HOME.offset(n, e) for n, e in zip(north_m.tolist(), east_m.tolist(), strict=True)])
    grid = map_from_survey(
        places[:, 0], places[:, 1], np.zeros(north_m.size), home=HOME, height_m=100.0, max_gap_m=600.0
    )
    assert not grid.contains(2500.0, 2500.0)
    assert grid.contains(500.0, 500.0)
    with pytest.raises(MagneticMapError, match="a survey of 1 places"):
        map_from_survey(places[:1, 0], places[:1, 1], np.zeros(1), home=HOME, height_m=100.0)


@with_measured_survey
def test_a_real_survey_becomes_a_map() -> None:
    with lzma.open(SURVEY, "rt") as file:
        lon_deg, lat_deg, anomaly_nt = np.genfromtxt(
            file, delimiter=",", skip_header=1, usecols=(0, 1, 2), unpack=True
        )
    home = Home(lat_deg=-22.3, lon_deg=-42.3, alt_m=0.0)
    near = (np.abs(lat_deg + 22.3) < 0.05) & (np.abs(lon_deg + 42.3) < 0.05)
    assert near.sum() > 500
    held_back = np.arange(near.sum()) % 10 == 0
    lat, lon, value = lat_deg[near], lon_deg[near], anomaly_nt[near]
    grid = map_from_survey(
        lat[~held_back], lon[~held_back], value[~held_back], home=home, height_m=150.0, spacing_m=100.0
    )
    assert grid.contains(0.0, 0.0)
    # readings that were not used are met within the noise of a survey flown over mountains
    frame, main = HomeFrame(home), MainField(home)
    errors = []
    for a, b, v in zip(lat[held_back].tolist(), lon[held_back].tolist(), value[held_back], strict=True):
        north_m, east_m = frame.north_east_m(a, b)
        expected = main.total_at_nt(np.array(north_m), np.array(east_m), 150.0) + v
        errors.append(grid.total_at_nt(north_m, east_m) - float(expected))
    errors_nt = np.array(errors)[np.isfinite(errors)]
    assert np.median(np.abs(errors_nt)) < 0.1 * value.std()


# --- signatures ---


@given(st.floats(-3.0, 3.0), st.floats(-400.0, 400.0), st.floats(-400.0, 400.0))
def test_gaussian_signature_in_the_targets_own_frame(heading: float, along: float, across: float) -> None:
    target = GaussianSignature(
        north_m=100.0,
        east_m=-50.0,
        amplitude_nt=25.0,
        sigma_along_m=200.0,
        sigma_across_m=80.0,
        heading_rad=heading,
    )
    north_m = 100.0 + along * math.cos(heading) - across * math.sin(heading)
    east_m = -50.0 + along * math.sin(heading) + across * math.cos(heading)
    value = target.anomaly_nt(np.float64(north_m), np.float64(east_m), 100.0, np.zeros(3))
    expected = 25.0 * math.exp(-0.5 * ((along / 200.0) ** 2 + (across / 80.0) ** 2))
    assert value == pytest.approx(expected, rel=1e-6)


def test_dipole_signature_is_the_field_of_a_current_loop() -> None:
    """Biot and Savart over a loop of 1 m radius, seen from 30 m, against the dipole of its moment."""
    current_a, radius_m = 1e4, 1.0
    angles = np.linspace(0.0, 2.0 * math.pi, 2001)[:-1]
    wire = np.stack([radius_m * np.cos(angles), radius_m * np.sin(angles), np.zeros(angles.size)], axis=1)
    step = (
        np.stack([-np.sin(angles), np.cos(angles), np.zeros(angles.size)], axis=1) * radius_m * math.pi / 1e3
    )
    eye = np.array([12.0, -7.0, -30.0])  # north, east, down: 30 m above
    offset = eye - wire
    field_nt = (
        1e9
        * 1e-7
        * current_a
        * np.sum(np.cross(step, offset) / np.linalg.norm(offset, axis=1)[:, None] ** 3, axis=0)
    )
    dipole = DipoleSignature(
        north_m=0.0, east_m=0.0, height_m=0.0, moment_ned_a_m2=(0.0, 0.0, current_a * math.pi * radius_m**2)
    )
    found = dipole.field_ned_nt(np.float64(12.0), np.float64(-7.0), 30.0)
    np.testing.assert_allclose(found, field_nt, rtol=5e-3, atol=1e-3 * np.abs(field_nt).max())


def test_dipole_changes_the_magnitude_of_the_field() -> None:
    earth = np.array([20000.0, 1000.0, 43000.0])
    dipole = DipoleSignature(north_m=0.0, east_m=0.0, height_m=-50.0, moment_ned_a_m2=(2e5, 0.0, 3e5))
    north_m, east_m = np.meshgrid(np.linspace(-500, 500, 11), np.linspace(-500, 500, 9), indexing="ij")
    value = dipole.anomaly_nt(north_m, east_m, 100.0, earth)
    assert value.shape == (11, 9)
    projected = dipole.field_ned_nt(north_m, east_m, 100.0) @ (earth / np.linalg.norm(earth))
    np.testing.assert_allclose(value, projected, atol=0.05)  # second order in B / F
    # far away it falls with the cube of the distance
    near = dipole.anomaly_nt(np.float64(0.0), np.float64(0.0), 950.0, earth)
    far = dipole.anomaly_nt(np.float64(0.0), np.float64(0.0), 1950.0, earth)
    assert near / far == pytest.approx(8.0, rel=1e-3)


def test_a_gaussian_s_volume() -> None:
    target = GaussianSignature(
        north_m=0.0, east_m=0.0, amplitude_nt=10.0, sigma_along_m=60, sigma_across_m=40
    )
    volume, _ = dblquad(
        lambda e, n: float(target.anomaly_nt(np.float64(n), np.float64(e), 0.0, np.zeros(3))),
        -400.0,
        400.0,
        -300.0,
        300.0,
        epsrel=1e-4,
    )
    assert volume == pytest.approx(10.0 * 2.0 * math.pi * 60.0 * 40.0, rel=1e-3)


# --- the field ---


def test_the_field_is_the_published_map_and_the_targets(tmp_path: Path) -> None:
    """What a mission does: it loads the file, and reading - map is the targets alone, at any height."""
    published = made()
    published.save(tmp_path / "area.npz")
    target = GaussianSignature(north_m=400.0, east_m=-300.0, amplitude_nt=30.0)
    wreck = DipoleSignature(north_m=-200.0, east_m=500.0, height_m=-40.0, moment_ned_a_m2=(2e5, 3e4, -1e5))
    field = MagneticField(published, [target, wreck])
    earth = MainField(published.home, 2026.0)
    onboard = MagneticMap.load(tmp_path / "area.npz")
    rng = np.random.default_rng(6)
    for north_m, east_m in rng.uniform(-2000.0, 2000.0, (50, 2)).tolist():
        for height_m in (60.0, 100.0, 130.0):
            reading = field.total_nt(north_m, east_m, height_m)
            background = onboard.interpolate(np.array(north_m), np.array(east_m), height_m)
            expected = sum(
                signature.anomaly_nt(
                    np.float64(north_m), np.float64(east_m), height_m, earth.total_nt * earth.direction_ned
                )
                for signature in (target, wreck)
            )
            assert reading - float(background) == pytest.approx(float(expected), abs=1e-8)
            assert reading == pytest.approx(
                float(field.total_at_nt(np.array(north_m), np.array(east_m), height_m)), abs=1e-8
            )


def test_the_field_goes_on_beyond_the_map() -> None:
    total = small_map().total_field_nt.copy()
    total[3:5, 4:7] = np.nan
    published = small_map(total_field_nt=total)
    field = MagneticField(published)
    assert field.total_nt(-900.0, -900.0, 100.0) == pytest.approx(total[0, 0])
    assert math.isfinite(field.total_nt(50.0, -270.0, 100.0))


def test_targets_outside_the_map_are_refused() -> None:
    with pytest.raises(MagneticMapError, match="target 2 at north 2100 m, east 0 m is outside"):
        MagneticField(
            made(),
            [GaussianSignature(north_m=0.0, east_m=0.0), GaussianSignature(north_m=2100.0, east_m=0.0)],
        )


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: GaussianSignature(north_m=math.nan, east_m=0.0), "north_m nan"),
        (lambda: GaussianSignature(north_m=0.0, east_m=0.0, sigma_across_m=0.0), r"sigma_across_m 0"),
        (
            lambda: DipoleSignature(north_m=0.0, east_m=0.0, height_m=0.0, moment_ned_a_m2=(1.0, 2.0)),  # type: ignore[arg-type]
            r"moment_ned_a_m2 = \(1\.0, 2\.0\)",
        ),
    ],
)
def test_bad_signatures_are_named(make: object, named: str) -> None:
    assert callable(make)
    with pytest.raises(ValueError, match=named):
        make()


def test_a_generated_map_may_be_as_large_as_a_survey():
    """60 km by 50 km at 100 m, as in Lum et al. 2005, figure 2, with the model's main field."""
    home = Home()
    spec = MagneticSpec(width_m=60_000.0, height_m=50_000.0, spacing_m=100.0)
    _, published = magnetic_field_of(spec, home=home, seed=1, decimal_year=2026.0)
    assert published.total_field_nt.shape == (501, 601)
    lat_deg, lon_deg = home.offset(25_000.0, 30_000.0)
    main_nt = 1e5 * np.linalg.norm(magnetic_field_ned_gauss(lat_deg, lon_deg, home.alt_m, 2026.0))
    corner = published.total_field_nt[-40:, -40:]
    assert abs(float(corner.mean()) - main_nt) < 300.0
