"""Maps from GeoTIFF, netCDF and line data, against fields that are known everywhere."""

import lzma
import math
import struct
from dataclasses import replace

import numpy as np
import pytest

from estimators.errors import EstimatorError
from estimators.survey import map_table
from estimators.survey.map_import import imported_map
from estimators.survey.map_import_options import MapImport, Values
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


def write_geotiff(path, *, crs=UTM, nodata=-9999.0, hole=False, bands=(None,)):
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
        path, "w", driver="GTiff", width=size, height=size, count=len(bands), dtype="float64", crs=crs,
        nodata=nodata, transform=from_origin(left, top, 30.0, 30.0),
    ) as dataset:  # fmt: skip
        dataset.descriptions = bands
        for number in dataset.indexes:
            dataset.write(band + 1000.0 * (number - 1), number)
    return path


LAT, LON = 47.4 + np.arange(-60, 61) * 2.5e-4, 8.55 + np.arange(-50, 51) * 4e-4


def write_netcdf(path, *, rows_first=True, names=("lat", "lon"), lat=LAT, lon=LON, mapping=None):
    """The field at places of WGS84, or at the same numbers of the system that `mapping` declares."""
    values = field_nt(*np.meshgrid(LAT, LON, indexing="ij"))
    with netcdf.Dataset(path, "w") as dataset:
        for name, axis in zip(names, (lat, lon), strict=True):
            dataset.createDimension(name, axis.size)
            dataset.createVariable(name, "f8", (name,))[:] = axis
        if rows_first:
            dataset.createVariable("z", "f8", names)[:] = values
        else:
            dataset.createVariable("z", "f8", names[::-1])[:] = values.T
        if mapping is not None:
            dataset["z"].grid_mapping = "datum"
            dataset.createVariable("datum", "i4", ()).setncatts(mapping)
    return path


def write_degrees(path, lon=LON):
    """The field as a GeoTIFF in degrees."""
    from rasterio.transform import from_origin

    with rasterio.open(
        path, "w", driver="GTiff", width=LON.size, height=LAT.size, count=1, dtype="float64",
        crs="EPSG:4326", transform=from_origin(lon[0] - 2e-4, LAT[-1] + 1.25e-4, 4e-4, 2.5e-4),
    ) as dataset:  # fmt: skip
        dataset.write(field_nt(*np.meshgrid(LAT, LON, indexing="ij"))[::-1], 1)
    return path


def write_texts(path):
    """A netCDF file with texts where a map has numbers."""
    write_netcdf(path)
    with netcdf.Dataset(path, "a") as dataset:
        dataset.createVariable("comment", str, ("lat", "lon"))
    return path


def write_times(path):
    """A netCDF file with a third dimension."""
    with netcdf.Dataset(path, "w") as dataset:
        for name in ("time", "lat", "lon"):
            dataset.createDimension(name, 3)
        dataset.createVariable("z", "f8", ("time", "lat", "lon"))
    return path


def write_lines(path, *, header="longitude,latitude,total_field_nt", offset_nt=0.0):
    rows = [header]
    for k in range(13):
        for lat in 47.4 + np.arange(-60, 61) * 2e-4:
            lon = 8.55 + (k - 6) * 2.65e-3
            rows.append(f"{lon:.7f},{lat:.7f},{field_nt(lat, lon) + offset_nt:.3f}")
    path.write_text("\n".join(rows) + "\n")
    return path


def write_line(path, step_lon, step_lat):
    """Readings on one line."""
    rows = [f"{8.55 + k * step_lon:.7f},{47.4 + k * step_lat:.7f},48000" for k in range(200)]
    path.write_text("\n".join(("longitude,latitude,total_field_nt", *rows)) + "\n")
    return path


def write_empty(path):
    path.touch()
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


EUROPEAN_1950 = [
    {"epsg_code": "EPSG:4230"},
    {"epsg_code": np.int32(4230)},
    {"crs_wkt": rasterio.crs.CRS.from_epsg(4230).to_wkt()},
    {"spatial_ref": rasterio.crs.CRS.from_epsg(4230).to_wkt()},
]


