"""Maps from GeoTIFF, netCDF and line data, against fields that are known everywhere."""

import lzma
import math

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.survey.map_import import MapImport, imported_map
from estimators.survey.map_values import Values
from flightsim.foundation.geodesy import GeodeticPosition, LocalFrame
from flightsim.foundation.magnetic_map_file import read_map_file
from flightsim.foundation.magnetics import FieldModel
from flightsim.foundation.main_field import MainField
from missions.cli import main as cli
from tests.measured_survey import SURVEY, with_measured_survey

rasterio = pytest.importorskip("rasterio")
netcdf = pytest.importorskip("netCDF4")
pytest.importorskip("ppigrf")

UTM = "EPSG:32632"  # zone 32 north: Zurich
HOME = GeodeticPosition(lat_deg=47.4, lon_deg=8.55, alt_m=400.0)
HOW = MapImport(home=HOME, spacing_m=50.0, height_m=80.0)


def field_nt(lat_deg, lon_deg):
    """A field over degrees."""
    return 48_000.0 + 80.0 * np.sin((lat_deg - 47.4) * 300.0) + 4000.0 * (lon_deg - 8.55)


def degrees(grid):
    """Latitudes and longitudes of a map's grid."""
    per_lat, per_lon = LocalFrame(grid.home).metres_per_degree
    return np.meshgrid(
        grid.home.lat_deg + grid.north_m / per_lat, grid.home.lon_deg + grid.east_m / per_lon, indexing="ij"
    )


def check(grid, *, atol=0.5, least=0.8):
    inside = np.isfinite(grid.total_field_nt)
    assert inside.mean() > least
    lat, lon = degrees(grid)
    np.testing.assert_allclose(grid.total_field_nt[inside], field_nt(lat, lon)[inside], atol=atol)


def write_geotiff(path, *, crs=UTM, nodata=-9999.0, hole=False):
    """The field on a grid of UTM coordinates, 30 m, from the north."""
    from rasterio.transform import from_origin
    from rasterio.warp import transform

    east, north = transform("EPSG:4326", UTM, [8.55], [47.4])
    left, top, size = east[0] - 1500.0, north[0] + 1500.0, 100
    x = left + 30.0 * (np.arange(size) + 0.5)
    y = top - 30.0 * (np.arange(size) + 0.5)
    columns, rows = np.meshgrid(x, y)
    lon, lat = transform(UTM, "EPSG:4326", columns.ravel(), rows.ravel())
    band = field_nt(np.array(lat), np.array(lon)).reshape(size, size)
    if hole:
        band[40:50, 40:50] = -9999.0
    with rasterio.open(
        path, "w", driver="GTiff", width=size, height=size, count=1, dtype="float64", crs=crs, nodata=nodata,
        transform=from_origin(left, top, 30.0, 30.0),
    ) as dataset:  # fmt: skip
        dataset.write(band, 1)
    return path


def write_netcdf(path, *, rows_first=True, names=("lat", "lon")):
    lat, lon = 47.4 + np.arange(-60, 61) * 2.5e-4, 8.55 + np.arange(-50, 51) * 4e-4
    values = field_nt(*np.meshgrid(lat, lon, indexing="ij"))
    with netcdf.Dataset(path, "w") as dataset:
        for name, axis in zip(names, (lat, lon), strict=True):
            dataset.createDimension(name, axis.size)
            dataset.createVariable(name, "f8", (name,))[:] = axis
        if rows_first:
            dataset.createVariable("z", "f8", names)[:] = values
        else:
            dataset.createVariable("z", "f8", names[::-1])[:] = values.T
    return path


def write_lines(path, *, header="longitude,latitude,total_field_nt", offset_nt=0.0):
    rows = [header]
    for k in range(13):
        for lat in 47.4 + np.arange(-60, 61) * 2e-4:
            lon = 8.55 + (k - 6) * 2.65e-3
            rows.append(f"{lon:.7f},{lat:.7f},{field_nt(lat, lon) + offset_nt:.3f}")
    path.write_text("\n".join(rows) + "\n")
    return path


