"""Maps as GeoTIFF and netCDF: the same values at the same places, for other programs and for `map make`."""

from dataclasses import replace

import numpy as np
import pytest

from estimators.errors import EstimatorError, LogError
from estimators.survey.map_export import exported_map
from estimators.survey.map_import import imported_map
from estimators.survey.map_import_options import MapImport
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.magnetic_map_file import MapContents, map_file_bytes
from missions.cli import main as cli

rasterio = pytest.importorskip("rasterio")
netcdf = pytest.importorskip("netCDF4")

HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.55, alt_m=400.0)
NORTH_M, EAST_M = np.arange(-1000.0, 1501.0, 50.0), np.arange(-800.0, 601.0, 50.0)
TOTAL_NT = 48_000.0 + 0.02 * NORTH_M[:, None] - 0.05 * EAST_M[None, :]
TOTAL_NT[10:12, 5:9] = np.nan
MAP = MapContents(
    north_m=NORTH_M,
    east_m=EAST_M,
    total_field_nt=TOTAL_NT,
    vertical_gradient_nt_m=np.full(TOTAL_NT.shape, -0.02),
    height_m=80.0,
    home=HOME,
    error_nt=1.5,
    line_spacing_m=200.0,
)
KINDS = ("tif", "nc")


@pytest.mark.parametrize("home", [HOME, replace(HOME, lon_deg=179.999), replace(HOME, lat_deg=-67.0)])
@pytest.mark.parametrize("kind", KINDS)
def test_a_map_that_is_exported_and_made_again_is_the_same(tmp_path, kind, home):
    exported_map(replace(MAP, home=home), tmp_path / f"a.{kind}")
    again = imported_map(tmp_path / f"a.{kind}", MapImport(home=home, spacing_m=50.0, height_m=80.0))
    np.testing.assert_allclose(again.north_m, NORTH_M)
    np.testing.assert_allclose(again.east_m, EAST_M)
    inside = np.isfinite(again.total_field_nt)
    np.testing.assert_allclose(again.total_field_nt[inside], TOTAL_NT[inside], atol=1e-4)
    assert inside.sum() >= np.isfinite(TOTAL_NT).sum() - 16  # points beside missing ones


@pytest.mark.parametrize("kind", KINDS)
def test_rasterio_finds_the_corners_where_they_are(tmp_path, kind):
    pymap3d = pytest.importorskip("pymap3d")
    path = tmp_path / f"a.{kind}"
    exported_map(MAP, path)
    with rasterio.open(path if kind == "tif" else f"netcdf:{path}:total_field_nt") as dataset:
        assert dataset.crs.to_epsg() == 4326
        assert np.isnan(dataset.nodata)
        values = dataset.read(1)
        corners = {(0, 0): (-1, 0), (values.shape[0] - 1, values.shape[1] - 1): (0, -1)}
        for (row, column), (north, east) in corners.items():
            lon_deg, lat_deg = dataset.xy(row, column)
            away = pymap3d.geodetic2ned(lat_deg, lon_deg, HOME.alt_m, HOME.lat_deg, HOME.lon_deg, HOME.alt_m)
            assert np.hypot(away[0] - NORTH_M[north], away[1] - EAST_M[east]) < 1.0
            assert values[row, column] == TOTAL_NT[north, east]


def test_units_and_metadata_of_a_geotiff(tmp_path):
    exported_map(MAP, tmp_path / "a.tif")
    with rasterio.open(tmp_path / "a.tif") as dataset:
        assert dataset.descriptions == ("total_field_nt", "vertical_gradient_nt_m")
        assert dataset.units == ("nT", "nT/m")
        tags = dataset.tags()
    found = {name: float(tags[name]) for name in ("height_m", "home_lat_deg", "error_nt", "line_spacing_m")}
    assert found == {"height_m": 80.0, "home_lat_deg": 47.4, "error_nt": 1.5, "line_spacing_m": 200.0}


def test_units_and_metadata_of_a_netcdf_file(tmp_path):
    exported_map(replace(MAP, vertical_gradient_nt_m=None, error_nt=None), tmp_path / "a.nc")
    with netcdf.Dataset(tmp_path / "a.nc") as dataset:
        assert set(dataset.variables) == {"crs", "latitude", "longitude", "total_field_nt"}
        assert (dataset["total_field_nt"].units, dataset["latitude"].units) == ("nT", "degrees_north")
        assert (dataset.height_m, dataset.home_alt_m, dataset.line_spacing_m) == (80.0, 400.0, 200.0)
        assert "error_nt" not in dataset.ncattrs()
        lat = dataset["latitude"][:].data
    per_lat, _ = LocalFrame(HOME).metres_per_degree
    np.testing.assert_allclose((lat - HOME.lat_deg) * per_lat, NORTH_M, atol=1e-6)


def test_uneven_grid_lines_are_for_netcdf_only(tmp_path):
    uneven = replace(MAP, north_m=np.cumsum(np.arange(1.0, NORTH_M.size + 1.0)))
    with pytest.raises(EstimatorError, match=r"north_m of the map is spaced 2 to 51 m, .* \(\.nc\)"):
        exported_map(uneven, tmp_path / "a.tif")
    assert list(tmp_path.iterdir()) == []
    exported_map(uneven, tmp_path / "a.nc")


@pytest.mark.parametrize("kind", KINDS)
def test_existing_files_and_missing_folders_are_refused(tmp_path, kind):
    path = tmp_path / f"a.{kind}"
    path.write_text("mine")
    with pytest.raises(LogError, match="exists and is not overwritten"):
        exported_map(MAP, path)
    assert path.read_text() == "mine"
    with pytest.raises(LogError, match="can't write"):
        exported_map(MAP, tmp_path / "none" / f"a.{kind}")
    assert list(tmp_path.iterdir()) == [path]


def test_the_command_exports_a_map(tmp_path, capsys):
    source = tmp_path / "map.npz"
    source.write_bytes(map_file_bytes(MAP))
    for kind in KINDS:
        out = tmp_path / f"b.{kind}"
        assert cli.run_command_line(["map", "export", str(source), "--out", str(out)]) == 0
        assert "EPSG:4326" in capsys.readouterr().out
        assert out.is_file()
    for arguments, words in (
        ([str(source), "--out", str(tmp_path / "b.doc")], "accepted are .tif, .tiff, .nc"),
        ([str(tmp_path / "none.npz"), "--out", str(tmp_path / "c.tif")], "can't be read: No such file"),
    ):
        assert cli.run_command_line(["map", "export", *arguments]) == 2
        said = capsys.readouterr().err
        assert words in said
        assert said.count("\n") == 1