@pytest.mark.parametrize("mapping", EUROPEAN_1950)
def test_the_datum_that_a_netcdf_file_declares_counts(tmp_path, mapping):
    """Places of ED50 are about 100 m from those of the same numbers in WGS84."""
    grid = imported_map(write_netcdf(tmp_path / "map.nc", mapping=mapping), HOW)
    given = imported_map(write_netcdf(tmp_path / "plain.nc"), replace(HOW, crs="EPSG:4230"))
    np.testing.assert_array_equal(grid.total_field_nt, given.total_field_nt)
    plain = imported_map(tmp_path / "plain.nc", HOW)
    assert plain.north_m[0] - grid.north_m[0] == pytest.approx(100.0, abs=50.0)
    check(imported_map(tmp_path / "map.nc", replace(HOW, crs="EPSG:4326")))


def test_a_grid_mapping_of_wgs84_without_a_definition_is_wgs84(tmp_path):
    mapping = {"grid_mapping_name": "latitude_longitude", "semi_major_axis": 6378137.0}
    check(imported_map(write_netcdf(tmp_path / "map.nc", mapping=mapping), HOW))


@pytest.mark.parametrize("given", [None, "EPSG:4326"])
@pytest.mark.parametrize("write", [write_degrees, lambda path, lon: write_netcdf(path, lon=lon)])
def test_longitudes_from_0_to_360_are_those_of_the_home(tmp_path, write, given):
    west = LON + 180.0  # 188.55 is -171.45
    path = write(tmp_path / ("map.tif" if write is write_degrees else "map.nc"), west)
    grid = imported_map(path, replace(HOW, crs=given, home=None))
    assert grid.home.lon_deg == pytest.approx(8.55 - 180.0, abs=1e-5)
    lat, lon = degrees(grid)
    inside = np.isfinite(grid.total_field_nt)
    assert inside.mean() > 0.9
    np.testing.assert_allclose(grid.total_field_nt[inside], field_nt(lat, lon + 180.0)[inside], atol=0.5)


def test_a_grid_on_both_sides_of_180_degrees_is_one_map(tmp_path):
    grid = imported_map(write_netcdf(tmp_path / "map.nc", lon=LON + 171.45), replace(HOW, home=None))
    assert abs(grid.home.lon_deg) == pytest.approx(180.0, abs=1e-5)
    assert np.ptp(grid.east_m) < 4000.0
    assert np.isfinite(grid.total_field_nt).mean() > 0.9


@pytest.mark.parametrize(("column", "offset_nt"), [("2", 1000.0), ("LATER", 1000.0), ("1", 0.0)])
def test_a_band_is_chosen_by_number_or_description(tmp_path, column, offset_nt):
    path = write_geotiff(tmp_path / "map.tif", bands=("first", "later"))
    grid = imported_map(path, replace(HOW, column=column))
    first = imported_map(write_geotiff(tmp_path / "first.tif"), HOW)
    np.testing.assert_allclose(grid.total_field_nt, first.total_field_nt + offset_nt)


LINE_HOW = MapImport(home=HOME, line_spacing_m=200.0)


@pytest.mark.parametrize("line", ["L{}", "{}"])
def test_a_column_may_have_the_name_line(tmp_path, line):
    """As in the table that a survey writes."""
    path = write_lines(tmp_path / "lines.csv")
    head, *rows = path.read_text().splitlines()
    text = [f"line,time,{head}", *(f"{line.format(k // 121)},{k},{row}" for k, row in enumerate(rows))]
    path.write_text("\n".join(text) + "\n")
    check(imported_map(path, LINE_HOW), atol=2.0)