def test_a_geotiff_in_another_coordinate_reference_system_is_where_it_belongs(tmp_path):
    grid = imported_map(write_geotiff(tmp_path / "map.tif"), HOW)
    assert (grid.home, grid.height_m) == (HOME, 80.0)
    assert math.isclose(grid.north_m[1] - grid.north_m[0], 50.0)
    check(grid)


def test_points_without_data_stay_so(tmp_path):
    grid = imported_map(write_geotiff(tmp_path / "map.tif", hole=True), HOW)
    assert np.isnan(grid.total_field_nt[len(grid.north_m) // 2 :, :]).any()
    check(grid, least=0.7)


@pytest.mark.parametrize("rows_first", [True, False])
def test_a_netcdf_grid_in_either_order(tmp_path, rows_first):
    check(imported_map(write_netcdf(tmp_path / "map.nc", rows_first=rows_first), HOW))


def test_line_data_are_gridded(tmp_path):
    grid = imported_map(write_lines(tmp_path / "lines.csv"), MapImport(home=HOME, line_spacing_m=200.0))
    assert grid.line_spacing_m == 200.0
    check(grid, atol=2.0)


def test_the_line_data_of_a_survey_are_a_map_again(tmp_path):
    """The XYZ file that a survey writes: columns with blanks, headers of lines, `*` for no value."""
    rows = ["/ longitude_deg latitude_deg levelled_nt reference_nt"]
    for k in range(9):
        rows.append(f"{'Tie' if k == 8 else 'Line'} {k}")
        for lat in 47.4 + np.arange(-60, 61) * 2e-4:
            lon = 8.55 + (k - 4) * 2.65e-3
            rows.append(f"{lon:.7f} {lat:.7f} {field_nt(lat, lon):.3f} *")
    (tmp_path / "lines.xyz").write_text("\n".join(rows) + "\n")
    check(imported_map(tmp_path / "lines.xyz", MapImport(home=HOME, line_spacing_m=200.0)), atol=2.0)


@pytest.mark.parametrize("model", [FieldModel.WMM, FieldModel.IGRF])
@pytest.mark.sampled(1)
def test_a_main_field_is_added_to_an_anomaly(tmp_path, model):
    path = write_lines(tmp_path / "lines.csv", offset_nt=-48_000.0)
    how = MapImport(home=HOME, line_spacing_m=200.0, values=Values(f"anomaly-{model}"))
    grid = imported_map(path, how)
    lat, lon = degrees(grid)
    main = MainField(HOME, model=model).total_at_nt(grid.north_m[:, None], grid.east_m[None, :], 100.0)
    inside = np.isfinite(grid.total_field_nt)
    expected = (main + field_nt(lat, lon) - 48_000.0)[inside]
    np.testing.assert_allclose(grid.total_field_nt[inside], expected, atol=2.0)


def test_the_two_models_of_the_main_field_agree_within_their_errors():
    wmm, igrf = (MainField(HOME, model=model) for model in FieldModel)
    assert wmm.total_nt == pytest.approx(igrf.total_nt, abs=60.0)
    assert float(wmm.direction_ned @ igrf.direction_ned) > math.cos(math.radians(0.2))
    with pytest.raises(ValueError, match=r"1900\.0 to 2030\.0"):
        MainField(HOME, 1850.0, model=FieldModel.IGRF)


@pytest.mark.parametrize(
    ("make", "how", "words"),
    [
        (lambda p: p / "none.tif", HOW, "does not exist"),
        (lambda p: write_geotiff(p / "a.tif", crs=None), HOW, "has no coordinate reference system"),
        (
            lambda p: write_geotiff(p / "a.tif"),
            MapImport(crs="EPSG:999999"),
            "`crs` EPSG:999999 is not accepted",
        ),
        (
            lambda p: write_geotiff(p / "a.tif", nodata=None, hole=True),
            HOW,
            "values from -9999 to .* stand for no data",
        ),
        (
            lambda p: write_geotiff(p / "a.tif"),
            MapImport(home=GeodeticPosition(lat_deg=-22.0, lon_deg=-42.0, alt_m=0.0)),
            "is the map of another place",
        ),
        (lambda p: write_geotiff(p / "a.tif"), MapImport(values=Values.ANOMALY_WMM), "which is no anomaly"),
        (lambda p: write_netcdf(p / "a.nc", names=("u", "v")), HOW, "is no map; accepted are coordinates"),
        (lambda p: write_lines(p / "a.csv"), HOW, "give the distance of its lines, `line_spacing_m`"),
        (
            lambda p: write_lines(p / "a.csv", header="a,b,c"),
            MapImport(line_spacing_m=200.0),
            "has the columns a, b, c; none is longitude",
        ),
        (
            lambda p: write_lines(p / "a.csv", offset_nt=-48_000.0),
            MapImport(line_spacing_m=200.0),
            "no total field of the Earth",
        ),
        (
            lambda p: write_lines(p / "a.csv", header="latitude,longitude,total_field_nt"),
            MapImport(home=HOME, line_spacing_m=200.0),
            "latitude and longitude are exchanged",
        ),
    ],
)  # fmt: skip
def test_files_that_are_no_map_of_the_place_are_refused_in_one_line(tmp_path, make, how, words):
    with pytest.raises(EstimatorError, match=words) as refused:
        imported_map(make(tmp_path), how)
    assert "\n" not in str(refused.value)


def test_damaged_files_are_refused(tmp_path):
    for name in ("map.tif", "map.nc", "map.csv", "map.doc", "map.csv.xz"):
        (tmp_path / name).write_bytes(b"\x00\xff nonsense")
        with pytest.raises(EstimatorError, match=name):
            imported_map(tmp_path / name, MapImport(line_spacing_m=100.0))


def test_the_command_makes_a_map_and_names_its_options(tmp_path, capsys):
    source, out = write_geotiff(tmp_path / "map.tif"), tmp_path / "map.npz"
    arguments = ["map", "make", str(source), "--out", str(out), "--home", "47.4,8.55,400"]
    assert cli.run_command_line([*arguments, "--error", "1.5"]) == 0
    assert read_map_file(out).error_nt == 1.5
    assert cli.run_command_line(["map", "info", str(out)]) == 0
    assert "home 47.400000,8.550000,400" in capsys.readouterr().out
    assert cli.run_command_line(arguments) == 2
    assert "exists and is not overwritten" in capsys.readouterr().err
    other = [*arguments[:3], "--out", str(tmp_path / "b.npz"), "--values", "anomaly-wmm"]
    assert cli.run_command_line(other) == 2
    said = capsys.readouterr().err
    assert "(--values total)" in said
    assert said.count("\n") == 1


@pytest.mark.slow
@with_measured_survey
def test_the_measured_survey_is_a_map(tmp_path):
    grid = imported_map(
        SURVEY, MapImport(values=Values.ANOMALY_IGRF, decimal_year=1978.3, line_spacing_m=1000.0)
    )
    assert np.isfinite(grid.total_field_nt).mean() > 0.95
    assert np.ptp(grid.north_m) > 50_000.0 and np.ptp(grid.east_m) > 55_000.0
    with lzma.open(SURVEY, "rt") as file:
        table = np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding="utf-8")
    per_lat, per_lon = LocalFrame(grid.home).metres_per_degree
    row = np.rint(((table["latitude"] - grid.home.lat_deg) * per_lat - grid.north_m[0]) / 100.0).astype(int)
    column = np.rint(((table["longitude"] - grid.home.lon_deg) * per_lon - grid.east_m[0]) / 100.0).astype(
        int
    )
    main = MainField(grid.home, 1978.3, model=FieldModel.IGRF)
    assert main.total_nt == pytest.approx(23_834.0, abs=200.0)  # as the survey states it for its middle
    expected = table["total_field_anomaly_nt"] + main.total_at_nt(
        grid.north_m[row], grid.east_m[column], 100.0
    )
    off = grid.total_field_nt[row, column] - expected
    assert np.nanmedian(np.abs(off)) < 3.0