def test_names_of_columns_have_no_case_and_a_byte_order_mark_is_none_of_them(tmp_path):
    path = write_lines(tmp_path / "lines.csv", header="Longitude,Latitude,Field")
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    check(imported_map(path, replace(LINE_HOW, column="FIELD")), atol=2.0)


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
        (lambda p: p / "none.tif", HOW, "can't be read: No such file"),
        (lambda p: write_geotiff(p / "a.tif", crs=None), HOW, "has no coordinate reference system"),
        (
            lambda p: write_geotiff(p / "a.tif"),
            MapImport(crs="EPSG:999999"),
            "`crs` EPSG:999999 is not accepted",
        ),
        (
            lambda p: write_geotiff(p / "a.tif", nodata=None, hole=True),
            HOW,
            r"such as -9999 nT, no total field .*: 100 of 10000 values, .* `no_data` -9999;",
        ),
        (
            lambda p: write_geotiff(p / "a.tif"),
            MapImport(home=GeodeticPosition(lat_deg=-22.0, lon_deg=-42.0, alt_m=0.0)),
            "is the map of another place",
        ),
        (lambda p: write_geotiff(p / "a.tif"), MapImport(values=Values.ANOMALY_WMM), "nT, no anomaly"),
        (
            lambda p: write_geotiff(p / "a.tif", crs='LOCAL_CS["mine",UNIT["metre",1]]'),
            HOW,
            "LOCAL_CS.* is neither geographic nor projected; give .* `crs`",
        ),
        (
            lambda p: write_geotiff(p / "a.tif", crs="+proj=longlat +R=1737400"),  # the Moon
            HOW,
            "PROJ can't transform its places from .* to EPSG:4326; give .* `crs`",
        ),
        (lambda p: write_geotiff(p / "a.tif", bands=(None, "b")), HOW, r"2 candidates .* \(1, b\)"),
        (
            lambda p: write_geotiff(p / "a.tif", bands=(None, "b")),
            replace(HOW, column="3"),
            "has no `column` '3'; there are 1, b",
        ),
        (lambda p: write_geotiff(p / "a.tif"), replace(HOW, column="nosuch"), "'nosuch'; there are 1$"),
        (
            lambda p: write_netcdf(p / "a.nc", lon=np.sort(np.append(LON[:-1], LON[0]))),
            HOW,
            "its x coordinates are no grid lines; .* without repetition",
        ),
        (
            lambda p: write_netcdf(p / "a.nc", lat=np.append(LAT[:-1], np.nan)),
            HOW,
            "its y coordinates are no grid lines; accepted are two or more finite numbers",
        ),
        (
            lambda p: write_texts(p / "a.nc"),
            replace(HOW, column="comment"),
            "has no `column` 'comment'; there are z",
        ),
        (
            lambda p: write_times(p / "a.nc"),
            HOW,
            "no variable of numbers over two coordinates; there is z over time, lat, lon: save one time",
        ),
        (
            lambda p: write_netcdf(p / "a.nc", mapping={"grid_mapping_name": "mercator"}),
            HOW,
            "its grid mapping datum has no crs_wkt, spatial_ref, epsg_code; give",
        ),
        (
            lambda p: write_netcdf(p / "a.nc", lat=LAT * 1e5),
            HOW,
            "coordinates reach 4.*, which is no latitude; give",
        ),
        (lambda p: write_lines(p / "a.csv", header=""), LINE_HOW, "has no header for its rows of 3 values"),
        (lambda p: write_line(p / "a.csv", 0.0, 1e-4), LINE_HOW, "places are 0 m wide .* makes no area"),
        (lambda p: write_line(p / "a.csv", 1e-4, 1e-4), LINE_HOW, "which makes no area; a map needs several"),
        (lambda p: write_line(p / "a.csv", 0.0, 0.0), LINE_HOW, "which makes no area"),
        (lambda p: write_empty(p / "a.csv"), LINE_HOW, "it is empty"),
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
    assert "--values total" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["--height", "nan"], "--height nan is not a finite number"),
        (["--home", "47.4,8.5"], "--home '47.4,8.5' is not three numbers; accepted is LAT,LON,ALT"),
        (["--home", "95,8.5,0"], "--home '95,8.5,0': latitude 95.0 deg is not in -90..90; accepted is"),
        (["--column", "9"], "has no --column '9'; there are 1"),
    ],
)
def test_the_command_refuses_options_by_their_names(tmp_path, capsys, changes, words):
    source = write_geotiff(tmp_path / "map.tif")
    assert cli.run_command_line(["map", "make", str(source), "--out", str(tmp_path / "a.npz"), *changes]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
    assert not (tmp_path / "a.npz").exists()


@pytest.mark.parametrize(("spacing", "words"), [([], "not stated"), (["--line-spacing", "250"], "250 m")])
def test_info_prints_the_line_spacing(tmp_path, capsys, spacing, words):
    source, out = write_geotiff(tmp_path / "map.tif"), tmp_path / "map.npz"
    assert cli.run_command_line(["map", "make", str(source), "--out", str(out), *spacing]) == 0
    assert cli.run_command_line(["map", "info", str(out)]) == 0
    assert f"line spacing {words}\n" in capsys.readouterr().out.splitlines(keepends=True)[-1]


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


def write_dense(path, marker="-9999.99"):
    """Line data whose readings are denser than the map's grid, one of them a marker of missing data."""
    rows = ["lon,lat,tmi"]
    for east in range(8):
        for north in range(300):
            lon, lat = 8.55 + east * 0.002, 47.4 + north * 0.00005
            rows.append(f"{lon:.6f},{lat:.6f},{field_nt(lat, lon):.3f}")
    rows[1000] = rows[1000].rpartition(",")[0] + f",{marker}"
    path.write_text("\n".join(rows) + "\n")
    return path


def test_one_marker_of_missing_data_among_dense_readings_is_refused_or_left_out(tmp_path):
    """The mean with its neighbours would be plausible again."""
    how = MapImport(line_spacing_m=150.0, home=HOME)
    path = write_dense(tmp_path / "a.csv")
    with pytest.raises(EstimatorError, match=r"such as -9999.99 nT.*: 1 of 2400 values.*`no_data` -9999.99"):
        imported_map(path, how)
    check(imported_map(path, replace(how, no_data=-9999.99)), least=0.5)
    check(imported_map(write_dense(path, "*"), how), least=0.5)


def test_a_marker_in_a_netcdf_grid_is_refused_or_left_out(tmp_path):
    path = write_netcdf(tmp_path / "a.nc")
    with netcdf.Dataset(path, "a") as dataset:
        dataset["z"][60, 50] = -99999.0
    with pytest.raises(EstimatorError, match=r"such as -99999 nT"):
        imported_map(path, HOW)
    check(imported_map(path, replace(HOW, no_data=-99999.0)))


GEOSOFT = """\
/ ------------------------------------------------------------------------------
/ XYZ EXPORT [01/02/2020]
/ DATABASE   [.\\block_a.gdb]
/ ------------------------------------------------------------------------------
/
/  LONGITUDE     LATITUDE     RALT          TMI
/=========== ============ ======== ============
/
"""


def write_table(path, header, row, *, lines=("Line", "Tie", "Base", "Random", "Test")):
    rows = [header] if header else []
    for east in range(8):
        if lines:
            rows += [f"{lines[east % len(lines)]}  L{1000 + 10 * east}:1", "//Flight 12", "//Date 2020/02/01"]
        for north in range(30):
            lon, lat = 8.55 + east * 0.002, 47.4 + north * 0.0005
            rows.append(row(lon, lat, field_nt(lat, lon) if north != 7 else math.nan))
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("header", "row", "lines"),
    [
        (GEOSOFT, lambda x, y, v: f"  {x:.6f} {y:.6f} 480.0 {v:.3f}".replace("nan", "*"), ("Line", "Tie")),
        (
            "/ LONGITUDE LATITUDE RALT TMI",
            lambda x, y, v: f"{x:.6f} {y:.6f} 480.0 {v:.3f}".replace("nan", "*"),
            ("Line", "Base", "Test", "Random"),
        ),
        ("Longitude (deg);Latitude (deg);TMI (nT)", lambda x, y, v: f"{x:.6f};{y:.6f};{v:.3f}", ()),
        (
            "Lon;Lat;Mag [nT]",
            lambda x, y, v: f"{x:.6f};{y:.6f};{v:.3f}".replace(".", ","),  # a decimal comma
            (),
        ),
        ("lon\tlat\tmag", lambda x, y, v: f"{x:.6f}\t{y:.6f}\t{v:.3f}", ()),
        ("# lon lat mag", lambda x, y, v: f"{x:.6f} {y:.6f} {v:.3f}", ()),
        ('"lon","lat","area, name","mag"', lambda x, y, v: f'{x:.6f},{y:.6f},"a, b",{v:.3f}', ()),
    ],
)
def test_tables_as_other_programs_write_them(tmp_path, header, row, lines):
    path = write_table(tmp_path / "a.xyz", header, row, lines=lines)
    found = imported_map(path, MapImport(line_spacing_m=150.0, home=HOME))
    check(found, atol=1.0, least=0.5)  # linear over the place without a value


def surfer_ascii(values, x, y):
    head = (
        f"DSAA\n{len(x)} {len(y)}\n{x[0]} {x[-1]}\n{y[0]} {y[-1]}\n{np.nanmin(values)} {np.nanmax(values)}\n"
    )
    return (head + "\n".join(" ".join(f"{v:.4f}" for v in row) for row in values) + "\n").encode()


def surfer_6(values, x, y):
    head = struct.pack(
        "<4shh6d", b"DSBB", len(x), len(y), x[0], x[-1], y[0], y[-1], values.min(), values.max()
    )
    return head + values.astype("<f4").tobytes()


def surfer_7(values, x, y):
    step = x[1] - x[0], y[1] - y[0]
    grid = struct.pack(
        "<ii8d", len(y), len(x), x[0], y[0], *step, values.min(), values.max(), 0.0, 1.70141e38
    )
    header = struct.pack("<iii", 0x42525344, 4, 2) + struct.pack("<ii", 0x44495247, len(grid)) + grid
    data = values.astype("<f8").tobytes()
    return header + struct.pack("<ii", 0x41544144, len(data)) + data


def esri(values, x, y, *, corner=True):
    step = x[1] - x[0]
    at = (x[0] - 0.5 * step, y[0] - 0.5 * step, "corner") if corner else (x[0], y[0], "center")
    head = f"ncols {len(x)}\nnrows {len(y)}\nxll{at[2]} {at[0]}\nyll{at[2]} {at[1]}\ncellsize {step}\n"
    rows = "\n".join(" ".join(f"{v:.4f}" for v in row) for row in values[::-1])
    return (head + "NODATA_value -99999\n" + rows + "\n").encode()


@pytest.mark.parametrize(
    "made", [surfer_ascii, surfer_6, surfer_7, esri, lambda *a: esri(*a, corner=False)], ids=range(5)
)
def test_grids_of_surfer_and_esri_are_where_they_belong(tmp_path, made):
    from rasterio.warp import transform

    east, north = transform("EPSG:4326", UTM, [8.55], [47.4])
    x, y = east[0] + 30.0 * np.arange(-50, 51), north[0] + 30.0 * np.arange(-45, 46)
    columns, rows = np.meshgrid(x, y)
    lon, lat = transform(UTM, "EPSG:4326", columns.ravel(), rows.ravel())
    values = field_nt(np.array(lat), np.array(lon)).reshape(rows.shape)
    path = tmp_path / "a.grd"  # the name does not count
    path.write_bytes(made(values, x, y))
    check(imported_map(path, replace(HOW, crs=UTM)))
    with pytest.raises(EstimatorError, match="no coordinate reference system; give it with `crs`"):
        imported_map(path, HOW)


def test_a_table_that_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(map_table, "_MAX_BYTES", 1 << 20)
    path = tmp_path / "a.csv.xz"
    path.write_bytes(lzma.compress(b"lon,lat,mag\n" + b"8.55,47.4,48000\n" * 100_000))
    with pytest.raises(EstimatorError, match="more than 1048576 bytes, unpacked"):
        imported_map(path, LINE_HOW)
    path.write_bytes(lzma.compress(b"lon,lat,mag\n" + b"8" * (1 << 20)))
    with pytest.raises(EstimatorError, match=r"a line of more than|bytes, unpacked"):
        imported_map(path, LINE_HOW)
    path.write_bytes(lzma.compress(b"lon,lat,mag\n" + b"8.55,47.4,48000\n" * 1000)[:-40])
    with pytest.raises(EstimatorError, match="it ends before its data do"):
        imported_map(path, LINE_HOW)
